//! 16-bit greyscale PNG.

use std::io::Cursor;

use crate::io::error::{Fault, Problem};
use crate::io::limit;

/// A decoded image.
#[derive(Debug, PartialEq)]
pub(super) struct Image {
    pub width: usize,
    pub height: usize,
    /// Row by row.
    pub depth: Vec<u16>,
}

/// Decodes a depth image.
pub(super) fn decode(bytes: &[u8]) -> Result<Image, Fault> {
    let mut reader = png::Decoder::new(Cursor::new(bytes)).read_info().map_err(|e| damaged(&e))?;
    let info = reader.info();
    let (width, height) = (info.width as usize, info.height as usize);
    if (info.color_type, info.bit_depth) != (png::ColorType::Grayscale, png::BitDepth::Sixteen) {
        return Err(wrong_type(info.color_type, info.bit_depth));
    }
    check_size(width, height, bytes.len())?;
    let mut raw = vec![0; 2 * width * height];
    reader.next_frame(&mut raw).map_err(|e| damaged(&e))?;
    let depth = raw.chunks_exact(2).map(|pair| u16::from_be_bytes([pair[0], pair[1]])).collect();
    Ok(Image { width, height, depth })
}

/// Deflate shrinks by 1032 at most; what announces more pixels than that is not a whole image.
fn check_size(width: usize, height: usize, bytes: usize) -> Result<(), Fault> {
    const MOST: u64 = 1 << 24;
    let pixels = (width as u64).saturating_mul(height as u64);
    if pixels > MOST {
        let what = format!("the image has {pixels} pixels, the most is {MOST}; cut or shrink it");
        return Err(Problem::Other(what).in_whole());
    }
    limit::check(pixels * limit::PER_PIXEL).map_err(Problem::in_whole)?;
    let (needed, left) = (2 * pixels / 1032, bytes as u64);
    if needed > left {
        return Err(Problem::Truncated { what: "the image", needed, left }.in_whole());
    }
    Ok(())
}

fn damaged(error: &png::DecodingError) -> Fault {
    let hint = "give a complete PNG file of 16-bit greyscale";
    Problem::Other(format!("the image cannot be decoded ({error}); {hint}")).in_whole()
}

fn wrong_type(colour: png::ColorType, bits: png::BitDepth) -> Fault {
    let bits = bits as u8;
    let what =
        format!("a depth image is 16-bit greyscale, this one is {bits}-bit {colour:?}; export the raw depth");
    Problem::Other(what).in_whole()
}
