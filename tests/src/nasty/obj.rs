//! Wavefront OBJ.

use super::Expected::{Accepted, Refused};
use super::{Nasty, case};

pub(super) fn cases() -> Vec<Nasty> {
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
        case("remark.obj", with("f 1 2 3 # 4\nf 1 3 4 # x\n"), Accepted(4, 2)),
        case("marked.obj", format!("\u{feff}{}", with("f 1 2 3 4\n")), Accepted(4, 2)),
        case("cr.obj", with("f 1 2 3 4\n").replace('\n', "\r"), Accepted(4, 2)),
        case("zeros.obj", with("f 1 2 3 4\n").replace(' ', "\0"), Refused("no vertices")),
        case("long_index.obj", with("f 1 2 9223372036854775808\n"), Refused("is not a number")),
        case("lines.obj", with("l 1 2 3\n"), Accepted(4, 0)),
        case("long_line.obj", with(&format!("f {}\n", "1 2 3 ".repeat(100_000))), Accepted(3, 1)),
        case("open_line.obj", with("f 1 2 3 \\"), Accepted(3, 1)),
        case("weights.obj", "v 0 0 0 1\nv 2 0 0 1\nv 0 2 0 1\nf 1 2 3\n", Accepted(3, 1)),
        case("comma.obj", with("v 0,5 1,5 2,5\n"), Refused("is not a number")),
    ]
}
