use super::*;
use crate::io::Place;
use crate::mesh::Point;

const ASCII: &str = "solid vertex of a cone\n facet normal 0 0 1\n  outer loop\n   vertex 0 0 0\n\
    vertex 1 0 0\n VERTEX 0 1 0\n endloop\n endfacet\nfacet normal 0 0 1\r\nouter loop\n\
    vertex 1 0 -0\nvertex 1 1e0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid vertex\n";

/// A binary file whose header begins with `title`, announcing `count` triangles.
fn stl(title: &[u8], count: u32, triangles: &[[[f32; 3]; 3]]) -> Vec<u8> {
    let mut bytes = title.to_vec();
    bytes.resize(80, b' ');
    bytes.extend(count.to_le_bytes());
    for triangle in triangles {
        bytes.extend([0; 12]);
        bytes.extend(triangle.iter().flatten().flat_map(|value| value.to_le_bytes()));
        bytes.extend([0; 2]);
    }
    bytes
}

const SQUARE: [[[f32; 3]; 3]; 2] = [
    [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
    [[1.0, 0.0, -0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]],
];

fn mesh(bytes: &[u8]) -> Result<Mesh, Fault> {
    Ok(parse(bytes)?.mesh)
}

fn square() -> Mesh {
    let points = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]];
    Mesh { points: points.map(Point::from).to_vec(), normals: vec![], triangles: vec![[0, 1, 2], [1, 3, 2]] }
}

#[test]
fn binary_corners_are_welded() {
    assert_eq!(mesh(&stl(b"made by hand", 2, &SQUARE)), Ok(square()));
}

#[test]
fn ascii_corners_are_welded() {
    assert!(is_ascii(ASCII.as_bytes()));
    assert_eq!(mesh(ASCII.as_bytes()), Ok(square()));
}

#[test]
fn a_binary_file_that_says_solid_is_known_by_its_length() {
    assert_eq!(mesh(&stl(b"solid\nfacet", 2, &SQUARE)), Ok(square()));
}

#[test]
fn several_solids_are_one_mesh() {
    let twice = ASCII.repeat(2);
    assert_eq!(parse(twice.as_bytes()).unwrap().mesh.triangles.len(), 4);
}

#[test]
fn a_wrong_count_is_repaired_where_the_length_is_that_of_triangles() {
    for stated in [0, 1, 7, u32::MAX] {
        let loaded = parse(&stl(b"solid cube", stated, &SQUARE)).unwrap();
        assert_eq!(loaded.mesh, square());
        assert!(loaded.repairs[0].contains(&format!("announces {stated} triangles, the file has 2")));
    }
    let loaded = parse(&[&stl(b"x", 2, &SQUARE)[..], b"\n"].concat()).unwrap();
    assert_eq!(
        (loaded.mesh, loaded.repairs[0].as_str()),
        (square(), "1 bytes after the last triangle left out")
    );
}

#[test]
fn text_of_a_fitting_length_is_no_triangles() {
    let text = b"Dear all, the meeting is at noon. ".repeat(40);
    let wrong = parse(&text[..184]).unwrap_err().problem;
    assert!(matches!(wrong, Problem::TriangleCount { present: 2, .. }), "{wrong}");
}

#[test]
fn a_wrong_count_of_a_broken_length_is_an_error_with_both_numbers() {
    let expected = Problem::TriangleCount { stated: 7, present: 1 };
    assert_eq!(parse(&stl(b"cube", 7, &SQUARE)[..180]), Err(expected.clone().at_byte(80)));
    let text = expected.to_string();
    assert!(text.contains("7 triangles") && text.contains("that of 1"), "{text}");
}

#[test]
fn counts_of_billions_are_not_believed() {
    let expected = Problem::TriangleCount { stated: 4294967295, present: 0 };
    assert_eq!(parse(&stl(b"x", u32::MAX, &[])).unwrap_err().problem, expected);
}

#[test]
fn no_triangles_are_no_vertices() {
    assert_eq!(parse(&stl(b"x", 0, &[])).unwrap_err().problem, Problem::NoVertices);
    assert_eq!(parse(b"solid x\nendsolid x\n").unwrap_err().problem, Problem::NoVertices);
}

#[test]
fn non_finite_corners_are_named() {
    let mut bad = SQUARE;
    bad[1][2][0] = f32::NAN;
    assert_eq!(parse(&stl(b"x", 2, &bad)), Err(Problem::NotFinite { vertex: 5, count: 1 }.in_whole()));
    let text = ASCII.replace("1e0", "inf");
    assert_eq!(parse(text.as_bytes()), Err(Problem::NotFinite { vertex: 4, count: 1 }.in_whole()));
    let many: Vec<_> = std::iter::repeat_n(SQUARE[0], 19).chain([bad[1]]).collect();
    let loaded = parse(&stl(b"x", 20, &many)).unwrap();
    assert_eq!(loaded.mesh.triangles.len(), 19);
    assert_eq!(loaded.repairs, ["1 triangle without finite coordinates left out"]);
}

#[test]
fn errors_of_the_text_form_name_the_line() {
    let cases = [
        ("VERTEX 0 1 0\n", "", Fault { place: Place::Line(6), problem: Problem::Other(not_three(2)) }),
        ("VERTEX 0 1 0", "vertex 0 1", Problem::Columns { expected: "3", found: 2 }.in_line(6)),
        ("VERTEX 0 1 0", "vertex 0 1 o", Problem::NotANumber("o".into()).in_line(6)),
        ("VERTEX 0 1 0", "corner 0 1 0", unexpected(b"corner").in_line(6)),
        ("endsolid vertex", "", Problem::EndsEarly("\"endsolid\"").in_whole()),
    ];
    for (old, new, fault) in cases {
        assert_eq!(parse(ASCII.replacen(old, new, 1).as_bytes()), Err(fault));
    }
}
