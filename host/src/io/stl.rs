//! STL, binary and ascii. Triangles come as loose corners and are welded.

use super::Loaded;
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
pub(super) fn parse(bytes: &[u8]) -> Result<Loaded, Fault> {
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

fn binary(bytes: &[u8]) -> Result<Loaded, Fault> {
    let left = bytes.len() as u64;
    let short = Problem::Truncated { what: "the STL header", needed: HEAD as u64, left };
    let stated = count(bytes).ok_or_else(|| short.in_whole())?;
    let (records, repair) = records(stated, &bytes[HEAD..])?;
    let mut soup = Soup::for_triangles(records.len() / TRIANGLE);
    for (number, record) in records.chunks_exact(TRIANGLE).enumerate() {
        soup.add(corners(record)).map_err(|problem| problem.at_byte(HEAD + TRIANGLE * number))?;
    }
    soup.finish(repair)
}

/// The bytes of the triangles. Where the count contradicts the length, the length holds if it is that of whole
/// triangles (some writers put 0 or nonsense), and the count if a few bytes follow.
fn records(stated: u64, body: &[u8]) -> Result<(&[u8], Option<String>), Fault> {
    let (present, rest) = ((body.len() / TRIANGLE) as u64, body.len() % TRIANGLE);
    let whole = &body[..body.len() - rest];
    if stated == present {
        let note = format!("{rest} bytes after the last triangle left out");
        return Ok((whole, (rest > 0).then_some(note)));
    }
    if rest == 0 && are_triangles(whole) {
        let cut = if stated > present { "; is it cut off?" } else { "" };
        let note =
            format!("the header announces {stated} triangles, the file has {present}, all were taken{cut}");
        return Ok((whole, Some(note)));
    }
    Err(Problem::TriangleCount { stated, present }.at_byte(HEAD - 4))
}

/// Whether most records have a normal of unit length or none: other bytes of a fitting length do not.
fn are_triangles(records: &[u8]) -> bool {
    let count = records.len() / TRIANGLE;
    let normal =
        |record: &[u8]| libm::hypot(libm::hypot(float(record, 0), float(record, 4)), float(record, 8));
    let usual = |record: &&[u8]| normal(record) == 0.0 || (0.9..1.1).contains(&normal(record));
    4 * records.chunks_exact(TRIANGLE).filter(usual).count() >= 3 * count.max(1)
}

fn float(record: &[u8], at: usize) -> f64 {
    f64::from(f32::from_le_bytes(std::array::from_fn(|i| record[at + i])))
}

/// The corners of a 50-byte record.
fn corners(record: &[u8]) -> [[f64; 3]; 3] {
    [12, 24, 36].map(|at| [0, 4, 8].map(|k| float(record, at + k)))
}

/// Loose triangles on their way to a mesh.
struct Soup {
    weld: Weld,
    triangles: Vec<[u32; 3]>,
    /// Triangles so far.
    seen: usize,
    /// Those with a coordinate that is not finite.
    unknown: usize,
    /// The first corner without finite coordinates, three a triangle, and how many there are.
    first: Option<usize>,
    corners: usize,
}

impl Soup {
    fn for_triangles(count: usize) -> Self {
        let weld = Weld::for_triangles(count);
        Self { weld, triangles: Vec::with_capacity(count), seen: 0, unknown: 0, first: None, corners: 0 }
    }

    fn add(&mut self, corners: [[f64; 3]; 3]) -> Result<(), Problem> {
        let number = self.seen;
        self.seen += 1;
        let is_unknown = |corner: &[f64; 3]| !corner.iter().all(|value| value.is_finite());
        if let Some(k) = corners.iter().position(is_unknown) {
            self.unknown += 1;
            self.first.get_or_insert(3 * number + k);
            self.corners += corners.iter().filter(|corner| is_unknown(corner)).count();
            return Ok(());
        }
        let mut indices = [0; 3];
        for (index, corner) in indices.iter_mut().zip(corners) {
            *index = self.weld.add(corner)?;
        }
        self.triangles.push(indices);
        Ok(())
    }

    /// The mesh; single triangles without finite coordinates are left out with a note, many are damage.
    fn finish(self, repair: Option<String>) -> Result<Loaded, Fault> {
        if let Some(vertex) = self.first.filter(|_| self.unknown * 10 > self.seen) {
            return Err(Problem::NotFinite { vertex, count: self.corners }.in_whole());
        }
        let mesh = Mesh { points: self.weld.points, normals: Vec::new(), triangles: self.triangles };
        let mut loaded = finish(mesh)?;
        loaded.repairs.extend(repair);
        if self.unknown > 0 {
            let what = if self.unknown == 1 { "1 triangle" } else { &format!("{} triangles", self.unknown) };
            loaded.repairs.push(format!("{what} without finite coordinates left out"));
        }
        Ok(loaded)
    }
}

fn ascii(bytes: &[u8]) -> Result<Loaded, Fault> {
    let mut reader = Ascii { soup: Soup::for_triangles(bytes.len() / 256), corners: Vec::new(), open: false };
    for (line, text) in Lines::new(bytes) {
        reader.line(line, text)?;
    }
    if reader.open {
        return Err(Problem::EndsEarly("\"endsolid\"").in_whole());
    }
    reader.soup.finish(None)
}

/// What has been read of the text form.
struct Ascii {
    soup: Soup,
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
        self.soup.add(corners)
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
