//! Pose and shape estimated together: one Gauss-Newton over seven pose unknowns and K weights.
//!
//! Alternating them lets the pose absorb what the model cannot explain. For a scan point p with
//! q = s R p + t, all in voxels:
//!
//! ```text
//! Φ = M + b'·v,  g = ∇Φ,  γ = max(|g|, 0.3),  r = Φ / γ,  n = g / γ,  q~ = q - mean(q)
//! w   = 1 / (1 + (r / c)²)   where q is on the support and |r| < max(15 mm, 2 c), else 0
//! row = [ b'(q) / γ | q~ × n | n | q~·n - r ]      the last entry is the residual in scan units: it stops
//!                                                   the shrinking
//! (Jᵀ W J + diag(λ I, 0) + 10⁻⁶ Σw) x = -(Jᵀ W r + [λ v; 0]),   λ = 0.001 N mm²
//! ```
//!
//! Each run of [`PATCH`] points, neighbours if the cloud is in the order of a space-filling curve, is explained by
//! weights of its own around those of the whole ([`crate::patch`]), which are eliminated at once.
//!
//! A tied pose has a prior as the weights have one: σ is how far the training shapes' own poses lay apart.
//!
//! Steps are limited to 0.15 rad, 5 % and 8 mm. The rigid iterations use the far field where the band is
//! not stored. Rows are integers ([`crate::pose_row`]) and their products exact sums ([`crate::columns`]); the rest is
//! f32 through libm in a fixed order, and f64 in the solve: the same bits on every processor.

use crate::arithmetic::MAX_WEIGHT;
use crate::cholesky::solve;
use crate::cloud::Cloud;
use crate::columns::{Column, clear_from, products, set_row};
use crate::error::{Buffer, Error, OptionName};
use crate::model::Model;
use crate::packed::packed;
use crate::patch::eliminate_own_weights;
use crate::pose::{Pose, dot, zip};
use crate::pose_row::{EXTRA, MOST_ENTRIES, Rows};
use crate::progress::Progress;
use crate::workspace::first;
use core::ops::Range;
use serde::{Deserialize, Serialize};

pub use crate::columns::PATCH;
pub use crate::hint::Hint;

/// λ of the weights for each of the N points, class millimetres squared.
pub const RIDGE: f64 = 1e-3;
/// δ of a patch's own weights around those of the whole, likewise: they may differ by as much as shapes do.
pub const OWN_RIDGE: f64 = 1e-3;
/// Pose unknowns: turn, shift, growth.
pub const POSE: usize = 7;
/// Added to the diagonal, times the sum of the robust weights: keeps a plane or a ball from having no solution.
pub const DAMPING: f64 = 1e-6;
/// The same for a growth that is held.
const HOLD: f64 = 1e12;
/// Fewest points that can hold seven unknowns.
pub const FEWEST_POINTS: usize = 16;

/// Iterations of one kind.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Round {
    /// How many.
    pub iterations: u16,
    /// Most points used, at least [`FEWEST_POINTS`]: what a later round refines may be rough.
    pub points: usize,
    /// Misfit scale c, class millimetres, 0.001 to 1000.
    pub misfit: f32,
    /// Whether the scale may change.
    pub growth: bool,
    /// Whether the weights are estimated too.
    pub shape: bool,
    /// Whether patches then have weights of their own: a part of a shape tells more of the rest that way; a whole shape
    /// is approximated better without.
    pub own: bool,
    /// Whether the pose is tied to the one the fit began with, by the model's [`Jitter`](crate::format::Jitter).
    pub tied: bool,
}

impl Round {
    /// Whether the fit can do this.
    fn check(&self) -> Result<(), Error> {
        if self.points < FEWEST_POINTS {
            return Err(Error::TooFewPoints { given: self.points as u32 });
        }
        let usable = (1e-3..=1e3).contains(&self.misfit);
        if usable { Ok(()) } else { Err(Error::Option(OptionName::Misfit)) }
    }
}

/// Joint with half of the points.
const HALF: Round =
    Round { iterations: 4, points: 800, misfit: 2.5, growth: true, shape: true, own: true, tied: false };
/// Joint with all of them.
const ALL: Round = Round { points: usize::MAX, ..HALF };

/// Rigid, with scale, joint with half of the points, then with all.
pub const ROUNDS: [Round; 4] = [
    Round { iterations: 4, points: 400, misfit: 16.0, growth: false, shape: false, own: false, tied: false },
    Round { iterations: 3, points: 400, misfit: 8.0, growth: true, shape: false, own: false, tied: false },
    HALF,
    ALL,
];

/// Joint only: for a pose that was refined before.
pub const SETTLED: [Round; 2] = [HALF, ALL];

/// Joint only: for a pose that is exact in the frame the training shapes were given in.
pub const EXACT: [Round; 2] = [Round { tied: true, ..HALF }, Round { tied: true, ..ALL }];

/// Memory of a pose fit; by default, none.
#[derive(Debug, Default)]
pub struct PoseBuffers<'b> {
    /// [`sums_len`] elements.
    pub normal: &'b mut [f64],
    /// [`sums_len`] elements.
    pub chunk: &'b mut [f32],
    /// [`columns_len`] columns: the rows of a patch of points, transposed.
    pub columns: &'b mut [Column],
    /// Weights v, one a mode, standard deviations.
    pub weights: &'b mut [f32],
}

impl PoseBuffers<'_> {
    /// The same memory, lent on for a while.
    pub const fn reborrow(&mut self) -> PoseBuffers<'_> {
        PoseBuffers { normal: self.normal, chunk: self.chunk, columns: self.columns, weights: self.weights }
    }
}

/// Elements of `normal` and of `chunk`.
pub const fn sums_len(modes: usize) -> usize {
    packed(modes + POSE) + modes + POSE
}

/// Elements of `columns`.
pub const fn columns_len(modes: usize) -> usize {
    modes + EXTRA
}

/// How well the points lie on the model.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Agreement {
    /// Sum of the robust weights w.
    pub weight: f32,
    /// Sum of w r², voxel².
    pub squared: f32,
    /// Points on the support, near enough to the surface to count.
    pub on_support: u32,
}

/// Number of the `i`-th of `count` points that are evenly taken from `all`. Rounds have at least `FEWEST_POINTS`, so that
/// nothing is divided by zero.
fn picked(i: usize, count: usize, all: usize) -> usize {
    match i.checked_mul(all) {
        Some(product) => product.checked_div(count).unwrap_or(0),
        // On a processor of 32 bits; wide divisions are slow there.
        None => (i as u64).saturating_mul(all as u64).checked_div(count as u64).unwrap_or(0) as usize,
    }
}

/// A pose fit under way.
#[derive(Debug)]
pub struct PoseFit<'a, 'b> {
    model: &'a Model<'a>,
    rows: Rows<'a>,
    cloud: Cloud<'a>,
    /// Points used.
    count: usize,
    rounds: &'a [Round],
    buffers: PoseBuffers<'b>,
    pose: Pose,
    /// Turn, shift and growth since the beginning.
    moved: [f32; POSE],
    mean: [f32; 3],
    round: usize,
    iteration: u16,
    next: usize,
    running: Agreement,
    agreement: Agreement,
    done: u32,
}

impl<'a, 'b> PoseFit<'a, 'b> {
    /// Prepares the fit of at most `count` points, evenly taken from `cloud`, from a rough `pose`. The weights
    /// start at zero.
    ///
    /// # Errors
    /// Too few points, a pose that is none, rounds out of range, or a buffer too small.
    pub fn new(
        model: &'a Model<'a>,
        cloud: Cloud<'a>,
        count: usize,
        pose: Pose,
        rounds: &'a [Round],
        buffers: PoseBuffers<'b>,
    ) -> Result<Self, Error> {
        if cloud.len().min(count) < FEWEST_POINTS {
            return Err(Error::TooFewPoints { given: cloud.len().min(count) as u32 });
        }
        if !pose.is_valid() {
            return Err(Error::Pose);
        }
        rounds.iter().try_for_each(Round::check)?;
        let modes = model.modes();
        let buffers = PoseBuffers {
            normal: first(buffers.normal, sums_len(modes), Buffer::PoseNormal)?,
            chunk: first(buffers.chunk, sums_len(modes), Buffer::PoseChunk)?,
            columns: first(buffers.columns, columns_len(modes), Buffer::PoseColumns)?,
            weights: first(buffers.weights, modes, Buffer::PoseWeights)?,
        };
        buffers.weights.fill(0.0);
        buffers.normal.fill(0.0);
        let count = count.min(cloud.len());
        let points = (0..count).filter_map(|i| cloud.point(picked(i, count, cloud.len())));
        let sum = points.fold([0.0; 3], |sum, (p, _)| zip(sum, p, |a, b| a + b));
        let mean = sum.map(|s| s / count as f32);
        let agreement = Agreement::default();
        Ok(Self {
            model,
            rows: Rows::new(model),
            cloud,
            count,
            rounds,
            buffers,
            pose,
            moved: [0.0; POSE],
            mean,
            round: 0,
            iteration: 0,
            next: 0,
            running: agreement,
            agreement,
            done: 0,
        })
    }

    /// A patch of points, or the solve after the last one; `None` when done.
    pub fn step(&mut self) -> Option<Progress> {
        while self.rounds.get(self.round).is_some_and(|round| self.iteration >= round.iterations) {
            (self.round, self.iteration) = (self.round + 1, 0);
        }
        let round = *self.rounds.get(self.round)?;
        let count = self.points(&round);
        if self.next == 0 {
            self.rows.set(&round, self.pose.apply(self.mean), self.buffers.weights);
        }
        if self.next < count {
            let end = (self.next + PATCH).min(count);
            self.add_patch(self.next..end, &round);
            self.next = end;
        } else {
            self.solve(&round);
            (self.next, self.iteration) = (0, self.iteration + 1);
            self.agreement = core::mem::take(&mut self.running);
            self.buffers.normal.fill(0.0);
        }
        self.done = self.done.saturating_add(1);
        let steps = |round: &Round| usize::from(round.iterations) * (self.points(round).div_ceil(PATCH) + 1);
        let total: usize = self.rounds.iter().map(steps).sum();
        Some(Progress { done: self.done, total: total as u32 })
    }

    /// Runs to the end; see [`PoseFit::finish`].
    pub fn run(mut self) -> (Pose, Agreement, &'b [f32]) {
        while self.step().is_some() {}
        self.finish()
    }

    /// Pose, agreement and weights (standard deviations) of a fit whose steps are done.
    pub fn finish(self) -> (Pose, Agreement, &'b [f32]) {
        (self.pose, self.agreement, self.buffers.weights)
    }

    /// Points used in a round.
    fn points(&self, round: &Round) -> usize {
        self.count.min(round.points)
    }

    /// Adds the points of a patch, less what weights of its own explain.
    fn add_patch(&mut self, points: Range<usize>, round: &Round) {
        self.fill_columns(points, self.points(round));
        let modes = if round.shape { self.model.modes() } else { 0 };
        let columns = self.buffers.columns.get(..self.rows.entries()).unwrap_or(&[]);
        products(columns, &self.rows.units(), self.buffers.chunk);
        // Without the shape there is nothing to differ from.
        if round.shape && round.own {
            let own = ridge(OWN_RIDGE, self.points(round), self.model) as f32;
            eliminate_own_weights(self.buffers.chunk, modes, modes + POSE, own);
        }
        // In the rigid rounds only the first sums are used, and adding in double precision is dear where it is soft.
        for (sum, &part) in
            self.buffers.normal.iter_mut().zip(self.buffers.chunk.iter()).take(sums_len(modes))
        {
            *sum += f64::from(part);
        }
    }

    /// Fills the columns with the rows of points.
    fn fill_columns(&mut self, points: Range<usize>, count: usize) {
        let columns = self.buffers.columns.get_mut(..self.rows.entries()).unwrap_or_default();
        let (mut row, mut cube, mut filled) = ([0; MOST_ENTRIES], self.rows.cube(), 0);
        for index in points {
            let Some((point, _)) = self.cloud.point(picked(index, count, self.cloud.len())) else { continue };
            let Some((residual, weight)) = self.rows.fill(self.pose.apply(point), &mut cube, &mut row) else {
                continue;
            };
            set_row(columns, filled, &row);
            self.running.weight += weight;
            self.running.squared += weight * residual * residual;
            self.running.on_support += 1;
            filled += 1;
        }
        clear_from(columns, filled);
    }

    fn solve(&mut self, round: &Round) {
        let modes = if round.shape { self.model.modes() } else { 0 };
        let unknowns = modes + POSE;
        let total = f64::from(self.running.weight);
        if self.running.on_support < FEWEST_POINTS as u32 || total <= 0.0 {
            return;
        }
        let prior = ridge(RIDGE, self.points(round), self.model);
        let Some((matrix, rest)) = self.buffers.normal.split_at_mut_checked(packed(unknowns)) else { return };
        let Some(vector) = rest.get_mut(..unknowns) else { return };
        let ties = ties(self.model, round);
        let shape = self.buffers.weights.iter().take(modes).map(|&weight| (1.0, weight));
        for (i, (tie, value)) in shape.chain(ties.into_iter().zip(self.moved)).enumerate() {
            let ridge = prior * tie;
            let held = if i + 1 == unknowns && !round.growth { HOLD * total } else { 0.0 };
            if let (Some(diagonal), Some(sum)) = (matrix.get_mut(packed(i) + i), vector.get_mut(i)) {
                *diagonal += ridge + held + DAMPING * total;
                *sum = -(*sum + ridge * f64::from(value));
            }
        }
        solve(matrix, vector);
        let (shape, motion) = vector.split_at(modes.min(vector.len()));
        for (weight, &change) in self.buffers.weights.iter_mut().zip(shape) {
            *weight = (*weight + change as f32).clamp(-MAX_WEIGHT as f32, MAX_WEIGHT as f32);
        }
        let &[a, b, c, x, y, z, growth] = motion else { return };
        let limit = 8.0 * self.model.header().scales.millimetre;
        let omega = limited([a, b, c].map(|v| v as f32), 0.15);
        let shift = limited([x, y, z].map(|v| v as f32), limit);
        let growth = (growth as f32).clamp(-0.05, 0.05);
        let step = omega.into_iter().chain(shift).chain([growth]);
        self.moved.iter_mut().zip(step).for_each(|(moved, step)| *moved += step);
        self.pose = self.pose.moved(self.pose.apply(self.mean), omega, growth, shift);
    }
}

/// How firmly turn, shift and growth are tied to the beginning, each in units of the weights' prior: 1 / σ².
fn ties(model: &Model<'_>, round: &Round) -> [f64; POSE] {
    let Some(jitter) = model.jitter().filter(|_| round.tied) else { return [0.0; POSE] };
    let [turn, shift, growth] = [jitter.turn, jitter.shift, jitter.growth]
        .map(|spread| 1.0 / (f64::from(spread) * f64::from(spread)));
    [turn, turn, turn, shift, shift, shift, growth]
}

/// A ridge given for each of `count` points in class millimetres squared, in voxels squared.
pub fn ridge(ridge: f64, count: usize, model: &Model<'_>) -> f64 {
    let millimetre = f64::from(model.header().scales.millimetre);
    ridge * count as f64 * millimetre * millimetre
}

/// The vector, shortened to `limit`.
fn limited(v: [f32; 3], limit: f32) -> [f32; 3] {
    let length = libm::sqrtf(dot(v, v));
    if length > limit { v.map(|c| c * limit / length) } else { v }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_are_taken_evenly_however_many_there_are() {
        assert!((0..10).map(|i| picked(i, 10, 10)).eq(0..10));
        assert!((0..4).map(|i| picked(i, 4, 10)).eq([0, 2, 5, 7]));
        // The product is more than a usize holds.
        assert!(picked(3, 4, usize::MAX) < usize::MAX);
        assert_eq!(picked(0, 0, 10), 0);
    }
}
