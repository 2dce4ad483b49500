//! Files as nobody should write them, and valid ones that few readers take, built from scratch.

/// What must become of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Expected {
    /// Accepted, with so many vertices and triangles.
    Accepted(usize, usize),
    /// Refused with a sentence that contains these words.
    Refused(&'static str),
}

/// One file and what must become of it.
#[derive(Clone, Debug)]
pub struct Nasty {
    /// File name, unique.
    pub name: String,
    /// Content.
    pub bytes: Vec<u8>,
    /// Outcome.
    pub expected: Expected,
}

use Expected::{Accepted, Refused};

/// All of them.
pub fn all() -> Vec<Nasty> {
    let parts = [ply_text(), ply_binary(), obj(), stl(), pcd(), xyz(), depth(), names(), geometry()];
    parts.into_iter().flatten().collect()
}

fn case(name: &str, bytes: impl Into<Vec<u8>>, expected: Expected) -> Nasty {
    Nasty { name: name.into(), bytes: bytes.into(), expected }
}

const XYZ: &str = "property float x\nproperty float y\nproperty float z\n";
const FACE: &str = "property list uchar int vertex_indices\n";
const SQUARE: &str = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n";

fn head(format: &str, elements: &str) -> String {
    format!("ply\nformat {format} 1.0\n{elements}end_header\n")
}

/// An ascii PLY of a square with these faces.
fn square(faces: &str) -> String {
    let count = faces.lines().count();
    let elements = format!("element vertex 4\n{XYZ}element face {count}\n{FACE}");
    head("ascii", &elements) + SQUARE + faces
}

fn ply_text() -> Vec<Nasty> {
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
            with("element face", &format!("comment {}\nelement face", "x".repeat(70_000))),
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
    ]
}

/// A square in any number types and order of bytes, with an index of another size.
fn binary(big: bool, double: bool, short: bool) -> Vec<u8> {
    let number = if double { "double" } else { "float" };
    let format = if big { "binary_big_endian" } else { "binary_little_endian" };
    let index = if short { "short" } else { "uint" };
    let elements =
        format!("element vertex 4\n{XYZ}element face 2\nproperty list uchar {index} vertex_index\n");
    let mut bytes = head(format, &elements.replace("float", number)).into_bytes();
    let mut put = |little: &[u8]| {
        let ordered: Vec<u8> = if big { little.iter().rev().copied().collect() } else { little.to_vec() };
        bytes.extend(ordered);
    };
    for value in [0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0_u8] {
        if double { put(&f64::from(value).to_le_bytes()) } else { put(&f32::from(value).to_le_bytes()) }
    }
    for row in [[0, 1, 2], [0, 2, 3_u8]] {
        put(&[3]);
        for index in row {
            if short { put(&u16::from(index).to_le_bytes()) } else { put(&u32::from(index).to_le_bytes()) }
        }
    }
    bytes
}

fn ply_binary() -> Vec<Nasty> {
    let mut cases = Vec::new();
    for (big, double, short) in (0..8).map(|i| (i & 1 > 0, i & 2 > 0, i & 4 > 0)) {
        let name = format!("binary_big_{big}_double_{double}_short_{short}.ply");
        cases.push(case(&name, binary(big, double, short), Accepted(4, 2)));
    }
    let good = binary(false, false, false);
    for cut in [1, 13, 26, 40] {
        cases.push(case(&format!("binary_cut_{cut}.ply"), &good[..good.len() - cut], Refused("needs")));
    }
    let mut index = good.clone();
    let last = index.len() - 1;
    index[last] = 0x7F;
    cases.push(case("binary_index.ply", index, Refused("a face names")));
    let mut nan = good.clone();
    let start = nan.len() - 26 - 48;
    nan[start..start + 4].copy_from_slice(&f32::NAN.to_le_bytes());
    cases.push(case("binary_nan.ply", nan, Refused("not finite")));
    cases
}

fn obj() -> Vec<Nasty> {
    let corners = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";
    let with = |faces: &str| format!("{corners}{faces}");
    vec![
        case("quad.obj", with("f 1 2 3 4\n"), Accepted(4, 2)),
        case("negative.obj", with("f -4 -3 -2 -1\n"), Accepted(4, 2)),
        case("continued.obj", with("f 1 2 \\\n 3 \\\r\n 4\n"), Accepted(4, 2)),
        case(
            "colours.obj",
            with("v 0 0 1 0.5 0.5 0.5\nf 1 2 5\nf 2 3 5\n").replace("v 0 1 0\n", ""),
            Refused("names vertex 5"),
        ),
        case("coloured.obj", "v 0 0 0 1 0 0\nv 1 0 0 1 0 0\nv 0 1 0 0 1 0\nf 1 2 3\n", Accepted(3, 1)),
        case("slashes.obj", with("vt 0 0\nvn 0 0 1\nf 1/1/1 2//1 3/1\nf 1 3 4\n"), Accepted(4, 2)),
        case(
            "materials.obj",
            with("mtllib no.mtl\nusemtl a\ng b\ns off\nf 1 2 3 4\nl 1 2\n"),
            Accepted(4, 2),
        ),
        case("faces_first.obj", format!("f 1 2 3 4\n{corners}"), Accepted(4, 2)),
        case("crlf.obj", with("f 1 2 3 4\n").replace('\n', "\r\n"), Accepted(4, 2)),
        case("zero.obj", with("f 0 1 2\n"), Refused("names vertex 0")),
        case("beyond.obj", with("f 1 2 9\n"), Refused("names vertex 9")),
        case("before.obj", with("f 1 2 -9\n"), Refused("names vertex -9")),
        case("word.obj", with("f a b c\n"), Refused("is not a number")),
        case("nan.obj", with("v nan 0 0\nf 1 2 3\n"), Refused("not finite")),
        case("two.obj", with("v 1 2\n"), Refused("2 values")),
        case("nothing.obj", "o empty\n", Refused("no vertices")),
    ]
}

/// A binary STL of two triangles that announces `count`.
fn stl_bytes(title: &[u8], count: u32) -> Vec<u8> {
    let mut bytes = title.to_vec();
    bytes.resize(80, 0);
    bytes.extend(count.to_le_bytes());
    for corners in [[0, 0, 0, 1, 0, 0, 1, 1, 0], [0, 0, 0, 1, 1, 0, 0, 1, 0_u8]] {
        bytes.extend([0; 12]);
        bytes.extend(corners.iter().flat_map(|&value| f32::from(value).to_le_bytes()));
        bytes.extend([0; 2]);
    }
    bytes
}

const STL: &str = "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\n\
    endfacet\nendsolid a\n";

fn stl() -> Vec<Nasty> {
    let mut nan = stl_bytes(b"x", 2);
    nan[96..100].copy_from_slice(&f32::NAN.to_le_bytes());
    vec![
        case("two.stl", stl_bytes(b"x", 2), Accepted(4, 2)),
        case("solid.stl", stl_bytes(b"solid a\nfacet normal", 2), Accepted(4, 2)),
        case("text.stl", STL, Accepted(3, 1)),
        case("upper.stl", STL.to_uppercase(), Accepted(3, 1)),
        case("crlf.stl", STL.replace('\n', "\r\n"), Accepted(3, 1)),
        case("more.stl", stl_bytes(b"x", 3), Refused("announces 3 triangles")),
        case("less.stl", stl_bytes(b"x", 1), Refused("announces 1 triangles")),
        case("billions.stl", stl_bytes(b"solid x", u32::MAX), Refused("announces 4294967295")),
        case("zero.stl", &stl_bytes(b"x", 0)[..84], Refused("no vertices")),
        case("cut.stl", &stl_bytes(b"x", 2)[..100], Refused("announces")),
        case("short.stl", &stl_bytes(b"x", 2)[..50], Refused("header")),
        case("nan.stl", nan, Refused("not finite")),
        case("no_end.stl", STL.replace("endsolid a\n", ""), Refused("endsolid")),
        case("two_corners.stl", STL.replace("vertex 0 1 0\n", ""), Refused("2 corners")),
        case("word.stl", STL.replace("vertex 0 1 0", "vortex 0 1 0"), Refused("no word of an STL")),
    ]
}

fn pcd_head(points: usize, data: &str) -> String {
    format!(
        "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\n\
         COUNT 1 1 1\nWIDTH {points}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {points}\nDATA {data}\n"
    )
}

fn pcd() -> Vec<Nasty> {
    let text = pcd_head(4, "ascii") + SQUARE;
    let floats: Vec<u8> =
        [0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0_u8].iter().flat_map(|&v| f32::from(v).to_le_bytes()).collect();
    let binary = [pcd_head(4, "binary").as_bytes(), &floats].concat();
    let packed = |size: u32, data: &[u8]| {
        let head = pcd_head(4, "binary_compressed").into_bytes();
        [head, (data.len() as u32).to_le_bytes().to_vec(), size.to_le_bytes().to_vec(), data.to_vec()]
            .concat()
    };
    // Columns: x, then y, then z, as two literal runs of 24 bytes.
    let column = |axis: usize| floats.chunks(4).skip(axis).step_by(3).flatten().copied().collect::<Vec<u8>>();
    let columns = [column(0), column(1), column(2)].concat();
    let literal: Vec<u8> = columns.chunks(24).flat_map(|run| [&[23][..], run].concat()).collect();
    vec![
        case("text.pcd", text.clone(), Accepted(4, 0)),
        case("binary.pcd", binary.clone(), Accepted(4, 0)),
        case("packed.pcd", packed(48, &literal), Accepted(4, 0)),
        case("nan.pcd", text.replacen("1 1 0", "nan nan nan", 1), Accepted(3, 0)),
        case("all_nan.pcd", pcd_head(1, "ascii") + "nan nan nan\n", Refused("no vertices")),
        case("cut.pcd", &binary[..binary.len() - 5], Refused("needs 48 bytes")),
        case("cut_text.pcd", pcd_head(9, "ascii") + SQUARE, Refused("POINTS says 9")),
        case("billions.pcd", pcd_head(4_000_000_000, "binary"), Refused("needs")),
        case("packed_bomb.pcd", packed(u32::MAX, &literal), Refused("unpacks to")),
        case("packed_cut.pcd", packed(48, &literal[..20]), Refused("damaged")),
        case("packed_back.pcd", packed(48, &[2 << 5, 200]), Refused("damaged")),
        case("type.pcd", text.replace("TYPE F", "TYPE Q"), Refused("TYPE Q")),
        case("lengths.pcd", text.replace("SIZE 4 4 4", "SIZE 4 4"), Refused("different lengths")),
        case("no_z.pcd", text.replace("FIELDS x y z", "FIELDS x y w"), Refused("x, y and z are missing")),
        case("data.pcd", text.replace("DATA ascii", "DATA zip"), Refused("not known")),
        case("no_data.pcd", text.split("DATA").next().unwrap_or_default(), Refused("DATA")),
    ]
}

fn xyz() -> Vec<Nasty> {
    vec![
        case("blanks.xyz", SQUARE.replace(' ', "\t  "), Accepted(4, 0)),
        case("commas.xyz", SQUARE.replace(' ', ", "), Accepted(4, 0)),
        case("semicolons.csv", SQUARE.replace(' ', ";"), Accepted(4, 0)),
        case("heading.txt", format!("x y z\n{SQUARE}"), Accepted(4, 0)),
        case("heading.xyz", format!("x y z\n{SQUARE}"), Accepted(4, 0)),
        case("remarks.xyz", format!("# a\n// b\n\n{}", SQUARE.replace("1 1 0", "1 1 0 # c")), Accepted(4, 0)),
        case("mark.xyz", format!("\u{feff}{SQUARE}"), Accepted(4, 0)),
        case("ragged.xyz", "0 0 0\n1 0\n", Refused("2 values")),
        case("four.xyz", "0 0 0 7\n1 0 0 7\n", Refused("4 values")),
        case("nan.xyz", "0 0 0\nnan 0 0\n", Refused("not finite")),
        case("word.xyz", "0 0 0\n1 x 0\n", Refused("is not a number")),
    ]
}

fn depth() -> Vec<Nasty> {
    vec![
        case("empty.json", "", Refused("")),
        case("text.json", "not json", Refused("scan.json needs")),
        case(
            "none.json",
            r#"{"camera":{"fx":1,"fy":1,"cx":0,"cy":0,"depth_unit_mm":1},"views":[]}"#,
            Refused("views"),
        ),
        case(
            "focal.json",
            r#"{"camera":{"fx":0,"fy":1,"cx":0,"cy":0,"depth_unit_mm":1},"views":[]}"#,
            Refused("camera.fx"),
        ),
        case("deep.json", "[".repeat(100_000), Refused("scan.json needs")),
        case("alone.png", &b"\x89PNG\r\n\x1a\n"[..], Refused("scan.json")),
    ]
}

fn names() -> Vec<Nasty> {
    vec![
        case("empty.ply", "", Refused("empty")),
        case("ply.stl", square("4 0 1 2 3\n"), Accepted(4, 2)),
        case("stl.ply", stl_bytes(b"x", 2), Accepted(4, 2)),
        case("obj.xyz", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", Accepted(3, 1)),
        case("pcd.obj", pcd_head(4, "ascii") + SQUARE, Accepted(4, 0)),
        case("xyz.ply", SQUARE, Accepted(4, 0)),
        case("nothing", SQUARE, Accepted(4, 0)),
        case("letter.doc", "Dear all,\n", Refused("format is not known")),
        case("picture.ply", &b"\x89PNG\r\n\x1a\n"[..], Refused("picture")),
        case("zeros.ply", vec![0; 5000], Refused("")),
        case("zeros.bin", vec![0; 5000], Refused("")),
    ]
}

fn geometry() -> Vec<Nasty> {
    let points = |text: &str, faces: &str| square(faces).replace(SQUARE, text);
    vec![
        case("flat.ply", points("0 0 0\n1 0 0\n2 0 0\n3 0 0\n", "3 0 1 2\n"), Refused("has an area")),
        case("one_place.ply", points("5 5 5\n5 5 5\n5 5 5\n5 5 5\n", "3 0 1 2\n"), Refused("one place")),
        case("copies.ply", square("3 0 1 2\n3 1 2 0\n3 0 2 3\n"), Accepted(4, 2)),
        case("unused.ply", square("3 0 1 2\n"), Accepted(3, 1)),
        case("same_corner.ply", square("3 0 0 2\n3 0 2 3\n"), Accepted(3, 1)),
        case("turned.ply", square("3 0 1 2\n3 0 3 2\n"), Accepted(4, 2)),
        case(
            "far.ply",
            points("1e9 0 0\n1000000064 0 0\n1000000064 64 0\n1e9 64 0\n", "3 0 1 2\n"),
            Refused("from the origin"),
        ),
        case("huge.ply", points("1e38 0 0\n0 1e38 0\n0 0 1e38\n1 0 0\n", "3 0 1 2\n"), Refused("no object")),
    ]
}
