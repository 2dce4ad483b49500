//! Trilinear samples of the mean and the modes at a continuous position.

use crate::corners::Corners;
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

    /// Trilinear weights of the eight corners.
    pub fn weights(&self) -> [f32; 8] {
        let [x, y, z] = self.within;
        let (nx, ny, nz) = (1.0 - x, 1.0 - y, 1.0 - z);
        let (a, b, c, d) = (ny * nz, y * nz, ny * z, y * z);
        [nx * a, x * a, nx * b, x * b, nx * c, x * c, nx * d, x * d]
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

/// Distance Φ = M + b'·v and its gradient at `at` (voxels), for the weights `v` in standard deviations.
/// With `modes`, also the interpolated b' of the first `modes.len()` modes, voxels per standard deviation.
/// `None` unless all eight voxels around `at` are stored.
pub fn band(
    model: &Model<'_>,
    at: [f32; 3],
    weights: &[f32],
    mut modes: Option<&mut [f32]>,
) -> Option<(f32, [f32; 3])> {
    let place = Place::new(at, 1)?;
    let edge = model.grid().brick();
    let low = place.corner.map(|v| v.checked_rem(u16::from(edge)).unwrap_or(0) as u8);
    // Bit i: along axis i the second corner lies in the next brick.
    let [x, y, z] = low.map(|v| usize::from(v + 1 == edge));
    let crossing = x | y << 1 | z << 2;
    let mut values = [0.0f32; 8];
    if let Some(modes) = modes.as_deref_mut() {
        modes.fill(0.0);
    }
    for group in (0..8).filter(|group| group & !crossing == 0) {
        let brick = model.brick_at(place.position(group))?;
        let mut corners = Corners::new(&brick);
        // Two corners along x are a pair: one row, and mostly two voxels side by side.
        for (pair, values) in values.as_chunks_mut::<2>().0.iter_mut().enumerate() {
            let second = pair << 1;
            if second & crossing != group & 6 {
                continue;
            }
            let within = |axis: usize, low: u8| {
                let second = (second >> axis & 1) as u8;
                if crossing >> axis & 1 == 0 { low + second } else { low * (1 - second) }
            };
            let [x, y, z] = low;
            let row = brick.row(within(1, y), within(2, z));
            let x = if group & 1 == 0 { x } else { 0 };
            let voxel = row.voxel(x)?;
            let mut take = |c: usize, voxel: usize| {
                if let Some(value) = values.get_mut(c) {
                    *value = f32::from(brick.mean(voxel)) / 256.0;
                    corners.push((second | c) as u8, brick.basis(voxel));
                }
            };
            take(group & 1, voxel);
            if crossing & 1 == 0 {
                if row.mask >> x & 2 == 0 {
                    return None;
                }
                take(1, voxel + 1);
            }
        }
        if !weights.is_empty() {
            corners.add_sums(weights, &mut values);
        }
        if let Some(modes) = modes.as_deref_mut() {
            corners.add_modes(&place.weights(), modes);
        }
    }
    Some(place.interpolate(&values))
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
        assert!((place.weights().iter().sum::<f32>() - 1.0).abs() < 1e-6);
    }

    #[test]
    fn powers_are_exact() {
        assert_eq!(power(5), 1.0 / 32.0);
        assert_eq!(power(0), 1.0);
    }
}
