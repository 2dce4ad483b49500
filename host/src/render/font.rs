//! A small typeface for captions.

use super::image::Image;

/// The characters from space to tilde, sixteen in a row, five by nine cells each: seven above the
/// base line, two below.
const SHEET: &str = "\
..... #.... #.#.. ..... ..#.. ##..# .##.. #.... ..#.. #.... ..... ..... ..... ..... ..... ....#
..... #.... #.#.. .#.#. .#### ##..# #..#. #.... .#... .#... ..#.. ..#.. ..... ..... ..... ....#
..... #.... ..... ##### #.#.. ...#. #..#. ..... #.... ..#.. #.#.# ..#.. ..... ..... ..... ...#.
..... #.... ..... .#.#. .###. ..#.. .##.. ..... #.... ..#.. .###. ##### ..... ####. ..... ..#..
..... #.... ..... ##### ..#.# .#... #..## ..... #.... ..#.. #.#.# ..#.. ..... ..... ..... .#...
..... ..... ..... .#.#. ####. #..## #..#. ..... .#... .#... ..#.. ..#.. ##... ..... ##... #....
..... #.... ..... ..... ..#.. #..## .##.# ..... ..#.. #.... ..... ..... ##... ..... ##... #....
..... ..... ..... ..... ..... ..... ..... ..... ..... ..... ..... ..... .#... ..... ..... .....
..... ..... ..... ..... ..... ..... ..... ..... ..... ..... ..... ..... #.... ..... ..... .....
.##.. .#... .###. .###. ...#. ##### ..##. ##### .###. .###. ..... ..... ...#. ..... #.... .###.
#..#. ##... #...# #...# ..##. #.... .#... ....# #...# #...# ..... ..... ..#.. ..... .#... #...#
#..#. .#... ....# ....# .#.#. ####. #.... ...#. #...# #...# ##... ##... .#... ##### ..#.. ....#
#..#. .#... ...#. ..##. #..#. ....# ####. ...#. .###. .#### ##... ##... #.... ..... ...#. ...#.
#..#. .#... ..#.. ....# ##### ....# #...# ..#.. #...# ....# ..... ..... .#... ##### ..#.. ..#..
#..#. .#... .#... #...# ...#. #...# #...# ..#.. #...# ...#. ##... ##... ..#.. ..... .#... .....
.##.. ###.. ##### .###. ...#. .###. .###. ..#.. .###. .##.. ##... ##... ...#. ..... #.... ..#..
..... ..... ..... ..... ..... ..... ..... ..... ..... ..... ..... .#... ..... ..... ..... .....
..... ..... ..... ..... ..... ..... ..... ..... ..... ..... ..... #.... ..... ..... ..... .....
.###. ..#.. ####. .###. ####. ##### ##### .###. #...# ###.. ....# #...# #.... #...# #...# .###.
#...# .#.#. #...# #...# #...# #.... #.... #...# #...# .#... ....# #..#. #.... ##.## ##..# #...#
#.### .#.#. #...# #.... #...# #.... #.... #.... #...# .#... ....# #.#.. #.... #.#.# ##..# #...#
#.#.# #...# ####. #.... #...# ####. ####. #..## ##### .#... ....# ##... #.... #.#.# #.#.# #...#
#.### ##### #...# #.... #...# #.... #.... #...# #...# .#... #...# #.#.. #.... #...# #..## #...#
#.... #...# #...# #...# #...# #.... #.... #...# #...# .#... #...# #..#. #.... #...# #..## #...#
.###. #...# ####. .###. ####. ##### #.... .###. #...# ###.. .###. #...# ##### #...# #...# .###.
..... ..... ..... ..... ..... ..... ..... ..... ..... ..... ..... ..... ..... ..... ..... .....
..... ..... ..... ..... ..... ..... ..... ..... ..... ..... ..... ..... ..... ..... ..... .....
####. .###. ####. .###. ##### #...# #...# #...# #...# #...# ##### ###.. #.... ###.. ..#.. .....
#...# #...# #...# #...# ..#.. #...# #...# #...# #...# #...# ....# #.... #.... ..#.. .#.#. .....
#...# #...# #...# #.... ..#.. #...# #...# #...# .#.#. .#.#. ...#. #.... .#... ..#.. #...# .....
####. #...# ####. .###. ..#.. #...# #...# #.#.# ..#.. ..#.. ..#.. #.... ..#.. ..#.. ..... .....
#.... #.#.# #.#.. ....# ..#.. #...# .#.#. #.#.# .#.#. ..#.. .#... #.... ...#. ..#.. ..... .....
#.... #..#. #..#. #...# ..#.. #...# .#.#. ##.## #...# ..#.. #.... #.... ....# ..#.. ..... .....
#.... .##.# #...# .###. ..#.. .###. ..#.. #...# #...# ..#.. ##### ###.. ....# ###.. ..... .....
..... ..... ..... ..... ..... ..... ..... ..... ..... ..... ..... ..... ..... ..... ..... #####
..... ..... ..... ..... ..... ..... ..... ..... ..... ..... ..... ..... ..... ..... ..... .....
#.... ..... #.... ..... ....# ..... ..##. ..... #.... #.... ..#.. #.... #.... ..... ..... .....
.#... ..... #.... ..... ....# ..... .#... ..... #.... ..... ..... #.... #.... ..... ..... .....
..... .###. ####. .###. .#### .###. ####. .#### #.##. #.... ..#.. #..#. #.... ##.#. #.##. .###.
..... ....# #...# #...# #...# #...# .#... #...# ##..# #.... ..#.. #.#.. #.... #.#.# ##..# #...#
..... .#### #...# #.... #...# ##### .#... #...# #...# #.... ..#.. ##... #.... #.#.# #...# #...#
..... #...# #...# #...# #...# #.... .#... #...# #...# #.... ..#.. #.#.. #.... #.#.# #...# #...#
..... .#### ####. .###. .#### .###. .#... .#### #...# #.... ..#.. #..#. .#... #.#.# #...# .###.
..... ..... ..... ..... ..... ..... ..... ....# ..... ..... ..#.. ..... ..... ..... ..... .....
..... ..... ..... ..... ..... ..... ..... .###. ..... ..... ##... ..... ..... ..... ..... .....
..... ..... ..... ..... .#... ..... ..... ..... ..... ..... ..... ..#.. #.... #.... .....
..... ..... ..... ..... .#... ..... ..... ..... ..... ..... ..... .#... #.... .#... .....
####. .#### #.##. .#### ####. #...# #...# #...# #...# #...# ##### .#... #.... .#... .#...
#...# #...# ##... #.... .#... #...# #...# #.#.# .#.#. #...# ...#. #.... #.... ..#.. #.#.#
#...# #...# #.... .###. .#... #...# .#.#. #.#.# ..#.. #...# ..#.. .#... #.... .#... ...#.
#...# #...# #.... ....# .#... #..## .#.#. #.#.# .#.#. #..## .#... .#... #.... .#... .....
####. .#### #.... ####. ..##. .##.# ..#.. .#.#. #...# .##.# ##### ..#.. #.... #.... .....
#.... ....# ..... ..... ..... ..... ..... ..... ..... ....# ..... ..... ..... ..... .....
#.... ....# ..... ..... ..... ..... ..... ..... ..... .###. ..... ..... ..... ..... .....
";

/// Rows of a glyph.
pub const HEIGHT: usize = 9;
/// Columns from one glyph of the sheet to the next.
const PITCH: usize = 6;
/// Parts of a pixel, in each direction, that are looked at to smooth the outline.
const PARTS: usize = 4;

/// A line of text as columns of cells; bit r of a column is its cell in row r.
pub struct Line {
    columns: Vec<u16>,
}

impl Line {
    /// Sets a text. What is not printable ASCII becomes a question mark.
    pub fn new(text: &str) -> Self {
        let mut columns = Vec::new();
        for sign in text.chars() {
            columns.extend(glyph(sign));
            columns.push(0);
        }
        columns.pop();
        Self { columns }
    }

    /// Columns of the text.
    pub fn width(&self) -> usize {
        self.columns.len()
    }

    /// Writes the text `scale` times as large, its upper left corner at (left, top).
    pub fn write(&self, image: &mut Image, [left, top]: [usize; 2], scale: usize, ink: [u8; 3]) {
        for y in 0..HEIGHT * scale {
            for x in 0..self.width() * scale {
                let cover = self.cover(x, y, scale);
                if cover > 0.0 {
                    image.ink(left + x, top + y, ink, cover);
                }
            }
        }
    }

    /// Part of a pixel that is inked: cells are blended with their neighbours and cut off at less
    /// than a half, which rounds corners and keeps slanting strokes together.
    fn cover(&self, x: usize, y: usize, scale: usize) -> f32 {
        let place =
            |pixel: usize, part: usize| ((pixel * PARTS + part) as f32 + 0.5) / (scale * PARTS) as f32 - 0.5;
        let parts =
            (0..PARTS * PARTS).filter(|i| self.blend(place(x, i % PARTS), place(y, i / PARTS)) > 0.45);
        parts.count() as f32 / (PARTS * PARTS) as f32
    }

    fn blend(&self, x: f32, y: f32) -> f32 {
        let (column, row) = (x.floor(), y.floor());
        let (right, down) = (x - column, y - row);
        let cell = |dx: i32, dy: i32| self.cell(column as i32 + dx, row as i32 + dy);
        let upper = cell(0, 0) * (1.0 - right) + cell(1, 0) * right;
        let lower = cell(0, 1) * (1.0 - right) + cell(1, 1) * right;
        upper * (1.0 - down) + lower * down
    }

    fn cell(&self, column: i32, row: i32) -> f32 {
        let bits =
            usize::try_from(column).ok().and_then(|column| self.columns.get(column)).copied().unwrap_or(0);
        let row = u32::try_from(row).unwrap_or(HEIGHT as u32);
        f32::from(bits.checked_shr(row).unwrap_or(0) & 1)
    }
}

/// The columns of a sign, without the empty ones after it; three for a space.
fn glyph(sign: char) -> Vec<u16> {
    let index = if (' '..='~').contains(&sign) { sign as usize - 32 } else { '?' as usize - 32 };
    let mut columns = vec![0; PITCH - 1];
    for (row, line) in SHEET.lines().skip(index / 16 * HEIGHT).take(HEIGHT).enumerate() {
        let cells = line.bytes().skip(index % 16 * PITCH);
        columns.iter_mut().zip(cells).for_each(|(column, cell)| *column |= u16::from(cell == b'#') << row);
    }
    let used = columns.iter().rposition(|&column| column != 0).map_or(3, |last| last + 1);
    columns.truncate(used);
    columns
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pattern(line: &Line) -> Vec<String> {
        let row =
            |row| line.columns.iter().map(|bits| if bits >> row & 1 == 1 { '#' } else { '.' }).collect();
        (0..HEIGHT).map(row).collect()
    }

    #[test]
    fn sets_a_word() {
        let wanted =
            ["..##.#", ".#....", "####.#", ".#...#", ".#...#", ".#...#", ".#...#", "......", "......"];
        assert_eq!(pattern(&Line::new("fi")), wanted);
    }

    #[test]
    fn every_sign_is_drawn_and_differs_from_the_others() {
        let mut glyphs: Vec<_> = (' '..='~').map(glyph).collect();
        assert!(glyphs.iter().skip(1).all(|columns| columns.iter().any(|&bits| bits != 0)));
        glyphs.sort();
        assert!(glyphs.windows(2).all(|two| two[0] != two[1]));
    }

    #[test]
    fn odd_texts_do_no_harm() {
        assert_eq!(Line::new("").width(), 0);
        assert_eq!(pattern(&Line::new("\u{e9}")), pattern(&Line::new("?")));
        let mut image = Image::blank(4, 4);
        Line::new("too long").write(&mut image, [2, 2], 2, [0; 3]);
        Line::new("x").write(&mut image, [0, 0], 0, [0; 3]);
        Line::new("x").write(&mut Image::default(), [0, 0], 1, [0; 3]);
    }
}
