//! STL, binary and ascii. Triangles come as loose corners and are welded.

use super::error::{Fault, Problem};
use super::finish::finish;
use super::text::{Lines, numbers, quote, words};
use super::weld::Weld;
use crate::mesh::Mesh;

/// Bytes in front of the first triangle: 80 of header, 4 of count.
const HEAD: usize = 84;
/// Bytes of a triangle: normal, three corners, two attribute bytes.
const TRIANGLE: usize = 50;

/// Reads an STL file; the normals in it are those of the triangles and are not kept.
pub(super) fn parse(bytes: &[u8]) -> Result<Mesh, Fault> {
    if !is_binary(bytes) && is_ascii(bytes) { ascii(bytes) } else { binary(bytes) }
}

/// Whether the length is exactly that which the triangle count asks for; also true of binary
/// files whose header says "solid".
pub(super) fn is_binary(bytes: &[u8]) -> bool {
    count(bytes).is_some_and(|count| bytes.len() as u64 == HEAD as u64 + TRIANGLE as u64 * count)
}

/// Whether this begins like the text form: "solid" and, further on, a facet or the end, without
/// a zero byte in between.
pub(super) fn is_ascii(bytes: &[u8]) -> bool {
    let mut lines = Lines::new(&bytes[..bytes.len().min(4096)]).map(|(_, line)| line);
    let first = lines.by_ref().find(|line| words(line).next().is_some()).unwrap_or_default();
    let keyword = |line: &[u8]| words(line).next().map(<[u8]>::to_ascii_lowercase);
    keyword(first).is_some_and(|word| word == b"solid")
        && !first.contains(&0)
        && lines.find_map(keyword).is_some_and(|word| word == b"facet" || word == b"endsolid")
}

fn count(bytes: &[u8]) -> Option<u64> {
    let field = bytes.get(HEAD - 4..HEAD)?.try_into().ok()?;
    Some(u64::from(u32::from_le_bytes(field)))
}

fn binary(bytes: &[u8]) -> Result<Mesh, Fault> {
    let left = bytes.len() as u64;
    let short = Problem::Truncated { what: "the STL header", needed: HEAD as u64, left };
    let stated = count(bytes).ok_or_else(|| short.in_whole())?;
    let body = &bytes[HEAD..];
    if !is_binary(bytes) {
        let present = (body.len() / TRIANGLE) as u64;
        return Err(Problem::TriangleCount { stated, present }.at_byte(HEAD - 4));
    }
    let mut weld = Weld::for_triangles(body.len() / TRIANGLE);
    let mut triangles = Vec::with_capacity(body.len() / TRIANGLE);
    for (number, record) in body.chunks_exact(TRIANGLE).enumerate() {
        let place = |problem: Problem| problem.at_byte(HEAD + TRIANGLE * number);
        triangles.push(triangle(&mut weld, corners(record), number).map_err(place)?);
    }
    finish(Mesh { points: weld.points, normals: Vec::new(), triangles })
}

/// The corners of a 50-byte record.
fn corners(record: &[u8]) -> [[f64; 3]; 3] {
    let float = |at: usize| f64::from(f32::from_le_bytes(std::array::from_fn(|i| record[at + i])));
    [12, 24, 36].map(|at| [float(at), float(at + 4), float(at + 8)])
}

/// Welds one triangle; vertices are numbered three a triangle in messages, as the file has them.
fn triangle(weld: &mut Weld, corners: [[f64; 3]; 3], number: usize) -> Result<[u32; 3], Problem> {
    let mut indices = [0; 3];
    for (k, corner) in corners.into_iter().enumerate() {
        if !corner.iter().all(|value| value.is_finite()) {
            return Err(Problem::NotFinite { vertex: 3 * number + k });
        }
        indices[k] = weld.add(corner)?;
    }
    Ok(indices)
}

fn ascii(bytes: &[u8]) -> Result<Mesh, Fault> {
    let (triangles, corners) = (Vec::new(), Vec::new());
    let mut reader = Ascii { weld: Weld::for_triangles(bytes.len() / 256), triangles, corners, open: false };
    for (line, text) in Lines::new(bytes) {
        reader.line(line, text)?;
    }
    if reader.open {
        return Err(Problem::EndsEarly("\"endsolid\"").in_whole());
    }
    finish(Mesh { points: reader.weld.points, normals: Vec::new(), triangles: reader.triangles })
}

/// What has been read of the text form.
struct Ascii {
    weld: Weld,
    triangles: Vec<[u32; 3]>,
    corners: Vec<[f64; 3]>,
    /// Between "solid" and "endsolid".
    open: bool,
}

impl Ascii {
    fn line(&mut self, line: usize, text: &[u8]) -> Result<(), Fault> {
        let mut words = words(text);
        let Some(keyword) = words.next() else { return Ok(()) };
        match keyword.to_ascii_lowercase().as_slice() {
            b"vertex" => self.corners.push(numbers(&mut words, line)?),
            b"endloop" => self.facet().map_err(|problem| problem.in_line(line))?,
            b"solid" => self.open = true,
            b"endsolid" => self.open = false,
            b"facet" | b"outer" | b"endfacet" => {}
            _ => return Err(unexpected(keyword).in_line(line)),
        }
        Ok(())
    }

    fn facet(&mut self) -> Result<(), Problem> {
        let found = self.corners.len();
        let corners = <[_; 3]>::try_from(self.corners.as_slice());
        let corners = corners.map_err(|_| Problem::Other(not_three(found)))?;
        self.corners.clear();
        let triangle = triangle(&mut self.weld, corners, self.triangles.len())?;
        self.triangles.push(triangle);
        Ok(())
    }
}

fn not_three(found: usize) -> String {
    format!("a facet has {found} corners instead of 3; export the file again")
}

fn unexpected(word: &[u8]) -> Problem {
    Problem::Other(format!("{:?} is no word of an STL file; export the file again", quote(word)))
}

#[cfg(test)]
#[path = "stl_tests.rs"]
mod tests;
