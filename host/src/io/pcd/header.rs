//! The header of a PCD file.

use crate::io::error::{Fault, Problem, export_again};
use crate::io::text::{quote, words};

/// How the points are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Data {
    Ascii,
    Binary,
    Compressed,
}

/// The type of a field.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    F32,
    F64,
    I8,
    I16,
    I32,
    I64,
    U8,
    U16,
    U32,
    U64,
}

/// Where a field is in a row.
#[derive(Clone, Copy, Debug)]
pub(super) struct Column {
    pub kind: Kind,
    /// Its number among the values of a text row.
    pub number: usize,
    /// Its first byte in a binary row.
    pub offset: usize,
    /// Bytes of the whole field in a row.
    pub bytes: usize,
}

/// The header.
#[derive(Debug)]
pub(super) struct Header {
    fields: Vec<(String, Column)>,
    pub points: usize,
    pub data: Data,
    /// Values of a row.
    pub columns: usize,
    /// Bytes of a binary row.
    pub stride: usize,
    /// Bytes of the header.
    pub length: usize,
    /// Lines of it.
    pub lines: usize,
}

/// The lines of a header as they come.
#[derive(Default)]
struct Draft<'a> {
    fields: Vec<&'a [u8]>,
    sizes: Vec<&'a [u8]>,
    types: Vec<&'a [u8]>,
    counts: Vec<&'a [u8]>,
    area: [Option<usize>; 2],
    points: Option<usize>,
}

impl Header {
    /// Whether the first line that says something is the first of a PCD header.
    pub fn begins(bytes: &[u8]) -> bool {
        let head = &bytes[..bytes.len().min(1024)];
        let line = head.split(|&b| b == b'\n').find(|line| !line.trim_ascii().is_empty());
        let line = line.unwrap_or_default().trim_ascii();
        line.starts_with(b"# .PCD") || line.starts_with(b"VERSION .7") || line.starts_with(b"VERSION 0.7")
    }

    /// Reads the header at the head of a file.
    pub fn parse(bytes: &[u8]) -> Result<Self, Fault> {
        let (mut draft, mut at, mut lines) = (Draft::default(), 0, 0);
        loop {
            let rest = &bytes[at..];
            let end = rest.iter().position(|&b| b == b'\n');
            let end = end.ok_or(Problem::EndsEarly("the line DATA").in_whole())?;
            (at, lines) = (at + end + 1, lines + 1);
            let words: Vec<&[u8]> = words(&rest[..end]).collect();
            if let [b"DATA", kind] = words.as_slice() {
                let data = match *kind {
                    b"ascii" => Data::Ascii,
                    b"binary" => Data::Binary,
                    b"binary_compressed" => Data::Compressed,
                    _ => {
                        return Err(
                            export_again(format!("DATA {:?} is not known", quote(kind))).in_line(lines)
                        );
                    }
                };
                return draft.finish(data, at, lines).map_err(Problem::in_whole);
            }
            draft.line(&words).map_err(|problem| problem.in_line(lines))?;
        }
    }

    /// The columns of three fields.
    pub fn triple(&self, names: [&str; 3]) -> Option<[Column; 3]> {
        let column = |name| self.fields.iter().find(|(field, _)| field == name).map(|(_, column)| *column);
        Some([column(names[0])?, column(names[1])?, column(names[2])?])
    }
}

impl<'a> Draft<'a> {
    fn line(&mut self, words: &[&'a [u8]]) -> Result<(), Problem> {
        match words {
            [] => {}
            [word, ..] if word.starts_with(b"#") => {}
            [b"VERSION" | b"VIEWPOINT", ..] => {}
            [b"FIELDS" | b"COLUMNS", rest @ ..] => self.fields = rest.to_vec(),
            [b"SIZE", rest @ ..] => self.sizes = rest.to_vec(),
            [b"TYPE", rest @ ..] => self.types = rest.to_vec(),
            [b"COUNT", rest @ ..] => self.counts = rest.to_vec(),
            [b"WIDTH", value] => self.area[0] = Some(integer(value)?),
            [b"HEIGHT", value] => self.area[1] = Some(integer(value)?),
            [b"POINTS", value] => self.points = Some(integer(value)?),
            [word, ..] => {
                return Err(export_again(format!("{:?} does not belong into a PCD header", quote(word))));
            }
        }
        Ok(())
    }

    fn finish(self, data: Data, length: usize, lines: usize) -> Result<Header, Problem> {
        let area = self.area[0].zip(self.area[1]).map(|(width, height)| width.saturating_mul(height));
        let points = self
            .points
            .or(area)
            .ok_or_else(|| export_again("neither POINTS nor WIDTH and HEIGHT are given"))?;
        if area.is_some_and(|area| area != points) {
            return Err(export_again(format!(
                "WIDTH times HEIGHT is {}, POINTS is {points}",
                area.unwrap_or(0)
            )));
        }
        if points > u32::MAX as usize {
            return Err(Problem::TooMany);
        }
        let count = self.fields.len();
        if self.sizes.len() != count
            || self.types.len() != count
            || !matches!(self.counts.len(), n if n == 0 || n == count)
        {
            return Err(export_again("FIELDS, SIZE, TYPE and COUNT have different lengths"));
        }
        let mut header = Header { fields: vec![], points, data, columns: 0, stride: 0, length, lines };
        for (number, name) in self.fields.iter().enumerate() {
            let kind = kind(self.types[number], self.sizes[number])?;
            let repeats = self.counts.get(number).map_or(Ok(1), |word| integer(word))?;
            if repeats == 0 {
                return Err(export_again(format!("the field {:?} has the COUNT 0", quote(name))));
            }
            let bytes = integer(self.sizes[number])?.saturating_mul(repeats);
            let column = Column { kind, number: header.columns, offset: header.stride, bytes };
            header.fields.push((String::from_utf8_lossy(name).into_owned(), column));
            header.columns = header.columns.saturating_add(repeats);
            header.stride = header.stride.saturating_add(bytes);
        }
        if header.stride > 1 << 20 {
            return Err(export_again(format!("a point of {} bytes is none", header.stride)));
        }
        Ok(header)
    }
}

fn kind(letter: &[u8], size: &[u8]) -> Result<Kind, Problem> {
    Ok(match (letter, size) {
        (b"F", b"4") => Kind::F32,
        (b"F", b"8") => Kind::F64,
        (b"I", b"1") => Kind::I8,
        (b"I", b"2") => Kind::I16,
        (b"I", b"4") => Kind::I32,
        (b"I", b"8") => Kind::I64,
        (b"U", b"1") => Kind::U8,
        (b"U", b"2") => Kind::U16,
        (b"U", b"4") => Kind::U32,
        (b"U", b"8") => Kind::U64,
        _ => {
            return Err(export_again(format!(
                "TYPE {} with SIZE {} is not known",
                quote(letter),
                quote(size)
            )));
        }
    })
}

fn integer(word: &[u8]) -> Result<usize, Problem> {
    let parsed = std::str::from_utf8(word).ok().and_then(|text| text.parse().ok());
    parsed.ok_or_else(|| Problem::NotANumber(quote(word)))
}
