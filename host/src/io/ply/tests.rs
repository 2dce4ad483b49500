use super::*;
use crate::io::error::Place;
use crate::mesh::{Point, Vector};

fn parse(bytes: &[u8]) -> Result<Mesh, Fault> {
    Ok(super::parse(bytes)?.mesh)
}

/// A header of the given encoding; lines of `tables` are elements and properties.
fn header(encoding: &str, tables: &str) -> Vec<u8> {
    format!("ply\nformat {encoding} 1.0\ncomment by hand\n{tables}\nend_header\n").into_bytes()
}

const XYZ: &str = "property float x\nproperty float y\nproperty float z";
const FACE: &str = "property list uchar int vertex_indices";

fn ascii(tables: &str, rows: &str) -> Result<Mesh, Fault> {
    parse(&[header("ascii", tables), rows.into()].concat())
}

/// The unit square as float x y z and two triangles, in one of the byte orders.
fn binary(little: bool) -> Vec<u8> {
    let tables = format!("element vertex 4\n{XYZ}\nelement face 2\n{FACE}");
    let mut bytes = header(if little { "binary_little_endian" } else { "binary_big_endian" }, &tables);
    let word = |bits: u32| if little { bits.to_le_bytes() } else { bits.to_be_bytes() };
    for value in [0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.0] {
        bytes.extend(word(value.to_bits()));
    }
    for triangle in [[0, 1, 2], [0, 2, 3]] {
        bytes.push(3);
        bytes.extend(triangle.into_iter().flat_map(word));
    }
    bytes
}

fn square() -> Mesh {
    let points = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
    Mesh { points: points.map(Point::from).to_vec(), normals: vec![], triangles: vec![[0, 1, 2], [0, 2, 3]] }
}

const CORNERS: &str = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n";

#[test]
fn all_encodings_give_the_same_mesh() {
    let tables = format!("element vertex 4\n{XYZ}\nelement face 2\n{FACE}");
    assert_eq!(ascii(&tables, &format!("{CORNERS}3 0 1 2\n3 0 2 3")), Ok(square()));
    assert_eq!(parse(&binary(true)), Ok(square()));
    assert_eq!(parse(&binary(false)), Ok(square()));
}

#[test]
fn crlf_and_cr_ends_of_line_are_read() {
    let tables = format!("element vertex 4\n{XYZ}\nelement face 1\n{FACE}");
    let text = [header("ascii", &tables), format!("{CORNERS}4 0 1 2 3\n").into()].concat();
    for end in ["\r\n", "\r"] {
        let text = String::from_utf8(text.clone()).unwrap().replace('\n', end);
        assert_eq!(parse(text.as_bytes()), Ok(square()));
        let bytes = binary(true);
        let split = bytes.windows(11).position(|w| w == b"end_header\n").unwrap() + 11;
        let head = String::from_utf8(bytes[..split].into()).unwrap().replace('\n', end);
        assert_eq!(parse(&[head.as_bytes(), &bytes[split..]].concat()), Ok(square()));
    }
}

#[test]
fn quads_and_polygons_become_fans() {
    let tables = format!("element vertex 5\n{XYZ}\nelement face 4\nproperty list uchar int vertex_index");
    let mesh = ascii(&tables, &format!("{CORNERS}0 .5 0\n4 0 1 2 3\n5 0 1 2 3 4\n2 0 1\n0\n")).unwrap();
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3], [0, 1, 2], [0, 2, 3], [0, 3, 4]]);
}

#[test]
fn a_quad_among_binary_triangles_does_not_disturb_them() {
    let mut bytes = binary(true);
    let at = bytes.len() - 26;
    bytes.splice(at..at, [4].into_iter().chain([0_u32, 1, 2, 3].into_iter().flat_map(u32::to_le_bytes)));
    let text = String::from_utf8_lossy(&bytes).find("face 2").unwrap();
    bytes[text + 5] = b'3';
    assert_eq!(parse(&bytes).unwrap().triangles, [[0, 1, 2], [0, 2, 3], [0, 1, 2], [0, 2, 3]]);
}

#[test]
fn faces_may_stand_before_vertices() {
    let tables = format!("element face 1\n{FACE}\nelement vertex 4\n{XYZ}");
    assert_eq!(ascii(&tables, &format!("4 0 1 2 3\n{CORNERS}")), Ok(square()));
}

#[test]
fn extra_elements_properties_and_lists_are_skipped() {
    let tables = "element camera 1\nproperty float view\nproperty list uchar short path\n\
        element empty 7\nelement vertex 4\nproperty uchar red\nproperty double z\nproperty list int float w\n\
        property short y\nproperty char x\nelement face 1\nproperty float area\n\
        property list ushort uint vertex_indices\nproperty list uchar float texcoord\nproperty int flags\n\
        element edge 1\nproperty int a\nproperty int b";
    let rows = "1.5 2 7 8\n9 0 1 5.5 0 0\n9 0 0 0 1\n9 0 2 1 2 1 1\n9 0 0 1 0\n\
        1.0 4 0 1 2 3 2 .5 .5 -1\n0 1\n";
    assert_eq!(ascii(tables, rows), Ok(square()));
}

#[test]
fn binary_rows_of_mixed_types_are_read_in_both_orders() {
    let tables =
        "element vertex 1\nproperty double z\nproperty uchar red\nproperty float x\nproperty short y";
    let little = [&(-1.5_f64).to_le_bytes()[..], &[9], &2.5_f32.to_le_bytes(), &(-3_i16).to_le_bytes()];
    let big = [&(-1.5_f64).to_be_bytes()[..], &[9], &2.5_f32.to_be_bytes(), &(-3_i16).to_be_bytes()];
    for (encoding, row) in [("binary_little_endian", little.concat()), ("binary_big_endian", big.concat())] {
        let mesh = parse(&[header(encoding, tables), row].concat()).unwrap();
        assert_eq!(mesh.points, [Point::new(2.5, -3.0, -1.5)]);
    }
}

#[test]
fn binary_vertices_with_lists_are_read() {
    let tables = format!("element vertex 2\nproperty list uchar ushort w\n{XYZ}");
    let floats = |values: [f32; 3]| values.map(f32::to_le_bytes).concat();
    let rows = [vec![2, 0, 0, 0, 0], floats([1.0, 2.0, 3.0]), vec![0], floats([4.0, 5.0, 6.0])];
    let mesh = parse(&[header("binary_little_endian", &tables), rows.concat()].concat()).unwrap();
    assert_eq!(mesh.points, [Point::new(1.0, 2.0, 3.0), Point::new(4.0, 5.0, 6.0)]);
}

#[test]
fn point_clouds_keep_their_normals_in_all_encodings() {
    let tables = format!("element vertex 2\n{XYZ}\nproperty float nx\nproperty float ny\nproperty float nz");
    let expected = [Vector::z(), -Vector::y()];
    assert_eq!(ascii(&tables, "1 2 3 0 0 2\n4 5 6 0 -.5 0").unwrap().normals, expected);
    let values = [1.0_f32, 2.0, 3.0, 0.0, 0.0, 2.0, 4.0, 5.0, 6.0, 0.0, -0.5, 0.0];
    let bytes = [header("binary_little_endian", &tables), values.map(f32::to_le_bytes).concat()].concat();
    assert_eq!(parse(&bytes).unwrap().normals, expected);
    let bytes = [header("binary_big_endian", &tables), values.map(f32::to_be_bytes).concat()].concat();
    assert_eq!(parse(&bytes).unwrap().normals, expected);
}

#[test]
fn triangle_strips_alternate_and_restart() {
    let tables =
        format!("element vertex 4\n{XYZ}\nelement tristrips 1\nproperty list int int vertex_indices");
    let mesh = ascii(&tables, &format!("{CORNERS}8 0 1 3 2 -1 1 2 3")).unwrap();
    assert_eq!(mesh.triangles, [[0, 1, 3], [3, 1, 2], [1, 2, 3]]);
}

#[test]
fn an_index_out_of_range_is_an_error_with_its_place() {
    let tables = format!("element vertex 4\n{XYZ}\nelement face 1\n{FACE}");
    for index in [4, -1, i64::from(i32::MAX)] {
        let fault = ascii(&tables, &format!("{CORNERS}3 0 1 {index}")).unwrap_err();
        assert_eq!(fault, Problem::Index { index, vertices: 4 }.in_line(15));
    }
    let mut bytes = binary(true);
    let last = bytes.len() - 4;
    bytes[last] = 4;
    assert_eq!(parse(&bytes), Err(Problem::Index { index: 4, vertices: 4 }.at_byte(last - 9)));
}

#[test]
fn rows_that_do_not_fit_the_header_are_errors() {
    let tables = format!("element vertex 2\n{XYZ}");
    assert_eq!(ascii(&tables, "1 2 3 4\n1 2 3 4\n"), Err(source::too_long().in_line(9)));
    assert_eq!(ascii(&tables, "1 2\n1 2 3 4\n"), Err(source::too_long().in_line(10)));
    assert_eq!(ascii(&tables, "1 2 3\n\n4 5 x"), Err(Problem::NotANumber("x".into()).in_line(11)));
    assert_eq!(ascii(&tables, "1.0 2.0 3.0\n\n4 5"), Err(Problem::EndsEarly("a number").in_line(11)));
}

#[test]
fn impossible_counts_are_errors_before_anything_is_reserved() {
    let tables = format!("element vertex 4000000000\n{XYZ}");
    let fault = ascii(&tables, "1 2 3").unwrap_err();
    assert!(matches!(fault.problem, Problem::Truncated { needed: 24_000_000_000, .. }), "{fault:?}");
    let tables = format!("element vertex 1\n{XYZ}\nelement face 18446744073709551615\n{FACE}");
    let bytes = [header("binary_little_endian", &tables), vec![0; 13]].concat();
    assert!(matches!(parse(&bytes).unwrap_err().problem, Problem::Truncated { what: "the face table", .. }));
}

#[test]
fn impossible_lists_are_errors() {
    let tables = format!("element vertex 1\n{XYZ}\nelement face 1\nproperty list float int vertex_index");
    for length in ["-1", "1.5", "nan", "1e30"] {
        let fault = ascii(&tables, &format!("0 0 0\n{length} 0 0 0")).unwrap_err();
        assert_eq!(fault.place, Place::Line(12), "{length}");
    }
}

#[test]
fn non_finite_coordinates_name_the_vertex() {
    let fault = ascii(&format!("element vertex 2\n{XYZ}"), "inf 0 0\n0 nan 0").unwrap_err();
    assert_eq!(fault.problem, Problem::NotFinite { vertex: 0, count: 2 });
    assert_eq!(ascii(&format!("element vertex 2\n{XYZ}"), "0 0 0\n0 -inf 0").unwrap().points.len(), 1);
}

#[test]
fn files_without_vertices_positions_or_indices_say_so() {
    let none = Problem::NoVertices;
    assert_eq!(ascii("element vertex 0\nproperty float x", "").unwrap_err().problem, none);
    assert_eq!(ascii("element edge 0", "").unwrap_err().problem, none);
    let flat = ascii("element vertex 1\nproperty float x\nproperty float y", "0 0").unwrap_err();
    assert!(flat.problem.to_string().contains("x, y and z"));
    let tables = format!("element vertex 1\n{XYZ}\nelement face 1\nproperty int a");
    assert!(ascii(&tables, "0 0 0\n1").unwrap_err().problem.to_string().contains("vertex_indices"));
}

#[test]
fn a_completed_mesh_is_told() {
    let of = |comment: &str| {
        let text =
            String::from_utf8(header("ascii", &format!("element vertex 1\n{XYZ}"))).unwrap() + "1 2 3\n";
        super::parse(text.replace("by hand", comment).as_bytes()).unwrap().repairs
    };
    assert!(of("completed by lacuna 0.1.0 with the class face")[0].starts_with("this is a completed mesh"));
    assert_eq!(of("not completed by lacuna"), [""; 0]);
}
