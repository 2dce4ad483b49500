//! The eight stored voxels around a place of the band, and what mean and modes are there.

use crate::brick::Brick;
use crate::corners::{self, Basis, LANES, MODES, PHI_BITS, ScaledWeights, Weights};
use crate::model::Model;
use crate::sample::Place;

/// A voxel at a corner.
#[derive(Clone, Copy, Debug)]
struct Corner<'a> {
    /// Its basis values, as the bytes of i8, and those of the voxels behind.
    basis: &'a [u8],
    /// Mean distance, 1/256 voxel.
    mean: i16,
    /// Bit 0 is x, bit 1 is y, bit 2 is z.
    number: u8,
}

/// The voxels around a place, brick by brick, and the surface M + b'·v at it. What belongs to a brick is kept for the next
/// place, which mostly lies in the same one.
#[derive(Debug)]
pub struct Cube<'a, 'w> {
    model: &'w Model<'a>,
    weights: ScaledWeights<'a, 'w>,
    place: Place,
    corners: [Corner<'a>; 8],
    /// Exponents of the bricks.
    exponents: [&'a [u8]; 8],
    /// Corners in each brick: 8, 4, 2 or 1.
    each: usize,
    /// The last brick that had all corners of a cube,
    brick: Option<Brick<'a>>,
    /// and its cell.
    cell: [u16; 3],
}

impl<'a, 'w> Cube<'a, 'w> {
    /// Room for one, in a model with a surface of these weights.
    #[must_use]
    pub const fn new(model: &'w Model<'a>, weights: &'w Weights) -> Self {
        let (corner, place) =
            (Corner { basis: &[], mean: 0, number: 0 }, Place { corner: [0; 3], within: [0.0; 3] });
        Self {
            model,
            weights: ScaledWeights::new(weights),
            place,
            corners: [corner; 8],
            exponents: [&[]; 8],
            each: 8,
            brick: None,
            cell: [0; 3],
        }
    }

    /// The model.
    pub const fn model(&self) -> &'w Model<'a> {
        self.model
    }

    /// Takes the voxels around `at` (voxels); `None` unless all eight are stored.
    #[inline(never)]
    pub fn find(&mut self, at: [f32; 3]) -> Option<&mut Self> {
        let model = self.model;
        self.place = Place::new(at, 1)?;
        let edge = u16::from(model.grid().brick());
        let cell = self.place.corner.map(|v| v.checked_div(edge).unwrap_or(0));
        let [a, b, c] = cell;
        let [x, y, z] = self.place.corner;
        let low = |v: u16, cell: u16| v.wrapping_sub(cell.wrapping_mul(edge)) as u8;
        let low = [low(x, a), low(y, b), low(z, c)];
        // Bit i: along axis i the second corner lies in the next brick.
        let last = |v: u8| u8::from(u16::from(v) + 1 == edge);
        let crossing = last(low[0]) | last(low[1]) << 1 | last(low[2]) << 2;
        self.each = 8usize >> crossing.count_ones().min(3);
        if crossing == 0 {
            // Most cubes: the compiler makes a path of its own of it.
            if self.brick.is_none() || self.cell != cell {
                self.brick = model.brick(model.brick_of_cell(cell)?);
                self.cell = cell;
            }
            let brick = self.brick.as_ref()?;
            self.exponents[0] = brick.exponents();
            take(&mut self.corners, brick, [0, 0], low)?;
            return Some(self);
        }
        let (mut bricks, mut taken) = (0, 0);
        for number in 0..=crossing {
            if number & !crossing != 0 {
                continue;
            }
            let cell =
                [a + u16::from(number & 1), b + u16::from(number >> 1 & 1), c + u16::from(number >> 2)];
            let brick = model.brick(model.brick_of_cell(cell)?)?;
            *self.exponents.get_mut(bricks)? = brick.exponents();
            take(self.corners.get_mut(taken..)?, &brick, [number, crossing], low)?;
            (bricks, taken) = (bricks + 1, taken + self.each);
        }
        Some(self)
    }

    /// Distance Φ = M + b'·v and its gradient.
    pub fn distance(&mut self) -> (f32, [f32; 3]) {
        let mut sums = self.corners.each_ref().map(|corner| corners::of_mean(corner.mean));
        for part in 0..self.weights.parts() {
            let (weights, exponents, each) = (&mut self.weights, &self.exponents, self.each.max(1));
            with_bases(&self.corners, part * MODES, |bases| {
                add_sums((weights, part), exponents, each, bases, &mut sums);
            });
        }
        let mut values = [0.0; 8];
        for (corner, sum) in self.corners.iter().zip(sums) {
            if let Some(value) = values.get_mut(usize::from(corner.number)) {
                *value = corners::in_voxels(sum);
            }
        }
        self.place.interpolate(&values)
    }

    /// Sets the parts of a row to the interpolated modes b' times `factor` / 2¹³; `least` are the least exponents of the
    /// modes: see [`corners::rescale`]. What lies behind the last mode is rubbish.
    pub fn modes(&self, factor: i16, least: &[[u8; MODES]], row: &mut [[i16; MODES]]) {
        let phi = self.place.trilinear_weights(PHI_BITS);
        let of_corner = |corner: &Corner<'_>| phi.get(usize::from(corner.number)).copied().unwrap_or(0);
        let phi = self.corners.each_ref().map(of_corner);
        for (part, (least, row)) in least.iter().zip(row).enumerate() {
            let first = part * MODES;
            with_bases(&self.corners, first, |bases| {
                self.interpolate(bases, &phi, (factor, least, first), row)
            });
        }
    }

    /// The same for the modes from `first` on, by the corners' trilinear weights.
    #[inline(never)]
    fn interpolate(
        &self,
        bases: &[&Basis; 8],
        phi: &[i16; 8],
        (factor, least, first): (i16, &[u8; MODES], usize),
        row: &mut [i16; MODES],
    ) {
        let mut bricks = self.bricks(bases).zip(self.bricks(phi)).zip(&self.exponents);
        let sum_up = |sums: &mut [i16; MODES], ((bases, phi), exponents): ((&[&Basis], &[i16]), &&[u8])| {
            sums.fill(0);
            for (bases, phi) in bases.chunks(2).zip(phi.chunks(2)) {
                let of_lane = |lane: usize| phi.get(lane).copied().unwrap_or(0);
                corners::combine(sums, [of_lane(0), of_lane(1)], lanes(bases));
            }
            corners::rescale(sums, factor, exponents.get(first..).unwrap_or(&[]), least);
        };
        if let Some(brick) = bricks.next() {
            sum_up(row, brick);
        }
        for brick in bricks {
            let mut sums = [0; MODES];
            sum_up(&mut sums, brick);
            row.iter_mut().zip(&sums).for_each(|(entry, &sum)| *entry = entry.wrapping_add(sum));
        }
    }

    /// What belongs to the corners of each brick.
    fn bricks<'s, T>(&self, all: &'s [T; 8]) -> impl Iterator<Item = &'s [T]> + use<'s, T> {
        all.chunks(self.each.max(1))
    }
}

/// Takes the corners that lie in a brick; `None` if one is not stored. `number` has the bits of the axes along which it is
/// the second brick, of those along which there are two: `crossing`.
#[inline(always)]
fn take<'a>(
    corners: &mut [Corner<'a>],
    brick: &Brick<'a>,
    [number, crossing]: [u8; 2],
    [x, y, z]: [u8; 3],
) -> Option<()> {
    // Along an axis that is crossed there is one layer of voxels: the last of a brick, or the first of the next.
    let layers = |axis: u8, low: u8| match (crossing >> axis & 1, number >> axis & 1) {
        (0, _) => (low, 2),
        (_, 0) => (low, 1),
        _ => (0, 1),
    };
    let ((x, width), (y, height), (z, depth)) = (layers(0, x), layers(1, y), layers(2, z));
    let wanted = if width == 2 { 3 } else { 1 };
    let mut slots = corners.iter_mut();
    for k in 0..depth {
        for j in 0..height {
            let row = brick.row(y + j, z + k);
            if row.mask >> (x & 7) & wanted != wanted {
                return None;
            }
            let (voxel, number) = (row.rank(x), number | j << 1 | k << 2);
            *slots.next()? = Corner { basis: brick.basis_from(voxel), mean: brick.mean(voxel), number };
            if width == 2 {
                let (voxel, number) = (voxel + 1, number | 1);
                *slots.next()? = Corner { basis: brick.basis_from(voxel), mean: brick.mean(voxel), number };
            }
        }
    }
    Some(())
}

/// Adds Σ b' v of a part of the modes to the sums of the corners, `each` of them in a brick.
#[inline(never)]
fn add_sums<'a>(
    (weights, part): (&mut ScaledWeights<'a, '_>, usize),
    exponents: &[&'a [u8]; 8],
    each: usize,
    bases: &[&Basis; 8],
    sums: &mut [i32; 8],
) {
    for ((bases, sums), exponents) in bases.chunks(each).zip(sums.chunks_mut(each)).zip(exponents) {
        let scaled = weights.part(part, exponents);
        for (bases, sums) in bases.chunks(LANES).zip(sums.chunks_mut(LANES)) {
            for (sum, dot) in sums.iter_mut().zip(corners::dots::<LANES>(scaled, lanes(bases))) {
                *sum = sum.wrapping_add(dot);
            }
        }
    }
}

/// Calls with the corners' basis values from mode `first` on.
#[inline(always)]
fn with_bases(corners: &[Corner<'_>; 8], first: usize, call: impl FnOnce(&[&Basis; 8])) {
    let mut bases = [&[0; MODES]; 8];
    let mut complete = true;
    for (basis, corner) in bases.iter_mut().zip(corners) {
        match corner.basis.get(first..).and_then(|values| values.first_chunk()) {
            Some(values) => *basis = values,
            None => complete = false,
        }
    }
    if complete {
        return call(&bases);
    }
    let padded = corners.each_ref().map(|corner| corners::padded(corner.basis.get(first..).unwrap_or(&[])));
    call(&padded.each_ref());
}

/// The corners taken at a time, the first again where there is none.
#[inline(always)]
fn lanes<'a, const N: usize>(bases: &[&'a Basis]) -> [&'a Basis; N] {
    let first = bases.first().copied().unwrap_or(&[0; MODES]);
    core::array::from_fn(|lane| bases.get(lane).copied().unwrap_or(first))
}
