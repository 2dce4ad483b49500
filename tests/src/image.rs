//! Images as files.

use png::{BitDepth, ColorType};

/// A PNG of `[width, height]` pixels.
///
/// # Panics
/// Bytes for more pixels, or fewer.
pub fn png([width, height]: [u32; 2], colour: ColorType, bits: BitDepth, pixels: &[u8]) -> Vec<u8> {
    let mut bytes = vec![];
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(colour);
    encoder.set_depth(bits);
    let mut writer = encoder.write_header().expect("a small image");
    writer.write_image_data(pixels).expect("as many pixels as announced");
    writer.finish().expect("memory");
    bytes
}

/// A greyscale PNG of 16 bits a pixel: a depth image.
pub fn grey(size: [u32; 2], pixels: &[u8]) -> Vec<u8> {
    png(size, ColorType::Grayscale, BitDepth::Sixteen, pixels)
}
