//! Stanford PLY: ascii and binary, any layout of properties.
//!
//! The header becomes a list of elements; a [`source::Source`] hands out the values that follow,
//! from text or from bytes of either order; [`vertices`] and [`faces`] put them where the header
//! says. Plain binary layouts, the usual case, are decoded in bulk by [`fixed`].

mod faces;
mod fixed;
mod header;
mod rows;
mod scalar;
mod source;
#[cfg(test)]
mod tests;
mod vertices;

use self::header::{Encoding, Header};
use self::scalar::Endian;
use self::source::{Ascii, Binary, Source};
use super::Loaded;
use super::error::{Fault, Problem};
use super::finish::finish;
use super::text::without_mark;
use crate::mesh::Mesh;

/// Whether this begins like a PLY file.
pub(super) fn is_ply(bytes: &[u8]) -> bool {
    let rest = without_mark(bytes).strip_prefix(b"ply").unwrap_or_default();
    let end = rest.iter().position(|b| !matches!(b, b' ' | b'\t'));
    end.is_some_and(|end| matches!(rest[end], b'\n' | b'\r'))
}

/// Reads a PLY file.
pub(super) fn parse(bytes: &[u8]) -> Result<Loaded, Fault> {
    let bytes = without_mark(bytes);
    let header = Header::parse(bytes)?;
    let at = header.length;
    match header.encoding {
        Encoding::Ascii => body(&header, Ascii::new(bytes, at, header.lines + 1)),
        Encoding::Little => body(&header, Binary::new(bytes, at, Endian::Little)),
        Encoding::Big => body(&header, Binary::new(bytes, at, Endian::Big)),
    }
}

fn body<'a>(header: &Header, mut source: impl Source<'a>) -> Result<Loaded, Fault> {
    let count = header.vertices().ok_or(Problem::NoVertices.in_whole())?;
    let mut mesh = Mesh::default();
    for element in &header.elements {
        rows::check_room(&source, element)?;
        match element.name.as_str() {
            "vertex" => vertices::read(&mut source, element, &mut mesh)?,
            "face" => faces::polygons(&mut source, element, count, &mut mesh.triangles)?,
            "tristrips" => faces::strips(&mut source, element, count, &mut mesh.triangles)?,
            _ => rows::skip(&mut source, element)?,
        }
    }
    let mut loaded = finish(mesh)?;
    let note = "this is a completed mesh: what was inferred of it counts as measured";
    loaded.repairs.extend(header.completed.then(|| note.into()));
    Ok(loaded)
}
