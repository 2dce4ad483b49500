//! The modes at the corners of one voxel cube, in integers.
//!
//! Corners that lie in the same brick share its exponents, and mostly all eight do. Weights and trilinear shares are
//! brought to fixed point for each such group; then a product of the basis, four corners at a time, is one integer
//! multiply-add.

use crate::model::Brick;
use crate::sample::power;

/// A share of one. Shares sum to one at most, so a sum with basis values is below 2²⁰ · 128.
const SHARE: f32 = (1 << 20) as f32;
/// A weight of one standard deviation at exponent 0: 16 σ · 2¹⁷ / 2⁵ · 128, for 127 modes, is below 2³¹.
const WEIGHT: f32 = (1 << 17) as f32;
/// Corners taken at a time.
const LANES: usize = 4;
/// Modes taken at a time.
const MODES: usize = 32;

/// A corner's number, 0..8, and its basis values.
type Member<'a> = (u8, &'a [u8]);

/// Corners in one brick.
#[derive(Clone, Copy, Debug)]
pub struct Corners<'a> {
    exponents: &'a [u8],
    members: [Member<'a>; 8],
    count: usize,
}

impl<'a> Corners<'a> {
    /// No corner yet.
    pub const fn new(brick: &Brick<'a>) -> Self {
        Self { exponents: brick.exponents(), members: [(0, &[]); 8], count: 0 }
    }

    /// Adds corner `number` with its basis values.
    #[inline]
    pub fn push(&mut self, number: u8, basis: &'a [u8]) {
        if let Some(member) = self.members.get_mut(self.count) {
            *member = (number, basis);
            self.count += 1;
        }
    }

    /// Up to four corners at a time: their numbers, and their basis values, those of the first where there is none.
    fn quads(&self) -> impl Iterator<Item = (&[Member<'a>], [&'a [u8]; LANES])> {
        let members = self.members.get(..self.count).unwrap_or(&[]);
        members.chunks(LANES).map(|quad| {
            let first = quad.first().map_or(&[][..], |&(_, basis)| basis);
            (quad, core::array::from_fn(|i| quad.get(i).map_or(first, |&(_, basis)| basis)))
        })
    }

    /// Adds Σ b' v to the value of each corner.
    #[inline(never)]
    pub fn add_sums(&self, weights: &[f32], values: &mut [f32; 8]) {
        for (part, weights) in weights.chunks(MODES).enumerate() {
            self.add_part(part * MODES, weights, values);
        }
    }

    /// The same for the modes from `first` on.
    fn add_part(&self, first: usize, weights: &[f32], values: &mut [f32; 8]) {
        let mut scaled = [0; MODES];
        let exponents = self.exponents.get(first..).unwrap_or(&[]);
        for ((scaled, &weight), &exponent) in scaled.iter_mut().zip(weights).zip(exponents) {
            *scaled = (weight * (WEIGHT * power(exponent))) as i32;
        }
        let scaled = scaled.get(..weights.len()).unwrap_or(&[]);
        for (quad, bases) in self.quads() {
            for (&(number, _), sum) in
                quad.iter().zip(dots(scaled, bases.map(|basis| basis.get(first..).unwrap_or(&[]))))
            {
                if let Some(value) = values.get_mut(usize::from(number)) {
                    *value += sum as f32 / WEIGHT;
                }
            }
        }
    }

    /// Adds Σ share · b' of the corners to each mode.
    #[inline(never)]
    pub fn add_modes(&self, shares: &[f32; 8], modes: &mut [f32]) {
        for (part, modes) in modes.chunks_mut(MODES).enumerate() {
            self.combine_part(part * MODES, shares, modes);
        }
    }

    /// The same for the modes from `first` on.
    fn combine_part(&self, first: usize, shares: &[f32; 8], modes: &mut [f32]) {
        let mut sums = [0; MODES];
        let sums = sums.get_mut(..modes.len()).unwrap_or_default();
        let exponents = self.exponents.get(first..).unwrap_or(&[]);
        for (quad, bases) in self.quads() {
            let share =
                |&(number, _): &Member<'_>| shares.get(usize::from(number)).map(|s| (s * SHARE) as i32);
            let bases = bases.map(|basis| basis.get(first..).unwrap_or(&[]));
            combine(sums, core::array::from_fn(|i| quad.get(i).and_then(share).unwrap_or(0)), bases);
        }
        for ((mode, &sum), &exponent) in modes.iter_mut().zip(sums.iter()).zip(exponents) {
            *mode += sum as f32 * (power(exponent) / SHARE);
        }
    }
}

/// Σ w b for four corners.
#[inline(never)]
fn dots(weights: &[i32], [a, b, c, d]: [&[u8]; LANES]) -> [i32; LANES] {
    let [mut p, mut q, mut r, mut s] = [0i32; LANES];
    let add =
        |sum: i32, weight: i32, value: u8| sum.wrapping_add(weight.wrapping_mul(i32::from(value as i8)));
    for ((((&w, &a), &b), &c), &d) in weights.iter().zip(a).zip(b).zip(c).zip(d) {
        (p, q, r, s) = (add(p, w, a), add(q, w, b), add(r, w, c), add(s, w, d));
    }
    [p, q, r, s]
}

/// Adds the four corners' basis values times their shares to each mode's sum.
#[inline(never)]
fn combine(sums: &mut [i32], [p, q, r, s]: [i32; LANES], [a, b, c, d]: [&[u8]; LANES]) {
    let times = |share: i32, value: u8| share.wrapping_mul(i32::from(value as i8));
    for ((((sum, &a), &b), &c), &d) in sums.iter_mut().zip(a).zip(b).zip(c).zip(d) {
        let (front, back) = (times(p, a).wrapping_add(times(q, b)), times(r, c).wrapping_add(times(s, d)));
        *sum = sum.wrapping_add(front.wrapping_add(back));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 45 modes are more than are taken at a time, six corners more than four.
    #[test]
    fn integer_sums_are_those_of_floats() {
        let exponents: [u8; 45] = core::array::from_fn(|k| 5 + (k % 6) as u8);
        let bases: [[u8; 45]; 6] =
            core::array::from_fn(|c| core::array::from_fn(|k| (c * 41 + k * 89 + 3) as u8));
        let mut corners = Corners { exponents: &exponents, members: [(0, &[]); 8], count: 0 };
        bases.iter().enumerate().for_each(|(c, basis)| corners.push(c as u8 + 1, basis));
        let value = |c: usize, k: usize| f32::from(bases[c][k] as i8) * power(exponents[k]);

        let weights: [f32; 45] = core::array::from_fn(|k| libm::sinf(k as f32) * 3.0);
        let mut values = [0.5; 8];
        corners.add_sums(&weights, &mut values);
        let exact = |c: usize| 0.5 + (0..45).map(|k| value(c, k) * weights[k]).sum::<f32>();
        assert!((0..6).all(|c| (values[c + 1] - exact(c)).abs() < 5e-3), "{values:?}");
        assert_eq!((values[0], values[7]), (0.5, 0.5));

        let shares = [0.9, 0.05, 0.15, 0.2, 0.1, 0.3, 0.2, 0.9];
        let mut modes = [0.25; 45];
        corners.add_modes(&shares, &mut modes);
        let exact = |k: usize| 0.25 + (0..6).map(|c| shares[c + 1] * value(c, k)).sum::<f32>();
        assert!((0..45).all(|k| (modes[k] - exact(k)).abs() < 1e-4), "{modes:?}");
    }
}
