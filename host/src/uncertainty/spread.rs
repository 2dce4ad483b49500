//! How well a scan determines the pose and the shape at large: the spread of the turns and surfaces that explain it
//! about as well.
//!
//! A shaft seen without its ends may be turned about its axis by as much as its shape varies: the turn's part of the
//! posterior's covariance is what is left when shift, growth and shape are free.

use super::posterior::Posterior;
use lacuna::Model;

/// Standard deviations of what a scan determines.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Spread {
    /// Of the turn about the axis that is determined least, degrees.
    pub turn: f64,
    /// Of the surface along its normal, in the frame of the scan, class millimetres: exceeded by a twentieth of
    /// the shape.
    pub surface: f64,
}

/// What the scan determines; none where the pose was given, or nothing of the mean surface is stored.
pub fn spread(posterior: &Posterior<'_>) -> Option<Spread> {
    let model = posterior.model();
    let turn = posterior.turn()?.to_degrees();
    let mut deviations: Vec<f32> = posterior.at_all(&surface(model)).into_iter().flatten().collect();
    let last = deviations.len().checked_sub(1)?;
    let (_, &mut surface, _) = deviations.select_nth_unstable_by(last * 19 / 20, f32::total_cmp);
    let surface = f64::from(surface / model.header().scales.millimetre);
    Some(Spread { turn, surface }).filter(|spread| spread.turn.is_finite() && spread.surface.is_finite())
}

/// Every fourth voxel at the mean surface.
fn surface(model: &Model<'_>) -> Vec<[f32; 3]> {
    let mut places = Vec::new();
    for brick in model.bricks() {
        let near = brick.places().filter(|&(voxel, _)| brick.mean(voxel).unsigned_abs() < 128);
        places.extend(near.map(|(_, place)| place.map(f32::from)));
    }
    places.into_iter().step_by(4).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::points::OrientedPoints;
    use crate::verify::Case;
    use lacuna::completion::Settings;
    use lacuna::pose_fit::ROUNDS;
    use lacuna::{Fixed, Schedule};

    #[test]
    fn less_of_a_scan_determines_less() {
        let case = Case::small().unwrap();
        let model = Model::from_bytes(&case.model).unwrap();
        let schedule = Schedule::of(&model);
        let settings = Settings { rounds: &ROUNDS, schedule };
        let found = |points: OrientedPoints| {
            let points = points.along_curve();
            let fit = crate::fit::fit::<Fixed>(&model, &points.packed(), &case.pose, settings).unwrap();
            let posterior = Posterior::new(&model, &points, &fit.outcome.pose, &fit.shape, true).unwrap();
            spread(&posterior).unwrap()
        };
        let mut heights: Vec<f64> = case.points.points.iter().map(|p| p.y).collect();
        heights.sort_by(f64::total_cmp);
        let upper = |i: &usize| case.points.points[*i].y > heights[heights.len() * 2 / 3];
        let kept: Vec<usize> = (0..heights.len()).filter(upper).collect();
        let (whole, third) = (found(case.points.clone()), found(case.points.chosen(&kept)));
        assert!(third.turn > 1.2 * whole.turn && third.surface > 1.2 * whole.surface, "{whole:?} {third:?}");
        assert!(whole.turn > 0.01 && third.surface < 20.0, "{whole:?} {third:?}");
    }
}
