//! Point clouds as text: one point a line, `x y z` or `x y z nx ny nz`, between blanks, commas or semicolons.
//!
//! A comma is a decimal mark where something else separates the numbers: `0,5;1,5;2,5` and `0,5 1,5 2,5`.

use super::Loaded;
use super::error::{Fault, Problem};
use super::finish::finish;
use super::format::is_remark;
use super::text::{Lines, number};
use crate::mesh::{Mesh, Point, Vector};

/// Reads a point cloud. Blank lines and remarks (`#`, `//`) are skipped; all other lines must
/// have as many columns as the first. Six columns whose last three are whole numbers from 0 to
/// 255 are read as a coloured cloud without normals.
pub(super) fn parse(bytes: &[u8]) -> Result<Loaded, Fault> {
    let mut mesh = Mesh::default();
    let mut columns = None;
    let mut lines = Lines::new(bytes).filter(|(_, text)| !is_remark(text)).peekable();
    // A first line that is all words names the columns.
    lines.next_if(|(_, text)| values(text).all(is_heading));
    for (line, text) in lines {
        let marked = Marked::new(text);
        let (row, found) = row(marked.text()).map_err(|problem| problem.in_line(line))?;
        let expected = *columns.get_or_insert(found);
        if found != expected {
            let expected = if expected == 3 { "3" } else { "6" };
            return Err(Problem::Columns { expected, found }.in_line(line));
        }
        push(&mut mesh, row, found);
    }
    if are_colours(&mesh.normals) {
        mesh.normals.clear();
    }
    finish(mesh)
}

/// The words of a line up to a remark, between blanks, commas, semicolons.
pub(super) fn values(line: &[u8]) -> impl Iterator<Item = &[u8]> + Clone {
    let end = line.iter().position(|&b| b == b'#').unwrap_or(line.len());
    line[..end].split(|b| b.is_ascii_whitespace() || *b == b',' || *b == b';').filter(|word| !word.is_empty())
}

/// A line whose decimal marks are points.
enum Marked<'a> {
    Plain(&'a [u8]),
    Comma(Vec<u8>),
}

impl<'a> Marked<'a> {
    /// Commas are decimal marks if every one stands between two digits of a word, one a word, and there are
    /// three words at least.
    fn new(line: &'a [u8]) -> Self {
        if !line.contains(&b',') {
            return Self::Plain(line);
        }
        let words = line.split(|b| b.is_ascii_whitespace() || *b == b';').filter(|word| !word.is_empty());
        let is_decimal = |word: &[u8]| {
            let mut parts = word.split(|&b| b == b',');
            let digit = |b: Option<&u8>| b.is_some_and(u8::is_ascii_digit);
            match (parts.next(), parts.next(), parts.next()) {
                (Some(_), None, None) => true,
                (Some(whole), Some(rest), None) => digit(whole.last()) && digit(rest.first()),
                _ => false,
            }
        };
        if words.clone().count() < 3 || !words.clone().all(is_decimal) {
            return Self::Plain(line);
        }
        Self::Comma(line.iter().map(|&b| if b == b',' { b'.' } else { b }).collect())
    }

    fn text(&self) -> &[u8] {
        match self {
            Self::Plain(text) => text,
            Self::Comma(text) => text,
        }
    }
}

fn is_heading(word: &[u8]) -> bool {
    word.first().is_some_and(u8::is_ascii_alphabetic) && number(word).is_err()
}

/// The values of a line and how many there are: three or six.
fn row(text: &[u8]) -> Result<([f64; 6], usize), Problem> {
    let mut row = [0.0; 6];
    let mut found = 0;
    for word in values(text) {
        if let Some(value) = row.get_mut(found) {
            *value = number(word)?;
        }
        found += 1;
    }
    match found {
        3 | 6 => Ok((row, found)),
        _ => Err(Problem::Columns { expected: "3 or 6", found }),
    }
}

fn push(mesh: &mut Mesh, row: [f64; 6], columns: usize) {
    let [x, y, z, nx, ny, nz] = row;
    mesh.points.push(Point::new(x, y, z));
    if columns == 6 {
        mesh.normals.push(Vector::new(nx, ny, nz));
    }
}

/// Whether "normals" are red, green and blue: whole numbers up to 255, not all 0 or 1.
fn are_colours(normals: &[Vector]) -> bool {
    let byte = |value: &f64| (0.0..=255.0).contains(value) && value.fract() == 0.0;
    normals.iter().all(|n| n.iter().all(byte)) && normals.iter().any(|n| n.amax() > 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::Place;

    fn parse(bytes: &[u8]) -> Result<Mesh, Fault> {
        Ok(super::parse(bytes)?.mesh)
    }

    #[test]
    fn three_columns_are_points() {
        let mesh = parse(b"# a cloud\n1 2 3\r\n\n -4.5\t5e0   6 \n").unwrap();
        assert_eq!(mesh.points, [Point::new(1.0, 2.0, 3.0), Point::new(-4.5, 5.0, 6.0)]);
        assert!(mesh.normals.is_empty() && mesh.triangles.is_empty());
    }

    #[test]
    fn six_columns_are_points_with_normals() {
        let mesh = parse(b"1 2 3 0 0 2\n4 5 6 0 -1 0").unwrap();
        assert_eq!(mesh.normals, [Vector::z(), -Vector::y()]);
    }

    #[test]
    fn separators_headings_and_remarks_are_understood() {
        let mesh = parse(b"x;y;z\n1;2;3 # first\n4, 5, 6\n").unwrap();
        assert_eq!(mesh.points, [Point::new(1.0, 2.0, 3.0), Point::new(4.0, 5.0, 6.0)]);
    }

    #[test]
    fn decimal_commas_are_no_separators() {
        let points = [Point::new(0.5, -1.5, 2.0), Point::new(3.0, 4.25, 5.0)];
        assert_eq!(parse(b"0,5;-1,5;2\n3;4,25;5\n").unwrap().points, points);
        assert_eq!(parse(b"0,5 -1,5\t2,0\n3 4,25 5\n").unwrap().points, points);
        assert_eq!(parse(b"0.5,-1.5,2\n3, 4.25, 5\n").unwrap().points, points);
        assert_eq!(parse(b"1, 2, 3\n4 ,5 ,6\n").unwrap().points.len(), 2);
    }

    #[test]
    fn colours_are_not_taken_for_normals() {
        assert!(parse(b"1 2 3 255 128 0\n4 5 6 0 0 1").unwrap().normals.is_empty());
    }

    #[test]
    fn errors_name_the_line() {
        let cases: [(&[u8], usize, Problem); 4] = [
            (b"1 2 3\n4 5", 2, Problem::Columns { expected: "3 or 6", found: 2 }),
            (b"1 2 3\n1 2 3 0 0 1", 2, Problem::Columns { expected: "3", found: 6 }),
            (b"1 2 3\n1 y 3", 2, Problem::NotANumber("y".into())),
            (b"1 2 3 4 5 6 7 8", 1, Problem::Columns { expected: "3 or 6", found: 8 }),
        ];
        for (text, line, problem) in cases {
            assert_eq!(parse(text), Err(Fault { place: Place::Line(line), problem }));
        }
    }

    #[test]
    fn remarks_alone_are_no_vertices() {
        assert_eq!(parse(b"# nothing\n").unwrap_err().problem, Problem::NoVertices);
    }
}
