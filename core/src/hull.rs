//! The hull: signed distances in a thin layer around the measured surface, along the lines of sight
//! (Curless & Levoy 1996, CL96 in the paper).
//!
//! A point claims the voxels along its normal, up to `front` before and behind the surface and `lateral`
//! sideways. Of all points that reach a voxel the nearest one gives the distance, measured to its tangent
//! plane; equally near ones are ordered by that distance, so the order of points does not matter. Voxels
//! more than `behind` behind the surface are then left out: a line of sight says nothing about what lies
//! there. They are claimed all the same, or the head behind a thin ear would reach through it (measured:
//! 0.5 mm instead of 0.135 on complete faces). Voxels beyond the scan's border are reached by no normal.

use crate::arithmetic::{DISTANCE_BITS, FULL_WEIGHT};
use crate::brick::BrickRows;
use crate::digest::digest;
use crate::error::{Buffer, Error};
use crate::fixed::round_shift;
use crate::format::PER_VOXEL;
use crate::lent::Lent;
use crate::mirror;
use crate::model::Model;

pub use crate::reach::Reach;
pub use crate::target::Target;

const NORMAL_BITS: u32 = 12;
/// "Weight" of a claimed voxel that is not in the hull.
const UNWEIGHTED: i32 = 1;
/// Least key of a mirrored point: behind those of all measured ones.
const MIRRORED_KEY: u16 = 40_000;

/// The farthest voxel that a point claims, 1/65536 voxel².
const FARTHEST: u32 = (Reach::MOST_FRONT as u32).pow(2) + (Reach::MOST_LATERAL as u32).pow(2);
const _: () = assert!((FARTHEST >> KEY_SHIFT) + 1 < MIRRORED_KEY as u32);
/// A key of a measured point is a squared distance by this many bits coarser.
const KEY_SHIFT: u32 = 7;

/// Builds a hull point by point.
#[derive(Debug)]
pub struct HullBuilder<'m, 'b, K: Lent<u16>> {
    model: &'m Model<'m>,
    reach: Reach,
    targets: &'b mut [i16],
    /// How close the point is that claimed each voxel: the smaller key claims. Of a measured point its squared distance,
    /// 1/512 voxel², one more; of a mirror image [`MIRRORED_KEY`] and 1/256 voxel²; 0 stands for "not reached".
    keys: &'b mut [K],
}

/// A finished hull.
#[derive(Clone, Copy, Debug)]
pub struct Hull<'b> {
    /// One [`Target`] a stored voxel.
    pub targets: &'b [i16],
    /// Voxels in the hull.
    pub count: u32,
    /// Sum of their weights, sixteenths.
    pub weight: u32,
}

impl<'m, 'b, K: Lent<u16>> HullBuilder<'m, 'b, K> {
    /// An empty hull. `targets` and `keys` have one element a stored voxel; `keys` is scratch.
    ///
    /// # Errors
    /// A buffer that is too small, or a reach out of range.
    pub fn new(
        model: &'m Model<'m>,
        reach: Reach,
        targets: &'b mut [i16],
        keys: &'b mut [K],
    ) -> Result<Self, Error> {
        reach.check()?;
        let targets = first_voxels(model, targets, Buffer::Targets)?;
        let keys = first_voxels(model, keys, Buffer::Keys)?;
        targets.fill(0);
        keys.fill(K::default());
        Ok(Self { model, reach, targets, keys })
    }

    /// Adds the mirror image of a point and its outward unit normal, both in voxels: it claims, with less weight, what
    /// no point claims that was measured there, whichever is added first.
    pub fn add_mirrored(&mut self, point: [f32; 3], normal: [f32; 3]) {
        self.add_point(point, normal, true);
    }

    /// Adds a point and its outward unit normal, both in voxels. Points more than 8 voxels outside the grid and normals
    /// whose length is off by more than one per cent are left out.
    pub fn add(&mut self, point: [f32; 3], normal: [f32; 3]) {
        self.add_point(point, normal, false);
    }

    #[inline(never)]
    fn add_point(&mut self, point: [f32; 3], normal: [f32; 3], mirrored: bool) {
        let squared_length = normal.iter().map(|n| n * n).sum::<f32>();
        let inside = point
            .iter()
            .zip(self.model.grid().sides())
            .all(|(&p, side)| p > -8.0 && p < f32::from(side) + 8.0);
        if !inside || !((0.98..1.02).contains(&squared_length)) {
            return;
        }
        let point = point.map(|p| libm::floorf(p * PER_VOXEL + 0.5) as i32);
        let normal = normal.map(|n| libm::floorf(n * (1 << NORMAL_BITS) as f32 + 0.5) as i32);
        let [xs, ys, zs] = self.ranges(point, normal);
        let sight = Sight { point, normal, farthest: self.farthest(normal), mirrored };
        let (model, edge) = (self.model, u16::from(self.model.grid().brick()).max(1));
        for z in parts(zs, edge) {
            for y in parts(ys, edge) {
                for x in parts(xs, edge) {
                    if let Some(rows) = model.rows_at([x.0, y.0, z.0]) {
                        self.add_brick(&sight, rows, [x, y, z]);
                    }
                }
            }
        }
    }

    /// A row passes the point's normal at no less than its offset along n × e_x. The square of that offset times
    /// |n × e_x|, 1/65536 voxel², beyond which nothing in a row is in reach; below 2²¹.
    fn farthest(&self, [_, ny, nz]: [i32; 3]) -> i32 {
        let length = i64::from((ny * ny + nz * nz) >> NORMAL_BITS) + 1;
        let reach = i64::from(self.reach.lateral) + 2;
        ((reach * reach * length) >> NORMAL_BITS) as i32
    }

    /// Voxel ranges that the reach of a point covers, cut at the grid.
    fn ranges(&self, point: [i32; 3], normal: [i32; 3]) -> [(u16, u16); 3] {
        let front = i32::from(self.reach.front);
        let lateral = i32::from(self.reach.lateral);
        let mut ranges = [(0, 0); 3];
        let axes = point.iter().zip(normal).zip(self.model.grid().sides());
        for (range, ((&p, n), side)) in ranges.iter_mut().zip(axes) {
            let (ahead, back) = ((n * front) >> NORMAL_BITS, (-n * front) >> NORMAL_BITS);
            let low = p + ahead.min(back) - lateral;
            let high = p + ahead.max(back) + lateral;
            let cut = |v: i32| v.clamp(0, i32::from(side)) as u16;
            *range = (cut((low + 255) >> DISTANCE_BITS), cut((high >> DISTANCE_BITS) + 1));
        }
        ranges
    }

    /// Lets a point claim the voxels it reaches in one brick. Most voxels of its box are out of reach: distance and
    /// squared offset are carried along the rows.
    #[inline(never)]
    fn add_brick(&mut self, sight: &Sight, rows: BrickRows<'_>, [xs, ys, zs]: [(u16, u16); 3]) {
        let offset = |v: u16, p: i32| (i32::from(v) << DISTANCE_BITS) - p;
        let ([px, py, pz], [nx, ny, nz]) = (sight.point, sight.normal);
        let first = offset(xs.0, px);
        for z in zs.0..zs.1 {
            let oz = offset(z, pz);
            for y in ys.0..ys.1 {
                let oy = offset(y, py);
                // Most rows of the box miss the normal; at most 12 voxels either way, so the square fits.
                let across = (oy * nz - oz * ny) >> NORMAL_BITS;
                if across * across > sight.farthest {
                    continue;
                }
                let Some((index, stored)) = rows.starting_at([xs.0, y, z]) else { continue };
                let along = oy * ny + oz * nz + first * nx;
                let line = Line { x: first, along, growth: nx, across: oy * oy + oz * oz };
                let stored = u32::from(stored) & ((1 << ((xs.1 - xs.0) & 15)) - 1);
                self.add_row(sight.mirrored, line, index, stored);
            }
        }
    }

    /// Lets a point claim the voxels it reaches in one row of a brick: a bit of `stored` for each of them that is, of which
    /// the first has the number `index`.
    #[inline(always)]
    fn add_row(&mut self, mirrored: bool, line: Line, mut index: usize, mut stored: u32) {
        let Line { mut x, mut along, growth, across } = line;
        let (front, lateral) = (i32::from(self.reach.front), i32::from(self.reach.lateral));
        while stored != 0 {
            let distance = round_shift(along, NORMAL_BITS);
            let squared = across + x * x;
            if stored & 1 != 0 {
                if distance.abs() <= front && squared - distance * distance <= lateral * lateral {
                    self.claim(mirrored, index, distance, squared);
                }
                index += 1;
            }
            stored >>= 1;
            x += 1 << DISTANCE_BITS;
            along += growth << DISTANCE_BITS;
        }
    }

    #[inline(always)]
    fn claim(&mut self, mirrored: bool, index: usize, distance: i32, squared: i32) {
        let new_key = key(squared, mirrored);
        let (Some(target), Some(key)) = (self.targets.get_mut(index), self.keys.get_mut(index)) else {
            return;
        };
        // Most voxels are claimed by a nearer point already.
        let old_key = key.load();
        if old_key != 0 && old_key < new_key {
            return;
        }
        let order = |distance: i32| (distance.abs(), distance);
        if old_key == new_key && order(distance) >= order(i32::from(Target(*target).distance())) {
            return;
        }
        // Behind the surface a voxel is claimed as far as in front, so that a sheet farther off cannot claim it,
        // but only the first ones have a weight: a line of sight ends at the surface.
        let full = if mirrored { mirror::WEIGHT } else { FULL_WEIGHT };
        let weight = if distance >= -i32::from(self.reach.behind) { full } else { UNWEIGHTED };
        *key = K::store(new_key);
        *target = Target::new(distance, weight).0;
    }

    /// The hull of all points added, and the keys' memory. Of mirror images nothing is left where they bring less
    /// than [`mirror::LEAST_SHARE`].
    pub fn finish(self) -> (Hull<'b>, &'b mut [K]) {
        let count = |weight| self.targets.iter().filter(|&&t| Target(t).weight() == weight).count() as u32;
        let (measured, mirrored) = (count(FULL_WEIGHT), count(mirror::WEIGHT));
        let few = u64::from(mirrored) * 100 < u64::from(measured) * u64::from(mirror::LEAST_SHARE);
        if mirrored > 0 && few {
            let images = self.targets.iter_mut().filter(|t| Target(**t).weight() == mirror::WEIGHT);
            images.for_each(|target| *target = 0);
        }
        (Hull::new(self.targets), self.keys)
    }
}

/// A point with its normal.
struct Sight {
    /// 1/256 voxel.
    point: [i32; 3],
    /// 1/4096.
    normal: [i32; 3],
    /// Farthest that a row in reach passes the normal, see [`HullBuilder::farthest`].
    farthest: i32,
    /// Whether the point is a mirror image.
    mirrored: bool,
}

/// The first voxel of a row, seen from a point.
struct Line {
    /// Its offset along the row, 1/256 voxel.
    x: i32,
    /// Its offset along the normal, 1/2^20 voxel.
    along: i32,
    /// How that grows along the row: the normal's x, 1/4096.
    growth: i32,
    /// Square of the offset across the row, 1/65536 voxel².
    across: i32,
}

/// Key of a point at a squared distance, 1/65536 voxel²; never 0.
#[inline(always)]
fn key(squared: i32, mirrored: bool) -> u16 {
    if mirrored {
        MIRRORED_KEY + (squared >> 8).clamp(0, i32::from(u16::MAX - MIRRORED_KEY)) as u16
    } else {
        (squared >> KEY_SHIFT).clamp(0, i32::from(MIRRORED_KEY) - 2) as u16 + 1
    }
}

/// The parts of a range of voxels that lie in one brick each.
fn parts((from, to): (u16, u16), edge: u16) -> impl Iterator<Item = (u16, u16)> {
    let mut from = from;
    core::iter::from_fn(move || {
        let end = (from - from.checked_rem(edge)? + edge).min(to);
        let part = (from < to).then_some((from, end));
        from = end;
        part
    })
}

impl<'b> Hull<'b> {
    /// A hull from one [`Target`] a stored voxel.
    pub fn new(targets: &'b [i16]) -> Self {
        let (mut count, mut weight) = (0, 0);
        for &target in targets {
            let w = Target(target).weight();
            count += u32::from(w != 0);
            weight += w as u32;
        }
        Self { targets, count, weight }
    }

    /// The target of a stored voxel.
    #[inline(always)]
    pub fn target(&self, voxel: usize) -> Target {
        Target(self.targets.get(voxel).copied().unwrap_or(0))
    }

    /// CRC-32 of the targets.
    pub fn digest(&self) -> u32 {
        digest(self.targets.iter().map(|t| t.to_le_bytes()))
    }
}

fn first_voxels<'b, T>(model: &Model<'_>, buffer: &'b mut [T], name: Buffer) -> Result<&'b mut [T], Error> {
    crate::workspace::first(buffer, model.voxels(), name)
}
