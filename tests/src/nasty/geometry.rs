//! Coordinates and triangles that make no sense.

use super::Expected::{Accepted, Refused};
use super::{FACE, Nasty, SQUARE, XYZ, case, head, square};

pub(super) fn cases() -> Vec<Nasty> {
    [squares(), grids()].concat()
}

fn squares() -> Vec<Nasty> {
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

/// Vertices along a side of the grid.
const SIDE: u32 = 12;

/// A wavy sheet of 144 vertices and 242 triangles, 110 mm wide.
fn grid() -> (Vec<[f64; 3]>, Vec<[u32; 3]>) {
    let height = |x: u32, y: u32| 5.0 * (f64::from(x) * 0.5).sin() * (f64::from(y) * 0.4).cos();
    let place = |i: u32| [f64::from(i % SIDE) * 10.0, f64::from(i / SIDE) * 10.0, height(i % SIDE, i / SIDE)];
    let corner = |i: u32| i % SIDE + 1 < SIDE && i / SIDE + 1 < SIDE;
    let pair = |i: u32| [[i, i + 1, i + SIDE + 1], [i, i + SIDE + 1, i + SIDE]];
    ((0..SIDE * SIDE).map(place).collect(), (0..SIDE * SIDE).filter(|&i| corner(i)).flat_map(pair).collect())
}

fn ply(points: &[[f64; 3]], triangles: &[[u32; 3]]) -> String {
    let tables = format!("element vertex {}\n{XYZ}element face {}\n{FACE}", points.len(), triangles.len());
    let rows = points.iter().map(|[x, y, z]| format!("{x} {y} {z}\n"));
    let faces = triangles.iter().map(|[a, b, c]| format!("3 {a} {b} {c}\n"));
    head("ascii", &tables) + &rows.chain(faces).collect::<String>()
}

fn obj(points: &[[f64; 3]], triangles: &[[u32; 3]]) -> String {
    let rows = points.iter().map(|[x, y, z]| format!("v {x} {y} {z}\n"));
    let faces = triangles.iter().map(|t| format!("f {} {} {}\n", t[0] + 1, t[1] + 1, t[2] + 1));
    rows.chain(faces).collect()
}

fn stl(points: &[[f64; 3]], triangles: &[[u32; 3]]) -> Vec<u8> {
    let mut bytes = vec![b' '; 80];
    bytes.extend((triangles.len() as u32).to_le_bytes());
    for triangle in triangles {
        bytes.extend([0; 12]);
        let corners = triangle.iter().flat_map(|&v| points[v as usize]);
        bytes.extend(corners.flat_map(|value| (value as f32).to_le_bytes()));
        bytes.extend([0; 2]);
    }
    bytes
}

fn grids() -> Vec<Nasty> {
    let (points, triangles) = grid();
    let moved = |change: &dyn Fn(usize, [f64; 3]) -> [f64; 3]| -> Vec<[f64; 3]> {
        points.iter().enumerate().map(|(i, &p)| change(i, p)).collect()
    };
    let missing = |share: usize| moved(&|i, p| if i % share == 5 { [f64::NAN; 3] } else { p });
    let with = |more: &[[u32; 3]]| [&triangles[..], more].concat();
    let turned: Vec<[u32; 3]> = triangles
        .iter()
        .enumerate()
        .map(|(i, &[a, b, c])| if i % 3 == 0 { [a, c, b] } else { [a, b, c] })
        .collect();
    let back: Vec<[u32; 3]> = triangles.iter().map(|&[a, b, c]| [a, c, b]).collect();
    let loose: Vec<[f64; 3]> = triangles.iter().flatten().map(|&v| points[v as usize]).collect();
    let apart: Vec<[u32; 3]> = (0..triangles.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    let flat = moved(&|_, [x, _, _]| [x, 0.0, 0.0]);
    let spike = [&points[..], &[[1e6; 3]]].concat();
    let digits = moved(&|_, p| p.map(|c| f64::from((c + 1e7) as f32)));
    vec![
        case("few_nan.ply", ply(&missing(77), &triangles), Accepted(142, 233)),
        case("few_nan.obj", obj(&missing(77), &triangles), Accepted(142, 233)),
        case("few_nan.stl", stl(&missing(77), &triangles), Accepted(142, 233)),
        case("many_nan.ply", ply(&missing(6), &triangles), Refused("not finite")),
        case("all_nan.ply", ply(&moved(&|_, _| [f64::NAN; 3]), &triangles), Refused("not finite")),
        case("far_double.ply", ply(&moved(&|_, p| p.map(|c| c + 1e7)), &triangles), Accepted(144, 242)),
        case("far_single.ply", ply(&digits, &triangles), Refused("from the origin")),
        case("copied.ply", ply(&points, &with(&triangles)), Accepted(144, 242)),
        case("both_sides.ply", ply(&points, &with(&back)), Accepted(144, 242)),
        case("mixed.ply", ply(&points, &turned), Accepted(144, 242)),
        case("crowded.ply", ply(&points, &with(&[[0, 1, 100], [1, 0, 100]])), Accepted(144, 243)),
        case("loose.ply", ply(&loose, &apart), Accepted(144, 242)),
        case("no_area.ply", ply(&flat, &triangles), Refused("has an area")),
        case("spike.ply", ply(&spike, &with(&[[0, 1, 144]])), Accepted(144, 242)),
    ]
}
