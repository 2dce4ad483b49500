//! Where the values of a PLY file come from: words of a text, or bytes.

use super::header::Element;
use super::scalar::{Endian, Kind};
use crate::io::error::{Fault, Place, Problem};
use crate::io::text::number;

/// The values after the header, one after the other.
pub(super) trait Source<'a> {
    /// The next value.
    fn value(&mut self, kind: Kind) -> Result<f64, Fault>;

    /// Steps over `count` values.
    fn skip(&mut self, kind: Kind, count: usize) -> Result<(), Fault>;

    /// Every row ends here.
    fn end_row(&mut self) -> Result<(), Fault>;

    /// Where the next value stands.
    fn place(&self) -> Place;

    /// Bytes that are left.
    fn left(&self) -> usize;

    /// The fewest bytes that a value takes.
    fn least(&self, kind: Kind) -> usize;

    /// All rows of an element at once, if they are bytes of a fixed layout.
    fn rows(&mut self, _element: &Element, _stride: usize) -> Option<(&'a [u8], Endian)> {
        None
    }

    /// All that is left, and a way to say how much of it was used, if it is little-endian bytes.
    fn little(&mut self) -> Option<&mut &'a [u8]> {
        None
    }
}

/// Values as bytes.
pub(super) struct Binary<'a> {
    rest: &'a [u8],
    total: usize,
    endian: Endian,
}

impl<'a> Binary<'a> {
    /// The values from byte `at` on.
    pub fn new(bytes: &'a [u8], at: usize, endian: Endian) -> Self {
        Self { rest: &bytes[at..], total: bytes.len(), endian }
    }

    fn take(&mut self, kind: Kind, count: usize) -> Result<&'a [u8], Fault> {
        let needed = kind.size().saturating_mul(count);
        let Some((taken, rest)) = self.rest.split_at_checked(needed) else {
            let (needed, left) = (needed as u64, self.rest.len() as u64);
            let problem = Problem::Truncated { what: "the next value", needed, left };
            return Err(Fault { place: self.place(), problem });
        };
        self.rest = rest;
        Ok(taken)
    }
}

impl<'a> Source<'a> for Binary<'a> {
    fn value(&mut self, kind: Kind) -> Result<f64, Fault> {
        Ok(kind.decode(self.take(kind, 1)?, self.endian))
    }

    fn skip(&mut self, kind: Kind, count: usize) -> Result<(), Fault> {
        self.take(kind, count).map(|_| ())
    }

    fn end_row(&mut self) -> Result<(), Fault> {
        Ok(())
    }

    fn place(&self) -> Place {
        Place::Byte(self.total - self.rest.len())
    }

    fn left(&self) -> usize {
        self.rest.len()
    }

    fn least(&self, kind: Kind) -> usize {
        kind.size()
    }

    fn rows(&mut self, element: &Element, stride: usize) -> Option<(&'a [u8], Endian)> {
        let (rows, rest) = self.rest.split_at_checked(stride.checked_mul(element.count)?)?;
        self.rest = rest;
        Some((rows, self.endian))
    }

    fn little(&mut self) -> Option<&mut &'a [u8]> {
        (self.endian == Endian::Little).then_some(&mut self.rest)
    }
}

/// Values as words; a row is a line.
pub(super) struct Ascii<'a> {
    rest: &'a [u8],
    line: usize,
}

impl<'a> Ascii<'a> {
    /// The values from byte `at` on, which is the head of line `line`.
    pub fn new(bytes: &'a [u8], at: usize, line: usize) -> Self {
        Self { rest: &bytes[at..], line }
    }

    /// Steps over white space, on this line and on later ones.
    fn skip_blanks(&mut self) {
        while let [first, rest @ ..] = self.rest {
            if !first.is_ascii_whitespace() {
                break;
            }
            // CR LF is one end of line, counted at its LF.
            self.line += usize::from(*first == b'\n' || *first == b'\r' && rest.first() != Some(&b'\n'));
            self.rest = rest;
        }
    }

    fn word(&mut self) -> Result<&'a [u8], Fault> {
        self.skip_blanks();
        let end = self.rest.iter().position(u8::is_ascii_whitespace).unwrap_or(self.rest.len());
        let (word, rest) = self.rest.split_at(end);
        self.rest = rest;
        if word.is_empty() { Err(Problem::EndsEarly("a number").in_line(self.line)) } else { Ok(word) }
    }
}

impl<'a> Source<'a> for Ascii<'a> {
    fn value(&mut self, _kind: Kind) -> Result<f64, Fault> {
        let word = self.word()?;
        number(word).map_err(|problem| problem.in_line(self.line))
    }

    fn skip(&mut self, _kind: Kind, count: usize) -> Result<(), Fault> {
        (0..count).try_for_each(|_| self.word().map(|_| ()))
    }

    fn end_row(&mut self) -> Result<(), Fault> {
        let line = self.line;
        self.skip_blanks();
        let ended = self.line > line || self.rest.is_empty();
        if ended { Ok(()) } else { Err(too_long().in_line(line)) }
    }

    fn place(&self) -> Place {
        Place::Line(self.line)
    }

    fn left(&self) -> usize {
        // The last value needs no separator after it.
        self.rest.len() + 1
    }

    fn least(&self, _kind: Kind) -> usize {
        2
    }
}

/// The problem of a line that goes on after its row.
pub(super) fn too_long() -> Problem {
    Problem::Other(
        "this or the previous line has not as many values as the header declares; correct it".into(),
    )
}
