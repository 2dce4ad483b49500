//! Trilinear samples at a continuous position: places, and the mean's far field.

use crate::model::Model;

/// Lowest corner of a cell and the position within it, each coordinate within 0..1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Voxel (or node) position of the lowest corner.
    pub corner: [u16; 3],
    /// Position within the cell.
    pub within: [f32; 3],
}

impl Place {
    /// Where `at` lies in a grid whose samples are `stride` voxels apart; `None` below zero or beyond u16.
    pub fn new(at: [f32; 3], stride: u8) -> Option<Self> {
        let step = f32::from(stride.max(1));
        let mut place = Self { corner: [0; 3], within: [0.0; 3] };
        for ((corner, within), x) in place.corner.iter_mut().zip(&mut place.within).zip(at) {
            let x = x / step;
            if !(0.0..60_000.0).contains(&x) {
                return None;
            }
            let low = libm::floorf(x);
            *corner = low as u16;
            *within = x - low;
        }
        Some(place)
    }

    /// Position of corner `c` of 8: bit 0 is x, bit 1 is y, bit 2 is z.
    pub fn position(&self, c: usize) -> [u16; 3] {
        let [x, y, z] = self.corner;
        [x + (c & 1) as u16, y + (c >> 1 & 1) as u16, z + (c >> 2 & 1) as u16]
    }

    /// Trilinear weights of the eight corners, in integers that add up to `1 << bits`, at most 2¹⁰; the last corner takes
    /// what rounding leaves.
    pub fn trilinear_weights(&self, bits: u32) -> [i16; 8] {
        let one = 1i32 << bits.min(10);
        let [x, y, z] = self.within.map(|t| (t * one as f32) as i32);
        let (nx, ny, nz) = (one - x, one - y, one - z);
        let (a, b, c) = (ny * nz, y * nz, ny * z);
        let product = |u: i32, v: i32| ((u * v) >> (2 * bits.min(10))) as i16;
        let [p, q, r, s, t, u, v] = [
            product(nx, a),
            product(x, a),
            product(nx, b),
            product(x, b),
            product(nx, c),
            product(x, c),
            product(nx, y * z),
        ];
        [p, q, r, s, t, u, v, one as i16 - (p + q + r + s + t + u + v)]
    }

    /// Value and gradient of the trilinear interpolation of eight corner values.
    pub fn interpolate(&self, v: &[f32; 8]) -> (f32, [f32; 3]) {
        let [x, y, z] = self.within;
        let [a, b, c, d, e, f, g, h] = *v;
        let lerp = |p: f32, q: f32, t: f32| p + (q - p) * t;
        let (ab, cd, ef, gh) = (lerp(a, b, x), lerp(c, d, x), lerp(e, f, x), lerp(g, h, x));
        let (low, high) = (lerp(ab, cd, y), lerp(ef, gh, y));
        let dx = lerp(lerp(b - a, d - c, y), lerp(f - e, h - g, y), z);
        let dy = lerp(cd - ab, gh - ef, z);
        (lerp(low, high, z), [dx, dy, high - low])
    }
}

/// Mean distance and gradient of the far field at `at` (voxels); `None` off its support.
pub fn far(model: &Model<'_>, at: [f32; 3]) -> Option<(f32, [f32; 3])> {
    let stride = model.header().far_stride;
    let place = Place::new(at, stride)?;
    let mut values = [0.0; 8];
    for (c, value) in values.iter_mut().enumerate() {
        *value = model.far(place.position(c))?;
    }
    let (value, gradient) = place.interpolate(&values);
    let step = f32::from(stride.max(1));
    Some((value, gradient.map(|g| g / step)))
}

/// 2^-exponent.
#[inline]
pub fn power(exponent: u8) -> f32 {
    f32::from_bits(127u32.saturating_sub(u32::from(exponent)) << 23)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn interpolation_is_exact_for_a_plane() {
        let place = Place { corner: [0; 3], within: [0.25, 0.5, 0.75] };
        let values = core::array::from_fn(|c| {
            let [x, y, z] = place.position(c).map(f32::from);
            1.0 + 2.0 * x - 3.0 * y + 4.0 * z
        });
        let (value, gradient) = place.interpolate(&values);
        assert!((value - (1.0 + 0.5 - 1.5 + 3.0)).abs() < 1e-6);
        assert_eq!(gradient, [2.0, -3.0, 4.0]);
    }

    #[test]
    fn integer_trilinear_weights_are_those_of_floats() {
        for within in [[0.25, 0.5, 0.75], [0.0; 3], [0.999_999_9; 3], [0.1, 0.7, 0.013]] {
            let place = Place { corner: [0; 3], within };
            let weights = place.trilinear_weights(8);
            assert_eq!(weights.iter().sum::<i16>(), 256);
            for (c, found) in weights.into_iter().enumerate() {
                let along = |axis: usize| if c >> axis & 1 == 0 { 1.0 - within[axis] } else { within[axis] };
                let weight: f32 = (0..3).map(along).product();
                assert!(found >= 0 && (f32::from(found) / 256.0 - weight).abs() < 8.0 / 256.0, "{weights:?}");
            }
        }
    }

    #[test]
    fn powers_are_exact() {
        assert_eq!(power(5), 1.0 / 32.0);
        assert_eq!(power(0), 1.0);
    }
}
