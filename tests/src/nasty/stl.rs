//! STL of both kinds.

use super::Expected::{Accepted, Refused};
use super::{Nasty, case};

/// A binary STL of two triangles that announces `count`.
pub(super) fn bytes(title: &[u8], count: u32) -> Vec<u8> {
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

pub(super) fn cases() -> Vec<Nasty> {
    let mut nan = bytes(b"x", 2);
    nan[96..100].copy_from_slice(&f32::NAN.to_le_bytes());
    vec![
        case("two.stl", bytes(b"x", 2), Accepted(4, 2)),
        case("solid.stl", bytes(b"solid a\nfacet normal", 2), Accepted(4, 2)),
        case("text.stl", STL, Accepted(3, 1)),
        case("upper.stl", STL.to_uppercase(), Accepted(3, 1)),
        case("crlf.stl", STL.replace('\n', "\r\n"), Accepted(3, 1)),
        case("more.stl", bytes(b"x", 3), Accepted(4, 2)),
        case("less.stl", bytes(b"x", 1), Accepted(4, 2)),
        case("billions.stl", bytes(b"solid x", u32::MAX), Accepted(4, 2)),
        case("none.stl", bytes(b"x", 0), Accepted(4, 2)),
        case("zero.stl", &bytes(b"x", 0)[..84], Refused("no vertices")),
        case("cut.stl", &bytes(b"x", 2)[..100], Refused("announces")),
        case("short.stl", &bytes(b"x", 2)[..50], Refused("header")),
        case("nan.stl", nan, Refused("not finite")),
        case("no_end.stl", STL.replace("endsolid a\n", ""), Refused("endsolid")),
        case("two_corners.stl", STL.replace("vertex 0 1 0\n", ""), Refused("2 corners")),
        case("word.stl", STL.replace("vertex 0 1 0", "vortex 0 1 0"), Refused("no word of an STL")),
        case("tail.stl", [bytes(b"x", 2), vec![0; 49]].concat(), Accepted(4, 2)),
        case("less_and_tail.stl", [bytes(b"x", 1), vec![b'z'; 7]].concat(), Refused("announces 1 triangles")),
        case("coloured.stl", bytes(b"COLOR=\x01\x02\x03\xff,MATERIAL=", 2), Accepted(4, 2)),
        case("letter.stl", &b"Dear all, the meeting is at noon. ".repeat(40)[..1084], Refused("announces")),
        case("solids.stl", STL.repeat(3), Accepted(3, 1)),
        case("four_corners.stl", STL.replace("endloop", "vertex 1 1 0\nendloop"), Refused("4 corners")),
        case("one_line.stl", STL.replace('\n', " "), Refused("announces")),
        case("no_facets.stl", "solid\nendsolid\n", Refused("no vertices")),
    ]
}
