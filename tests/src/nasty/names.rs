//! Names and contents that do not belong together.

use super::Expected::{Accepted, Refused};
use super::{Nasty, SQUARE, case, pcd, square, stl};

pub(super) fn cases() -> Vec<Nasty> {
    vec![
        case("empty.ply", "", Refused("empty")),
        case("ply.stl", square("4 0 1 2 3\n"), Accepted(4, 2)),
        case("stl.ply", stl::bytes(b"x", 2), Accepted(4, 2)),
        case("obj.xyz", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", Accepted(3, 1)),
        case("pcd.obj", pcd::head(4, "ascii") + SQUARE, Accepted(4, 0)),
        case("xyz.ply", SQUARE, Accepted(4, 0)),
        case("nothing", SQUARE, Accepted(4, 0)),
        case("letter.doc", "Dear all,\n", Refused("format is not known")),
        case("picture.ply", &b"\x89PNG\r\n\x1a\n"[..], Refused("picture")),
        case("zeros.ply", vec![0; 5000], Refused("")),
        case("zeros.bin", vec![0; 5000], Refused("")),
        case("packed.ply", &b"\x1F\x8B\x08\0garbage"[..], Refused("gzip")),
        case("archive.ply", &b"PK\x03\x04garbage"[..], Refused("ZIP")),
        case("wide.ply", wide(&square("4 0 1 2 3\n")), Refused("UTF-16")),
        case("wide.obj", wide("v 0 0 0\n"), Refused("UTF-16")),
        case("binary.gltf", &b"glTF\x02\0\0\0"[..], Refused("glTF")),
        case("missing.ply", "<!DOCTYPE html><html><body>404 Not Found</body></html>", Refused("web page")),
        case(
            "pointer.ply",
            "version https://git-lfs.github.com/spec/v1\noid sha256:4d7a\n",
            Refused("Git LFS"),
        ),
        case("object.off", format!("OFF\n4 1 0\n{SQUARE}4 0 1 2 3\n"), Refused("OFF")),
        case("only.ply", "ply", Refused("")),
        case("header.ply", "ply\n", Refused("end_header")),
    ]
}

/// Text as some editors save it.
fn wide(text: &str) -> Vec<u8> {
    [0xFEFF].into_iter().chain(text.encode_utf16()).flat_map(u16::to_le_bytes).collect()
}
