//! Lines of text without `core::fmt`, which would bring its panics and kilobytes along.

use semihosting::io::{self, Write};

/// A line under construction.
pub struct Line {
    bytes: [u8; 96],
    length: usize,
}

impl Line {
    /// A line that begins with `text`.
    pub fn new(text: &str) -> Self {
        Self { bytes: [0; 96], length: 0 }.text(text)
    }

    /// Appends text; what does not fit is dropped.
    pub fn text(mut self, text: &str) -> Self {
        for &byte in text.as_bytes() {
            if let Some(slot) = self.bytes.get_mut(self.length) {
                *slot = byte;
                self.length += 1;
            }
        }
        self
    }

    /// Appends a space and a number in decimal.
    pub fn number(self, mut number: u64) -> Self {
        let mut digits = [0u8; 20];
        let mut used = 0;
        for slot in &mut digits {
            *slot = b'0' + (number % 10) as u8;
            number /= 10;
            used += 1;
            if number == 0 {
                break;
            }
        }
        let mut line = self.text(" ");
        for &digit in digits.iter().take(used).rev() {
            line = line.byte(digit);
        }
        line
    }

    /// Appends a space and a number as eight hexadecimal digits.
    pub fn hex(self, number: u32) -> Self {
        let mut line = self.text(" ");
        for shift in (0..32).step_by(4).rev() {
            let digit = (number >> shift & 15) as u8;
            line = line.byte(if digit < 10 { b'0' + digit } else { b'a' - 10 + digit });
        }
        line
    }

    fn byte(mut self, byte: u8) -> Self {
        if let Some(slot) = self.bytes.get_mut(self.length) {
            *slot = byte;
            self.length += 1;
        }
        self
    }

    /// Writes the line to the emulator's standard output; without an emulator nobody reads it.
    pub fn print(self) {
        let line = self.byte(b'\n');
        if let (Ok(mut out), Some(bytes)) = (io::stdout(), line.bytes.get(..line.length)) {
            let _ = out.write_all(bytes);
        }
    }
}
