//! What a scan leaves undecided: the joint covariance of the weights and the pose.
//!
//! The fit of pose and shape ([`lacuna::pose_fit`]) is a ridge regression. With a row a = [ b'(q) / γ | motion ] for
//! each of the scan's points, the posterior of its K + 7 unknowns is
//!
//! ```text
//! C = λ (Aᵀ W A + diag(λ I, 0))⁻¹,     λ = the pose fit's
//! ```
//!
//! λ is the variance at which a residual weighs as much as a standard deviation of shape: what the modes cannot explain.
//! Without any data C is the prior: the weights' unit variance. The deviation of the surface at a place with the
//! row a, along its normal, is √(aᵀ C a). Neighbouring points share what the modes cannot explain; as in the pose
//! fit, each run of [`PATCH`] points has weights of its own around those of the whole ([`lacuna::patch`]).

use crate::points::OrientedPoints;
use lacuna::completion::POSE_POINTS;
use lacuna::normal_sums::add_row;
use lacuna::patch::eliminate_own_weights;
use lacuna::pose_fit::{OWN_RIDGE, PATCH, POSE, RIDGE, ROUNDS, Round, fill_row, ridge, sums_len};
use lacuna::{Model, Pose};
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use rayon::prelude::*;

/// The posterior of weights and pose.
pub struct Posterior<'a> {
    model: &'a Model<'a>,
    weights: &'a [f32],
    /// Turns are about this point, voxels.
    centre: [f32; 3],
    /// Whether the pose was estimated.
    posed: bool,
    ridge: f64,
    factor: Cholesky<f64, Dyn>,
}

impl<'a> Posterior<'a> {
    /// The posterior after a scan whose points (centred, neighbours next to each other) lie in `pose`; `posed` if
    /// the pose was estimated from them. `weights` are those of the fit. `None` where no point is on the model.
    pub fn new(
        model: &'a Model<'a>,
        points: &OrientedPoints,
        pose: &Pose,
        weights: &'a [f32],
        posed: bool,
    ) -> Option<Self> {
        let count = points.points.len().min(POSE_POINTS);
        let place = |i: usize| {
            let p = points.points[i * points.points.len() / count];
            pose.apply(p.coords.map(|c| c as f32).into())
        };
        let places: Vec<[f32; 3]> = (0..count).map(place).collect();
        let sum = places.iter().fold([0.0f64; 3], |sum, p| std::array::from_fn(|a| sum[a] + f64::from(p[a])));
        let centre = sum.map(|s| (s / count.max(1) as f64) as f32);
        let unknowns = model.modes() + if posed { POSE } else { 0 };
        let rows = Rows { model, weights, centre, unknowns };
        let own = ridge(OWN_RIDGE, count, model) as f32;
        let (mut matrix, mut total) = (DMatrix::zeros(unknowns, unknowns), 0.0);
        for patch in places.chunks(PATCH) {
            total += rows.add_patch(patch, own, &mut matrix);
        }
        let ridge = ridge(RIDGE, count, model);
        for i in 0..unknowns {
            matrix[(i, i)] += if i < model.modes() { ridge } else { 1e-6 * total };
        }
        let factor = Cholesky::new(matrix)?;
        (ridge > 0.0).then_some(Self { model, weights, centre, posed, ridge, factor })
    }

    /// Deviation of the surface along its normal at a place on or near it, voxels; `None` where the model stores
    /// nothing.
    pub fn at(&self, q: [f32; 3]) -> Option<f32> {
        let unknowns = self.model.modes() + if self.posed { POSE } else { 0 };
        let rows = Rows { model: self.model, weights: self.weights, centre: self.centre, unknowns };
        let (row, _) = rows.at(q)?;
        let row = DVector::from_iterator(unknowns, row.into_iter().map(f64::from));
        let solved = self.factor.l_dirty().solve_lower_triangular(&row)?;
        Some((self.ridge.sqrt() * solved.norm()) as f32)
    }

    /// Deviation of the turn about the axis that is determined least, radians; `None` where the pose was not estimated.
    pub fn turn(&self) -> Option<f64> {
        let modes = self.model.modes();
        let mut turns = DMatrix::zeros(modes + POSE, 3);
        (0..3).for_each(|axis| turns[(modes + axis, axis)] = 1.0);
        let solved = self.posed.then(|| self.factor.solve(&turns))?;
        let turns = solved.fixed_view::<3, 3>(modes, 0) * self.ridge;
        Some(turns.symmetric_eigenvalues().max().max(0.0).sqrt())
    }

    /// The model.
    pub const fn model(&self) -> &Model<'a> {
        self.model
    }

    /// [`Self::at`] for many places.
    pub fn at_all(&self, places: &[[f32; 3]]) -> Vec<Option<f32>> {
        places.par_iter().with_min_len(256).map(|&q| self.at(q)).collect()
    }
}

/// Makes rows of the regression.
struct Rows<'a> {
    model: &'a Model<'a>,
    weights: &'a [f32],
    centre: [f32; 3],
    unknowns: usize,
}

impl Rows<'_> {
    /// Row and robust weight of a place.
    fn at(&self, q: [f32; 3]) -> Option<(Vec<f32>, f32)> {
        const ROUND: Round = ROUNDS[ROUNDS.len() - 1];
        let mut row = vec![0.0; self.model.modes() + POSE];
        let (_, weight) = fill_row(self.model, q, self.centre, &ROUND, self.weights, &mut row)?;
        row.truncate(self.unknowns);
        Some((row, weight))
    }

    /// Adds the points of a patch less what its own weights explain: their weight.
    fn add_patch(&self, patch: &[[f32; 3]], own: f32, matrix: &mut DMatrix<f64>) -> f64 {
        let (mut sums, mut total) = (vec![0.0; sums_len(self.model.modes())], 0.0);
        for (row, weight) in patch.iter().filter_map(|&q| self.at(q)) {
            add_row(&mut sums, &row, 0.0, weight);
            total += f64::from(weight);
        }
        eliminate_own_weights(&mut sums, self.model.modes(), self.unknowns, own);
        let mut sums = sums.into_iter();
        for i in 0..self.unknowns {
            for (j, sum) in sums.by_ref().take(i + 1).enumerate() {
                matrix[(i, j)] += f64::from(sum);
            }
        }
        total
    }
}
