//! How well a scan determines its own pose: the spread of the turns that explain it about as well.
//!
//! The pose fit minimises Σ w (r + row·x)² + λ |v|² over the pose unknowns and the weights v of the shape, λ = 0.001 Σw
//! mm² ([`lacuna::pose_fit`]). As λ is the variance at which a residual weighs as much as a standard deviation of
//! shape, the posterior's covariance is
//!
//! ```text
//! C = λ (JᵀWJ - Σ s sᵀ / (Σw + κ) + diag(λ I, 0))⁻¹
//! ```
//!
//! with the patches' offsets eliminated as there, and the turn's part of it is what is left when shift, growth and
//! shape are free: a shaft seen without its ends may be turned about its axis by as much as its shape varies.

use lacuna::{Cloud, Model, Pose, Standing, sample};
use nalgebra::{DMatrix, DVector, Vector3};

/// Points taken.
const POINTS: usize = 2048;
/// Neighbouring points that share an offset, and its prior, as in the pose fit.
const PATCH: usize = 32;
const OFFSET_PRIOR: f64 = 1.0;
/// Unknowns of the pose: turn, shift, growth.
const POSE: usize = 7;

/// Standard deviations of what a scan determines.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Spread {
    /// Of the turn about the axis that is determined least, degrees.
    pub turn: f64,
    /// Of the surface along its normal, in the frame of the scan, class millimetres: exceeded by a twentieth of
    /// the shape.
    pub surface: f64,
}

/// What the scan determines; none if too little of it lies on the surface. Neighbours in the cloud are neighbours
/// in space.
pub fn spread(model: &Model<'_>, cloud: Cloud<'_>, pose: &Pose, shape: &[f32]) -> Option<Spread> {
    let modes = model.modes();
    let count = cloud.len().min(POINTS);
    let points: Vec<([f32; 3], [f32; 3])> =
        (0..count).filter_map(|i| cloud.point(i * cloud.len() / count)).collect();
    let placed: Vec<[f32; 3]> = points.iter().map(|(p, _)| pose.apply(*p)).collect();
    let centre = placed.iter().fold(Vector3::zeros(), |sum, &q| sum + Vector3::from(q).cast::<f64>());
    let centre = centre / count.max(1) as f64;
    let inlier =
        |i: usize| Standing::of(model, placed[i], pose.rotate(points[i].1), shape) == Standing::Inlier;
    let unknowns = modes + POSE;
    let (mut information, mut total) = (DMatrix::<f64>::zeros(unknowns, unknowns), 0.0);
    for start in (0..placed.len()).step_by(PATCH) {
        let patch = start..(start + PATCH).min(placed.len());
        let rows: Vec<DVector<f64>> =
            patch.filter(|&i| inlier(i)).filter_map(|i| row(model, placed[i], &centre, shape)).collect();
        let mut sum = DVector::zeros(unknowns);
        for row in &rows {
            information.syger(1.0, row, row, 1.0);
            sum += row;
        }
        information.syger(-1.0 / (rows.len() as f64 + OFFSET_PRIOR), &sum, &sum, 1.0);
        total += rows.len() as f64;
    }
    let variance = 1e-3 * total * f64::from(model.header().scales.millimetre).powi(2);
    for i in 0..unknowns {
        information[(i, i)] += if i < modes { variance } else { 0.0 } + 1e-6 * total;
    }
    let covariance = information.cholesky()?.inverse() * variance;
    let turns = covariance.fixed_view::<3, 3>(modes, modes).into_owned();
    let turn = turns.symmetric_eigenvalues().max().max(0.0).sqrt().to_degrees();
    let millimetre = f64::from(model.header().scales.millimetre);
    let deviation = |q: [f32; 3]| {
        let row = row(model, q, &centre, shape)?;
        Some(row.dot(&(&covariance * &row)).max(0.0).sqrt() / millimetre)
    };
    let mut deviations: Vec<f64> = surface(model).into_iter().filter_map(deviation).collect();
    let last = deviations.len().checked_sub(1)?;
    let (_, &mut surface, _) = deviations.select_nth_unstable_by(last * 19 / 20, f64::total_cmp);
    Some(Spread { turn, surface }).filter(|spread| spread.turn.is_finite() && spread.surface.is_finite())
}

/// Every fourth voxel at the mean surface.
fn surface(model: &Model<'_>) -> Vec<[f32; 3]> {
    let mut places = Vec::new();
    for brick in model.bricks() {
        let edge = brick.edge();
        for (y, z) in (0..edge).flat_map(|z| (0..edge).map(move |y| (y, z))) {
            let row = brick.row(y, z);
            let near = |&x: &u8| row.voxel(x).is_some_and(|voxel| brick.mean(voxel).abs() < 128);
            places.extend((0..edge).filter(near).map(|x| {
                let [cx, cy, cz] = brick.corner.map(f32::from);
                [cx + f32::from(x), cy + f32::from(y), cz + f32::from(z)]
            }));
        }
    }
    places.into_iter().step_by(4).collect()
}

/// [b'(q) / γ | q~ × n | n | q~·n - r] of a point, as in the pose fit.
fn row(model: &Model<'_>, q: [f32; 3], centre: &Vector3<f64>, shape: &[f32]) -> Option<DVector<f64>> {
    let modes = model.modes();
    let mut basis = vec![0.0f32; modes];
    let (distance, gradient) = sample::band(model, q, shape, Some(&mut basis))?;
    let gradient = Vector3::from(gradient).cast::<f64>();
    let steepness = gradient.norm().max(0.3);
    let (normal, arm) = (gradient / steepness, Vector3::from(q).cast::<f64>() - centre);
    let turn = arm.cross(&normal);
    let growth = arm.dot(&normal) - f64::from(distance) / steepness;
    let motion = turn.iter().chain(normal.iter()).copied().chain([growth]);
    let values = basis.iter().map(|&b| f64::from(b) / steepness).chain(motion);
    Some(DVector::from_iterator(modes + POSE, values))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::points::OrientedPoints;
    use crate::verify::Case;
    use lacuna::completion::Settings;
    use lacuna::pose_fit::ROUNDS;
    use lacuna::{Fixed, Reach, Schedule, schedule};

    #[test]
    fn less_of_a_scan_determines_less() {
        let case = Case::small().unwrap();
        let model = Model::from_bytes(&case.model).unwrap();
        let schedule = Schedule { stride: model.header().stride, momentum: 0, passes: &schedule::DEFAULT };
        let settings = Settings { reach: Reach::of(&model), rounds: &ROUNDS, schedule };
        let found = |points: OrientedPoints| {
            let points = points.along_curve().packed();
            let fit = crate::fit::fit::<Fixed>(&model, &points, &case.pose, settings).unwrap();
            spread(&model, points.cloud().unwrap(), &fit.outcome.pose, &fit.shape).unwrap()
        };
        let mut heights: Vec<f64> = case.points.points.iter().map(|p| p.y).collect();
        heights.sort_by(f64::total_cmp);
        let upper = |i: &usize| case.points.points[*i].y > heights[heights.len() * 2 / 3];
        let kept: Vec<usize> = (0..heights.len()).filter(upper).collect();
        let third = OrientedPoints {
            points: kept.iter().map(|&i| case.points.points[i]).collect(),
            normals: kept.iter().map(|&i| case.points.normals[i]).collect(),
        };
        let (whole, third) = (found(case.points.clone()), found(third));
        assert!(third.turn > 1.2 * whole.turn && third.surface > 1.2 * whole.surface, "{whole:?} {third:?}");
        assert!(whole.turn > 0.01 && third.surface < 20.0, "{whole:?} {third:?}");
    }
}
