//! PLY as text.

use super::Expected::{Accepted, Refused};
use super::{FACE, Nasty, SQUARE, XYZ, case, head, square};

pub(super) fn cases() -> Vec<Nasty> {
    let good = square("3 0 1 2\n3 0 2 3\n");
    let with = |from: &str, to: &str| good.replacen(from, to, 1);
    let strips = |row: &str| {
        let elements =
            format!("element vertex 4\n{XYZ}element tristrips 1\nproperty list int int vertex_indices\n");
        head("ascii", &elements) + SQUARE + row
    };
    let first = format!("element face 1\n{FACE}element vertex 4\n{XYZ}");
    let order = "element vertex 3\nproperty uchar red\nproperty float z\nproperty list uchar float w\n\
        property double x\nproperty float y\nelement face 1\nproperty float q\n";
    let order = head("ascii", &format!("{order}{FACE}"));
    vec![
        case("quad.ply", square("4 0 1 2 3\n"), Accepted(4, 2)),
        case("crlf.ply", good.replace('\n', "\r\n"), Accepted(4, 2)),
        case("cr.ply", good.replace('\n', "\r"), Accepted(4, 2)),
        case(
            "comment.ply",
            with("element face", &format!("comment {}\nelement face", "x".repeat(100_000))),
            Accepted(4, 2),
        ),
        case(
            "many_comments.ply",
            with("element face", &format!("{}element face", "comment\n".repeat(20_000))),
            Accepted(4, 2),
        ),
        case("vertex_index.ply", with("vertex_indices", "vertex_index"), Accepted(4, 2)),
        case("faces_first.ply", head("ascii", &first) + "4 0 1 2 3\n" + SQUARE, Accepted(4, 2)),
        case("strip.ply", strips("4 0 1 3 2\n"), Accepted(4, 2)),
        case("strips.ply", strips("7 0 1 2 -1 0 2 3\n"), Accepted(4, 2)),
        case("strip_index.ply", strips("3 0 1 9\n"), Refused("names vertex 9")),
        case("order.ply", order + "1 0 0 5 6\n2 0 2 7 7 8 6\n3 0 1 1 5 9\n0.5 3 0 1 2\n", Accepted(3, 1)),
        case("no_newline.ply", good.trim_end(), Accepted(4, 2)),
        case("cut.ply", &good.as_bytes()[..good.len() - 9], Refused("")),
        case("cut_header.ply", &good.as_bytes()[..60], Refused("end_header")),
        case("index.ply", square("3 0 1 4\n"), Refused("names vertex 4")),
        case("negative.ply", square("3 0 1 -1\n"), Refused("names vertex -1")),
        case("fraction.ply", square("3 0 1 1.5\n"), Refused("a face names")),
        case("nan.ply", with("1 1 0", "1 nan 0"), Refused("not finite")),
        case("infinite.ply", with("1 1 0", "1e999 1 0"), Refused("not finite")),
        case("comma.ply", with("1 1 0", "1,5 1 0"), Refused("is not a number")),
        case("long_row.ply", with("1 1 0", "1 1 0 7"), Refused("not as many values")),
        case("negative_list.ply", square("-3 0 1 2\n"), Refused("list has the length -3")),
        case("huge_list.ply", square("4000000000 0 1 2\n"), Refused("")),
        case("billions.ply", with("element vertex 4", "element vertex 4000000000"), Refused("needs")),
        case(
            "overflow.ply",
            with("element vertex 4", "element vertex 99999999999999999999999"),
            Refused("not a number"),
        ),
        case("no_z.ply", with("property float z\n", ""), Refused("no properties x, y and z")),
        case("no_format.ply", with("format ascii 1.0\n", ""), Refused("format")),
        case("version.ply", with("1.0", "3.0"), Refused("does not belong")),
        case("type.ply", with("float x", "quaternion x"), Refused("quaternion")),
        case("twice.ply", with("element face", "element vertex"), Refused("twice")),
        case("no_list.ply", with(FACE, "property int vertex_indices\n"), Refused("no list")),
        case("no_vertices.ply", head("ascii", &format!("element vertex 0\n{XYZ}")), Refused("no vertices")),
        case("mark.ply", format!("\u{feff}{good}"), Accepted(4, 2)),
        case("blanks.ply", with("ply\n", "ply \t\n"), Accepted(4, 2)),
        case("leading_line.ply", format!("\n{good}"), Refused("is not \"ply\"")),
        case("capitals.ply", with("float x", "float X").replace("float z", "float Z"), Accepted(4, 2)),
        case("tabs.ply", with("element vertex", "element\tvertex"), Accepted(4, 2)),
        case(
            "obj_info.ply",
            with("element face", "obj_info num_cols 512\nobj_info\nelement face"),
            Accepted(4, 2),
        ),
        case("no_rows.ply", with("end_header", "element nothing 4000000000\nend_header"), Accepted(4, 2)),
        case("trillions.ply", with("face 2", "face 18446744073709551615"), Refused("the face table needs")),
        case("elements.ply", elements(), Accepted(4, 2)),
        case("normals.ply", normals(), Accepted(4, 2)),
    ]
}

/// Tables that are none of ours, before and after the faces.
fn elements() -> String {
    let tables = format!(
        "element vertex 4\n{XYZ}element edge 1\nproperty int vertex1\nproperty int vertex2\nelement face 1\n{FACE}\
         element material 1\nproperty uchar red\nproperty list uchar char name\n"
    );
    head("ascii", &tables) + SQUARE + "0 1\n4 0 1 2 3\n9 3 1 2 3\n"
}

/// Normals that are none.
fn normals() -> String {
    let names = "property float nx\nproperty float ny\nproperty float nz\n";
    let rows = "0 0 0 nan nan nan\n1 0 0 0 0 1\n1 1 0 inf 0 0\n0 1 0 0 0 0\n4 0 1 2 3\n";
    head("ascii", &format!("element vertex 4\n{XYZ}{names}element face 1\n{FACE}")) + rows
}
