//! Point clouds as text: one point a line, `x y z` and whatever follows, between blanks, commas or semicolons.
//!
//! A comma is a decimal mark where something else separates the numbers: `0,5;1,5;2,5` and `0,5 1,5 2,5`.

use super::Loaded;
use super::columns::Further;
use super::error::{Fault, Problem};
use super::finish::finish;
use super::format::is_remark;
use super::text::{Lines, number};
use crate::mesh::{Mesh, Point};

/// Most columns of a table: a longer line is no point.
const MOST: usize = 64;
/// Largest part of the announced points that may be missing or too many in a file that is read all the same.
const MISCOUNTED: f64 = 0.1;

/// Reads a point cloud. Blank lines and remarks (`#`, `//`) are skipped; all other lines must
/// have as many columns as the first. A first line with one whole number is the count of the points.
pub(super) fn parse(bytes: &[u8]) -> Result<Loaded, Fault> {
    let mut lines = Lines::new(bytes).filter(|(_, text)| !is_remark(text)).peekable();
    let stated = lines.peek().and_then(|&(line, text)| Some((line, count(text)?)));
    if stated.is_some() {
        lines.next();
    }
    // A first line that is all words names the columns.
    if let Some((line, heading)) = lines.next_if(|(_, text)| values(text).all(is_heading)) {
        check_heading(heading).map_err(|problem| problem.in_line(line))?;
    }
    let (mut mesh, further) = table(lines)?;
    let mut notes = Vec::new();
    if let Some((line, stated)) = stated {
        notes.extend(miscounted(stated, mesh.points.len()).map_err(|problem| problem.in_line(line))?);
    }
    notes.extend(further.take_normals(&mut mesh));
    let mut loaded = finish(mesh)?;
    loaded.repairs.splice(0..0, notes);
    Ok(loaded)
}

/// The points of a table, and what else its lines hold.
fn table<'a>(lines: impl Iterator<Item = (usize, &'a [u8])>) -> Result<(Mesh, Further), Fault> {
    let mut mesh = Mesh::default();
    let mut values = Vec::new();
    let mut columns = None;
    for (line, text) in lines {
        let marked = Marked::new(text);
        let ([x, y, z], found) = row(marked.text(), &mut values).map_err(|problem| problem.in_line(line))?;
        check_columns(found, *columns.get_or_insert(found)).map_err(|problem| problem.in_line(line))?;
        mesh.points.push(Point::new(x, y, z));
    }
    Ok((mesh, Further { count: columns.map_or(0, |columns| columns - 3), values }))
}

/// The whole number that a line consists of: how many points follow.
pub(super) fn count(line: &[u8]) -> Option<u64> {
    let mut words = values(line);
    let count = std::str::from_utf8(words.next()?).ok()?.parse().ok()?;
    words.next().is_none().then_some(count)
}

/// What to say about a count that is not that of the points; one that is far from it is damage.
fn miscounted(stated: u64, found: usize) -> Result<Option<String>, Problem> {
    if stated == found as u64 {
        return Ok(None);
    }
    if stated.abs_diff(found as u64) as f64 <= MISCOUNTED * stated as f64 {
        return Ok(Some(format!(
            "the first line announces {stated} points, {found} follow; those are taken"
        )));
    }
    Err(Problem::PointCount { stated, found })
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

/// Columns named in another order would be taken for coordinates.
fn check_heading(heading: &[u8]) -> Result<(), Problem> {
    match values(heading).position(|word| word.eq_ignore_ascii_case(b"x")) {
        None | Some(0) => Ok(()),
        Some(before) => {
            Err(Problem::Other(format!("columns named before x: {before}; export x y z as the first three")))
        }
    }
}

/// The first three values of a line, and how many there are; the others go to the end of `further`.
fn row(text: &[u8], further: &mut Vec<f64>) -> Result<([f64; 3], usize), Problem> {
    let mut row = [0.0; 3];
    let mut found = 0;
    for word in values(text) {
        if let Some(value) = row.get_mut(found) {
            *value = number(word)?;
        } else if found < MOST {
            further.push(number(word)?);
        }
        found += 1;
    }
    Ok((row, found))
}

/// Whether a line with this number of values belongs to a table whose first line has that many.
fn check_columns(found: usize, first: usize) -> Result<(), Problem> {
    match found {
        _ if found != first => Err(Problem::Ragged { found, first }),
        0..3 => Err(Problem::Columns { expected: "3 or more", found }),
        3..=MOST => Ok(()),
        _ => Err(Problem::Columns { expected: "64 at most", found }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::Place;
    use crate::mesh::Vector;

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
    fn further_columns_are_understood_or_left_out_with_a_note() {
        let coloured = super::parse(b"1 2 3 200 100 50 0 0 1\n4 5 6 20 10 5 0 -1 0").unwrap();
        assert_eq!(coloured.mesh.normals, [Vector::z(), -Vector::y()]);
        let note = "columns 4 to 6 left out: the first three columns are taken for x y z, columns 7 to 9 are taken \
                    for normals";
        assert_eq!(coloured.repairs, [note]);
        let bright = super::parse(b"0,5;1,5;2;99\n1,5;1;2;98\n").unwrap();
        assert_eq!(bright.mesh.points[0], Point::new(0.5, 1.5, 2.0));
        assert!(bright.mesh.normals.is_empty() && bright.repairs[0].starts_with("column 4 left out"));
    }

    #[test]
    fn columns_that_are_named_in_another_order_are_refused() {
        let fault = parse(b"id x y z\n1 0.5 2 3\n").unwrap_err();
        assert!(
            fault.place == Place::Line(1) && fault.problem.to_string().contains("before x: 1;"),
            "{fault:?}"
        );
        assert!(parse(b"X;Y;Z;intensity\n1;2;3;4\n").is_ok());
    }

    #[test]
    fn a_count_of_the_points_is_skipped() {
        let loaded = super::parse(b"# scanner\n2\n1 2 3 9\n4 5 6 8\n").unwrap();
        assert_eq!((loaded.mesh.points.len(), loaded.repairs.len()), (2, 1));
        assert_eq!(parse(b"1\nx y z\n1 2 3\n").unwrap().points.len(), 1);
    }

    #[test]
    fn a_count_that_is_near_is_told_and_another_one_is_damage() {
        let points = "1 2 3\n".repeat(95);
        let loaded = super::parse(format!("100\n{points}").as_bytes()).unwrap();
        assert_eq!(loaded.repairs, ["the first line announces 100 points, 95 follow; those are taken"]);
        let damage = parse(format!("1000\n{points}").as_bytes()).unwrap_err();
        let problem = Problem::PointCount { stated: 1000, found: 95 };
        assert_eq!(damage, Fault { place: Place::Line(1), problem });
    }

    #[test]
    fn errors_name_the_line() {
        let long = "0 ".repeat(70);
        let cases: [(&[u8], usize, Problem); 6] = [
            (b"1 2", 1, Problem::Columns { expected: "3 or more", found: 2 }),
            (b"1 2 3 9\n4 5 6", 2, Problem::Ragged { found: 3, first: 4 }),
            (b"1 2 3\n1 2 3 0 0 1", 2, Problem::Ragged { found: 6, first: 3 }),
            (b"1 2 3\n1 y 3", 2, Problem::NotANumber("y".into())),
            (b"1 2 3 4\n1 2 3 red", 2, Problem::NotANumber("red".into())),
            (long.as_bytes(), 1, Problem::Columns { expected: "64 at most", found: 70 }),
        ];
        for (text, line, problem) in cases {
            assert_eq!(parse(text), Err(Fault { place: Place::Line(line), problem }));
        }
    }

    #[test]
    fn a_line_that_is_too_short_is_compared_with_the_first() {
        let text = parse(b"1 2 3 9\n4\n").unwrap_err().problem.to_string();
        assert_eq!(text, "1 value in a line, the first one has 4; correct the line");
    }

    #[test]
    fn remarks_alone_are_no_vertices() {
        assert_eq!(parse(b"# nothing\n").unwrap_err().problem, Problem::NoVertices);
    }
}
