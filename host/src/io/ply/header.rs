//! The header of a PLY file: which elements follow, and how they are laid out.

use super::scalar::Kind;
use crate::io::COMPLETED;
use crate::io::error::{Fault, Problem, export_again};
use crate::io::text::{quote, words};

/// How the values after the header are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Encoding {
    Ascii,
    Little,
    Big,
}

/// The header.
#[derive(Debug)]
pub(super) struct Header {
    pub encoding: Encoding,
    /// In the order of the file.
    pub elements: Vec<Element>,
    /// Bytes up to and including the end of its last line.
    pub length: usize,
    /// Lines of it.
    pub lines: usize,
    /// Whether a comment says that this is a completed mesh.
    pub completed: bool,
}

/// A table of the file.
#[derive(Debug)]
pub(super) struct Element {
    pub name: String,
    /// Rows of the table.
    pub count: usize,
    /// Columns of the table.
    pub properties: Vec<Property>,
}

/// A column: a number, or a list with its length in front.
#[derive(Debug)]
pub(super) struct Property {
    pub name: String,
    pub kind: Kind,
    /// The type of the length if this is a list.
    pub length_kind: Option<Kind>,
}

impl Header {
    /// Reads the header at the head of a file.
    pub fn parse(bytes: &[u8]) -> Result<Self, Fault> {
        let mut cursor = Cursor { bytes, at: 0, lines: 0, only_cr: false };
        if cursor.line().is_none_or(|line| line.trim_ascii_end() != b"ply") {
            return Err(export_again("the first line is not \"ply\"; this is another format").in_line(1));
        }
        cursor.only_cr = bytes[..cursor.at].ends_with(b"\r");
        let mut draft = Draft::default();
        loop {
            let line = cursor.line().ok_or(Problem::EndsEarly("\"end_header\"").in_whole())?;
            if line.trim_ascii_end() == b"end_header" {
                break;
            }
            draft.line(line).map_err(|problem| problem.in_line(cursor.lines))?;
        }
        let encoding =
            draft.encoding.ok_or_else(|| export_again("the header has no \"format\" line").in_whole())?;
        let Draft { elements, completed, .. } = draft;
        Ok(Header { encoding, elements, length: cursor.at, lines: cursor.lines, completed })
    }

    /// The number of vertices, wherever in the file they are.
    pub fn vertices(&self) -> Option<usize> {
        let vertex = self.elements.iter().find(|element| element.name == "vertex")?;
        Some(vertex.count).filter(|&count| count > 0)
    }
}

/// Where in the header we are. Binary values follow its last line at once, so the end of line
/// has to be taken exactly: a lone CR may be followed by a value that looks like LF.
struct Cursor<'a> {
    bytes: &'a [u8],
    at: usize,
    lines: usize,
    only_cr: bool,
}

impl<'a> Cursor<'a> {
    /// The next line without its end; none if it has no end.
    fn line(&mut self) -> Option<&'a [u8]> {
        let rest = &self.bytes[self.at..];
        let end = rest.iter().position(|&b| b == b'\n' || b == b'\r')?;
        let crlf = !self.only_cr && rest[end..].starts_with(b"\r\n");
        self.at += end + if crlf { 2 } else { 1 };
        self.lines += 1;
        Some(&rest[..end])
    }
}

/// A header in the making.
#[derive(Default)]
struct Draft {
    encoding: Option<Encoding>,
    elements: Vec<Element>,
    completed: bool,
}

impl Draft {
    fn line(&mut self, line: &[u8]) -> Result<(), Problem> {
        let words: Vec<_> = words(line).collect();
        match words.as_slice() {
            [b"comment", text @ ..] => {
                self.completed |= text.join(&b' ').starts_with(COMPLETED.as_bytes());
                Ok(())
            }
            [] | [b"obj_info", ..] => Ok(()),
            [b"format", name, b"1.0"] => self.format(name),
            [b"element", name, count] => self.element(name, count),
            [b"property", b"list", length, kind, name] => self.property(Some(length), kind, name),
            [b"property", kind, name] => self.property(None, kind, name),
            _ => Err(export_again(format!("{:?} does not belong into a PLY 1.0 header", quote(line)))),
        }
    }

    fn format(&mut self, name: &[u8]) -> Result<(), Problem> {
        self.encoding = Some(match name {
            b"ascii" => Encoding::Ascii,
            b"binary_little_endian" => Encoding::Little,
            b"binary_big_endian" => Encoding::Big,
            _ => return Err(export_again(format!("the encoding {:?} is not known", quote(name)))),
        });
        Ok(())
    }

    fn element(&mut self, name: &[u8], count: &[u8]) -> Result<(), Problem> {
        let name = String::from_utf8_lossy(name).into_owned();
        if self.elements.iter().any(|element| element.name == name) {
            return Err(export_again(format!("the element {name:?} is declared twice")));
        }
        let parsed = std::str::from_utf8(count).ok().and_then(|text| text.parse().ok());
        let count = parsed.ok_or_else(|| Problem::NotANumber(quote(count)))?;
        if name == "vertex" && count > u32::MAX as usize {
            return Err(Problem::TooMany);
        }
        self.elements.push(Element { name, count, properties: Vec::new() });
        Ok(())
    }

    fn property(&mut self, length: Option<&&[u8]>, kind: &[u8], name: &[u8]) -> Result<(), Problem> {
        let unknown = |kind: &[u8]| export_again(format!("the number type {:?} is not known", quote(kind)));
        let named = |kind: &[u8]| Kind::named(kind).ok_or_else(|| unknown(kind));
        let length_kind = length.map(|length| named(length)).transpose()?;
        let element =
            self.elements.last_mut().ok_or_else(|| export_again("a property stands before any element"))?;
        let name = String::from_utf8_lossy(name).into_owned();
        element.properties.push(Property { name, kind: named(kind)?, length_kind });
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEADER: &str = "ply\nformat binary_little_endian 1.0\ncomment x\nobj_info y\nelement vertex 2\n\
        property float x\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n";

    #[test]
    fn elements_and_properties_keep_their_order() {
        let header = Header::parse(HEADER.as_bytes()).unwrap();
        assert_eq!((header.encoding, header.length, header.lines), (Encoding::Little, HEADER.len(), 9));
        assert_eq!(header.vertices(), Some(2));
        let face = &header.elements[1].properties[0];
        assert_eq!((face.length_kind, face.kind), (Some(Kind::U8), Kind::I32));
    }

    #[test]
    fn every_end_of_line_is_taken_exactly() {
        for end in ["\n", "\r\n", "\r"] {
            let text = HEADER.replace('\n', end);
            let header = Header::parse(format!("{text}\n").as_bytes()).unwrap();
            assert_eq!(header.length, text.len());
        }
    }

    #[test]
    fn errors_name_the_line() {
        let cases = [
            ("ply\n", "plyx\n", 1, "is not \"ply\""),
            ("binary_little_endian", "binary", 2, "the encoding \"binary\""),
            ("1.0", "2.0", 2, "does not belong"),
            ("element vertex 2", "element vertex -2", 5, "\"-2\" is not a number"),
            ("element vertex 2", "element vertex 5000000000", 5, "decimate"),
            ("element face", "element vertex", 7, "declared twice"),
            ("float x", "int64 x", 6, "type \"int64\""),
            ("list uchar", "list byte", 8, "type \"byte\""),
            ("element vertex 2\n", "", 5, "before any element"),
            ("comment x", "remark x", 3, "\"remark x\""),
        ];
        for (old, new, line, message) in cases {
            let fault = Header::parse(HEADER.replacen(old, new, 1).as_bytes()).unwrap_err();
            assert_eq!(fault.place, crate::io::Place::Line(line), "{fault:?}");
            assert!(fault.problem.to_string().contains(message), "{}", fault.problem);
        }
    }

    #[test]
    fn a_header_without_its_end_or_format_is_refused() {
        let open = Header::parse(&HEADER.as_bytes()[..HEADER.len() - 1]).unwrap_err();
        assert_eq!(open.problem, Problem::EndsEarly("\"end_header\""));
        let bare = Header::parse(b"ply\nend_header\n").unwrap_err();
        assert!(bare.problem.to_string().contains("no \"format\""));
    }
}
