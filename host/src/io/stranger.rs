//! Formats that are known but not read: said by name, with what to do.

/// First bytes, and what a file that begins with them is.
const BEGINNINGS: [(&[u8], &str); 16] = [
    (b"\x1F\x8B", "a gzip file: unpack it first"),
    (b"PK\x03\x04", "a ZIP archive (3MF is one, too): unpack it, or export PLY, OBJ or STL"),
    (b"\xFD7zXZ\0", "an xz file: unpack it first"),
    (b"BZh", "a bzip2 file: unpack it first"),
    (b"\x28\xB5\x2F\xFD", "a zstd file: unpack it first"),
    (b"7z\xBC\xAF\x27\x1C", "a 7z archive: unpack it first"),
    (b"glTF", "a glTF file: export PLY, OBJ or STL"),
    (b"Kaydara FBX", "an FBX file: export PLY, OBJ or STL"),
    (b"\xFF\xFE", "text in UTF-16: save it as plain text or UTF-8"),
    (b"\xFE\xFF", "text in UTF-16: save it as plain text or UTF-8"),
    (b"%PDF", "a PDF document: export PLY, OBJ or STL"),
    (b"OFF", "an OFF file: export PLY, OBJ or STL"),
    (b"<?xml", "an XML file: export PLY, OBJ or STL"),
    (b"<!DOCTYPE", "a web page, not the file behind it: download it again"),
    (b"<html", "a web page, not the file behind it: download it again"),
    (b"version https://git-lfs", "a pointer of Git LFS: fetch the file itself with git lfs pull"),
];

/// What the bytes are, and what to do, if they are a known format without a reader.
pub(super) fn name(bytes: &[u8]) -> Option<&'static str> {
    // A binary STL may begin with any bytes: its length tells.
    if super::stl::is_binary(bytes) {
        return None;
    }
    BEGINNINGS.iter().find(|(beginning, _)| bytes.starts_with(beginning)).map(|&(_, name)| name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_formats_are_named_and_meshes_are_not() {
        assert!(name(b"\x1F\x8B\x08\0").is_some_and(|name| name.contains("gzip")));
        assert!(name(b"\xFF\xFEp\0l\0y\0").is_some_and(|name| name.contains("UTF-16")));
        assert_eq!((name(b"ply\n"), name(b""), name(b"P")), (None, None, None));
        let mut stl = b"BZh made this".to_vec();
        stl.resize(84, 0);
        assert_eq!(name(&stl), None);
    }
}
