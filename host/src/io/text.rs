//! Lines, words and numbers of text formats.

use super::error::{Fault, Problem};

/// The lines of a text with their numbers, counted from 1; ends of line may be LF, CR LF or CR.
pub(super) struct Lines<'a> {
    rest: &'a [u8],
    number: usize,
    continued: bool,
}

impl<'a> Lines<'a> {
    /// The lines of `bytes`, a byte order mark at their head left out.
    pub fn new(bytes: &'a [u8]) -> Self {
        Self { rest: without_mark(bytes), number: 0, continued: false }
    }

    /// A backslash at the end of a line joins it with the next one.
    pub fn continued(self) -> Self {
        Self { continued: true, ..self }
    }

    /// Takes one line, without and with its end, off the rest.
    fn split(&mut self, from: usize) -> (usize, usize) {
        let tail = &self.rest[from..];
        let end = tail.iter().position(|&b| b == b'\n' || b == b'\r').unwrap_or(tail.len());
        let gap = if tail[end..].starts_with(b"\r\n") { 2 } else { 1 };
        self.number += 1;
        (from + end, (from + end + gap).min(self.rest.len()))
    }
}

impl<'a> Iterator for Lines<'a> {
    type Item = (usize, &'a [u8]);

    fn next(&mut self) -> Option<Self::Item> {
        if self.rest.is_empty() {
            return None;
        }
        let (mut end, mut next) = self.split(0);
        let number = self.number;
        while self.continued && next < self.rest.len() && self.rest[..end].ends_with(b"\\") {
            (end, next) = self.split(next);
        }
        let line = &self.rest[..end];
        self.rest = &self.rest[next..];
        Some((number, line))
    }
}

/// The bytes after a byte order mark, if there is one.
pub(super) fn without_mark(bytes: &[u8]) -> &[u8] {
    bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes)
}

/// The words of a line; the backslash of a continued line is none.
pub(super) fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty() && *word != b"\\")
}

/// The number that `word` stands for, "nan" and "inf" included.
pub(super) fn number(word: &[u8]) -> Result<f64, Problem> {
    if let Some(value) = small_integer(word) {
        return Ok(f64::from(value));
    }
    let parsed = std::str::from_utf8(word).ok().and_then(|text| text.parse().ok());
    parsed.ok_or_else(|| Problem::NotANumber(quote(word)))
}

/// Up to nine digits and nothing else: most indices.
pub(super) fn small_integer(word: &[u8]) -> Option<u32> {
    let digits = (1..=9).contains(&word.len()) && word.iter().all(u8::is_ascii_digit);
    digits.then(|| word.iter().fold(0, |sum, &digit| sum * 10 + u32::from(digit - b'0')))
}

/// The next `N` words of a line as numbers.
pub(super) fn numbers<'a, const N: usize>(
    words: &mut impl Iterator<Item = &'a [u8]>,
    line: usize,
) -> Result<[f64; N], Fault> {
    let mut values = [0.0; N];
    for (found, value) in values.iter_mut().enumerate() {
        let expected = if N == 3 { "3" } else { "more" };
        let word = words.next().ok_or(Problem::Columns { expected, found });
        *value = word.and_then(number).map_err(|problem| problem.in_line(line))?;
    }
    Ok(values)
}

/// A piece of the file for an error message: printable and short.
pub(super) fn quote(word: &[u8]) -> String {
    let text: String = String::from_utf8_lossy(word).chars().take(24).collect();
    if word.len() > text.len() { format!("{text}…") } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(text: &[u8]) -> Vec<(usize, &[u8])> {
        Lines::new(text).collect()
    }

    #[test]
    fn lines_end_in_any_style() {
        let expected: [(usize, &[u8]); 4] = [(1, b"a"), (2, b"b"), (3, b""), (4, b"c")];
        assert_eq!(lines(b"a\nb\n\nc\n"), expected);
        assert_eq!(lines(b"a\r\nb\r\n\r\nc"), expected);
        assert_eq!(lines(b"a\rb\r\rc\r"), expected);
    }

    #[test]
    fn a_byte_order_mark_is_skipped() {
        assert_eq!(lines(b"\xEF\xBB\xBFv"), [(1, b"v".as_slice())]);
    }

    #[test]
    fn a_continued_line_keeps_its_first_number() {
        let joined: Vec<_> = Lines::new(b"f 1 \\\n 2 3\nv\\").continued().collect();
        assert_eq!(joined, [(1, b"f 1 \\\n 2 3".as_slice()), (3, b"v\\".as_slice())]);
        assert_eq!(words(joined[0].1).count(), 4);
    }

    #[test]
    fn numbers_are_read_in_all_usual_spellings() {
        for (word, value) in [("17", 17.0), ("-1.5e3", -1500.0), ("+.25", 0.25), ("4000000000", 4e9)] {
            assert_eq!(number(word.as_bytes()), Ok(value));
        }
        assert!(number(b"-nan").unwrap().is_nan());
    }

    #[test]
    fn words_that_are_no_numbers_are_quoted() {
        assert_eq!(number(b"1,5"), Err(Problem::NotANumber("1,5".into())));
        assert_eq!(quote(&[b'x'; 30]), format!("{}…", "x".repeat(24)));
    }
}
