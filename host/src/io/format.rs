//! Which format is it? Content first, then the name.

use std::path::Path;

use super::error::{Fault, Problem};
use super::text::{Lines, number, words};
use super::{Loaded, obj, pcd, ply, stl, stranger, xyz};
use crate::mesh::Mesh;

/// A file format for meshes or point clouds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Stanford PLY, ascii or binary.
    Ply,
    /// Wavefront OBJ.
    Obj,
    /// STL, ascii or binary.
    Stl,
    /// Point Cloud Data, ascii, binary or compressed.
    Pcd,
    /// Text with the columns x y z, or more.
    Xyz,
}

impl Format {
    /// The format of a file called `path` that holds `bytes`.
    ///
    /// The content wins: an unmistakable beginning, then what the first lines of text are. The extension counts
    /// where neither tells.
    ///
    /// # Errors
    /// If the file is empty, a picture, or nothing known.
    pub fn detect(path: &Path, bytes: &[u8]) -> Result<Self, Fault> {
        if bytes.is_empty() {
            return Err(Problem::Empty.in_whole());
        }
        if bytes.starts_with(b"\x89PNG") {
            return Err(Problem::Picture.in_whole());
        }
        if let Some(name) = stranger::name(bytes) {
            return Err(Problem::Stranger(name).in_whole());
        }
        Self::by_magic(bytes)
            .or_else(|| Self::by_guess(bytes))
            .or_else(|| Self::by_extension(path))
            .ok_or(Problem::UnknownFormat.in_whole())
    }

    fn by_magic(bytes: &[u8]) -> Option<Self> {
        if ply::is_ply(bytes) {
            return Some(Format::Ply);
        }
        if pcd::is_pcd(bytes) {
            return Some(Format::Pcd);
        }
        (stl::is_binary(bytes) || stl::is_ascii(bytes)).then_some(Format::Stl)
    }

    fn by_extension(path: &Path) -> Option<Self> {
        match path.extension()?.to_str()?.to_ascii_lowercase().as_str() {
            "ply" => Some(Format::Ply),
            "obj" => Some(Format::Obj),
            "stl" => Some(Format::Stl),
            "pcd" => Some(Format::Pcd),
            "xyz" | "pts" => Some(Format::Xyz),
            _ => None,
        }
    }

    /// Judges by the first line that says something, and by the next one if it is the count of the points.
    fn by_guess(bytes: &[u8]) -> Option<Self> {
        let mut lines = Lines::new(bytes).map(|(_, line)| line).filter(|line| !is_remark(line));
        let line = lines.next()?;
        match words(line).next()? {
            b"v" | b"vn" | b"vt" | b"o" | b"g" | b"mtllib" | b"usemtl" => Some(Format::Obj),
            _ if xyz::count(line).is_some() => is_table(lines.next()?).then_some(Format::Xyz),
            _ => is_table(line).then_some(Format::Xyz),
        }
    }
}

/// Whether a line is the first of a table: numbers alone, three at least, or the names of its columns.
fn is_table(line: &[u8]) -> bool {
    let values: Vec<&[u8]> = xyz::values(line).collect();
    let numbers = values.iter().all(|word| number(word).is_ok());
    let named =
        [b"x", b"y", b"z"].iter().all(|name| values.iter().any(|word| word.eq_ignore_ascii_case(*name)));
    values.len() >= 3 && (numbers || named)
}

/// Whether a line of a text file is blank or a remark.
pub(super) fn is_remark(line: &[u8]) -> bool {
    words(line).next().is_none_or(|word| word.starts_with(b"#") || word.starts_with(b"//"))
}

/// Reads a mesh of a known format from memory.
///
/// # Errors
/// If the bytes are not a complete and consistent file of that format.
pub fn parse(format: Format, bytes: &[u8]) -> Result<Mesh, Fault> {
    Ok(parse_noted(format, bytes)?.mesh)
}

/// As [`parse`], with what was repaired.
///
/// # Errors
/// As for [`parse`].
pub fn parse_noted(format: Format, bytes: &[u8]) -> Result<Loaded, Fault> {
    match format {
        Format::Ply => ply::parse(bytes),
        Format::Obj => obj::parse(bytes),
        Format::Stl => stl::parse(bytes),
        Format::Pcd => pcd::parse(bytes),
        Format::Xyz => xyz::parse(bytes),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn detect(name: &str, bytes: &[u8]) -> Result<Format, Problem> {
        Format::detect(Path::new(name), bytes).map_err(|fault| fault.problem)
    }

    #[test]
    fn magic_wins_over_the_extension() {
        assert_eq!(detect("a.stl", b"ply\r\nformat"), Ok(Format::Ply));
        assert_eq!(detect("a.obj", b"solid x\nfacet normal 0 0 1\n"), Ok(Format::Stl));
    }

    #[test]
    fn the_extension_counts_where_the_content_does_not_tell() {
        assert_eq!(detect("a.PLY", b"plain"), Ok(Format::Ply));
        assert_eq!(detect("a.obj", b"mtllib"), Ok(Format::Obj));
        assert_eq!(detect("a.xyz", b"x y z\n1 2 3"), Ok(Format::Xyz));
        assert_eq!(detect("a.pts", b"intensity"), Ok(Format::Xyz));
    }

    #[test]
    fn text_with_a_wrong_name_is_known_by_its_lines() {
        assert_eq!(detect("a.obj", b"1 2 3"), Ok(Format::Xyz));
        assert_eq!(detect("a.xyz", b"v 1 2 3"), Ok(Format::Obj));
        assert_eq!(detect("a.ply", b"VERSION .7\nFIELDS x y z"), Ok(Format::Pcd));
    }

    #[test]
    fn text_without_a_telling_name_is_guessed() {
        assert_eq!(detect("a.txt", b"# x y z\n\n 1 2 3"), Ok(Format::Xyz));
        assert_eq!(detect("a.txt", b"# blender\nmtllib a.mtl"), Ok(Format::Obj));
        assert_eq!(detect("noname", b"-1e3 2 3"), Ok(Format::Xyz));
        assert_eq!(detect("a.txt", b"2\n1 2 3 0.5\n"), Ok(Format::Xyz));
        assert_eq!(detect("a.txt", b"2\napples\n"), Err(Problem::UnknownFormat));
        assert_eq!(
            detect("a.csv", b"nx,ny,nz,X,Y,Z\n"),
            Ok(Format::Xyz),
            "whose reader tells the order it needs"
        );
        assert_eq!(detect("a.csv", b"name,x,size\n"), Err(Problem::UnknownFormat));
    }

    #[test]
    fn what_is_nothing_known_says_so() {
        assert_eq!(detect("a.doc", b"Dear all"), Err(Problem::UnknownFormat));
        assert_eq!(detect("a.ply", b""), Err(Problem::Empty));
        assert_eq!(detect("depth.png", b"\x89PNG\r\n"), Err(Problem::Picture));
    }
}
