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

use crate::picks::evenly;
use crate::points::OrientedPoints;
use lacuna::columns::{products, set_row};
use lacuna::completion::POSE_POINTS;
use lacuna::cube::Cube;
use lacuna::patch::eliminate_own_weights;
use lacuna::pose_fit::{DAMPING, OWN_RIDGE, PATCH, POSE, RIDGE, ROUNDS, columns_len, ridge, sums_len};
use lacuna::pose_row::{MOST_ENTRIES, Rows, steepness};
use lacuna::{Model, Pose};
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use rayon::prelude::*;

/// The posterior of weights and pose.
pub struct Posterior<'a> {
    rows: Rows<'a>,
    /// Modes, and the pose's if it was estimated.
    unknowns: usize,
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
        weights: &[f32],
        posed: bool,
    ) -> Option<Self> {
        let place = |i: usize| pose.apply(points.points[i].coords.map(|c| c as f32).into());
        let places: Vec<[f32; 3]> = evenly(points.points.len(), POSE_POINTS).map(place).collect();
        let count = places.len();
        let sum = places.iter().fold([0.0f64; 3], |sum, p| std::array::from_fn(|a| sum[a] + f64::from(p[a])));
        let centre = sum.map(|s| (s / count.max(1) as f64) as f32);
        let unknowns = model.modes() + if posed { POSE } else { 0 };
        let mut rows = Rows::new(model);
        rows.set(&ROUNDS[ROUNDS.len() - 1], centre, weights);
        let own = ridge(OWN_RIDGE, count, model) as f32;
        let (mut matrix, mut total) = (DMatrix::zeros(unknowns, unknowns), 0.0);
        for patch in places.chunks(PATCH) {
            total += add_patch(&rows, patch, model.modes(), own, &mut matrix);
        }
        let ridge = ridge(RIDGE, count, model);
        for i in 0..unknowns {
            matrix[(i, i)] += if i < model.modes() { ridge } else { DAMPING * total };
        }
        let factor = Cholesky::new(matrix)?;
        (ridge > 0.0).then_some(Self { rows, unknowns, posed, ridge, factor })
    }

    /// Deviation of the surface along its normal at a place on or near it, voxels; `None` where the model stores
    /// nothing.
    pub fn at(&self, q: [f32; 3]) -> Option<f32> {
        self.with_cube(q).map(|(deviation, _)| deviation)
    }

    /// Deviation of the distance at a place, voxels: where the surface lies counts as much as the distance changes on
    /// the way.
    pub fn of_distance(&self, q: [f32; 3]) -> Option<f32> {
        let (deviation, mut cube) = self.with_cube(q)?;
        let (_, gradient) = cube.distance();
        Some(deviation * steepness(gradient))
    }

    /// [`Self::at`], and the cube around the place.
    fn with_cube(&self, q: [f32; 3]) -> Option<(f32, Cube<'_, '_>)> {
        let (mut row, mut cube) = ([0; MOST_ENTRIES], self.rows.cube());
        let (_, weight) = self.rows.fill(q, &mut cube, &mut row)?;
        let units = self.rows.units().map(|unit| f64::from(unit) / f64::from(weight).sqrt());
        let row = row.into_iter().zip(units).map(|(entry, unit)| f64::from(entry) * unit);
        let row = DVector::from_iterator(self.unknowns, row.take(self.unknowns));
        let solved = self.factor.l_dirty().solve_lower_triangular(&row)?;
        Some(((self.ridge.sqrt() * solved.norm()) as f32, cube))
    }

    /// Deviation of the turn about the axis that is determined least, radians; `None` where the pose was not estimated.
    pub fn turn(&self) -> Option<f64> {
        let modes = self.model().modes();
        let mut turns = DMatrix::zeros(modes + POSE, 3);
        (0..3).for_each(|axis| turns[(modes + axis, axis)] = 1.0);
        let solved = self.posed.then(|| self.factor.solve(&turns))?;
        let turns = solved.fixed_view::<3, 3>(modes, 0) * self.ridge;
        Some(turns.symmetric_eigenvalues().max().max(0.0).sqrt())
    }

    /// The model.
    pub const fn model(&self) -> &Model<'a> {
        self.rows.model()
    }

    /// [`Self::at`] for many places.
    pub fn at_all(&self, places: &[[f32; 3]]) -> Vec<Option<f32>> {
        places.par_iter().with_min_len(256).map(|&q| self.at(q)).collect()
    }
}

/// Adds the points of a patch less what its own weights explain: their weight. The matrix has one row a mode, and then
/// those of the pose if it was estimated.
fn add_patch(rows: &Rows<'_>, patch: &[[f32; 3]], modes: usize, own: f32, matrix: &mut DMatrix<f64>) -> f64 {
    let mut columns = vec![[0; PATCH]; columns_len(modes)];
    let (mut row, mut cube, mut count, mut total) = ([0; MOST_ENTRIES], rows.cube(), 0, 0.0);
    for &q in patch {
        if let Some((_, weight)) = rows.fill(q, &mut cube, &mut row) {
            set_row(&mut columns, count, &row);
            (count, total) = (count + 1, total + f64::from(weight));
        }
    }
    let mut sums = vec![0.0; sums_len(modes)];
    products(&columns, &rows.units(), &mut sums);
    eliminate_own_weights(&mut sums, modes, modes + POSE, own);
    let mut sums = sums.into_iter();
    for i in 0..matrix.nrows() {
        for (j, sum) in sums.by_ref().take(i + 1).enumerate() {
            matrix[(i, j)] += f64::from(sum);
        }
    }
    total
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raster;
    use crate::verify::{Case, decode};

    /// Deviations of the distances of stored voxels after `points`, with the voxels' numbers.
    fn deviations(case: &Case, model: &Model<'_>, points: &OrientedPoints) -> Vec<(usize, f64)> {
        let posterior =
            Posterior::new(model, points, &case.pose, &vec![0.0; model.modes()], false).expect("a posterior");
        let sides = model.grid().sides().map(usize::from);
        let stored = decode::model(model).mask;
        let place = |i: usize| raster::voxel(sides, i).map(|v| v as f32);
        // The last voxel of a row has no cube beside it.
        let known = |i: usize| Some((i, f64::from(posterior.of_distance(place(i))?)));
        (0..stored.len()).filter(|&i| stored[i]).filter_map(known).collect()
    }

    #[test]
    fn distances_deviate_as_the_modes_do_and_less_the_more_is_measured() {
        let case = Case::small().expect("a case");
        let model = Model::from_bytes(&case.model).expect("a model");
        let modes = decode::model(&model).whitened();
        let prior = |i: usize| modes.iter().map(|mode| mode[i] * mode[i]).sum::<f64>().sqrt();
        let one = OrientedPoints {
            points: case.points.points[..1].to_vec(),
            normals: case.points.normals[..1].to_vec(),
        };
        let (little, much) = (deviations(&case, &model, &one), deviations(&case, &model, &case.points));
        assert!(little.len() > 1000 && little.len() == much.len());
        let mean =
            |all: &[(usize, f64)]| all.iter().map(|&(i, d)| d / prior(i)).sum::<f64>() / all.len() as f64;
        // Rows are integers: a hundredth is their rounding.
        assert!(little.iter().all(|&(i, d)| d < 1.01 * prior(i) + 0.01));
        assert!(mean(&little) > 0.8 && mean(&much) < 0.5, "{} {}", mean(&little), mean(&much));
    }
}
