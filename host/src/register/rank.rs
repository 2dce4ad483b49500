//! Poses compared by what they explain.

use super::Placed;
use super::field::Field;
use crate::mesh::Point;
use lacuna::Pose;

/// A refined pose.
#[derive(Clone, Debug)]
pub struct Scored {
    /// From the centred scan to voxels.
    pub pose: Pose,
    /// Share of inliers times the root of the scale: shrinking must not pay, and growing must not outweigh what it loses.
    pub explained: f64,
    /// Share of the points that lie on the fitted surface and face its way.
    pub inliers: f64,
    /// Weights of the shape found with it, standard deviations.
    pub shape: Vec<f32>,
}

/// A pose that explains so much, when the next best explains at most so much of that, needs no longer search.
const CONVINCING: [f64; 2] = [0.8, 0.8];
/// Whether the best of the poses explains enough, and enough more than the next one.
pub fn convincing(field: &Field, ranked: &[Scored]) -> bool {
    let best = ranked.first().map_or(0.0, |best| best.inliers);
    best >= CONVINCING[0] && next_best(field, ranked) <= CONVINCING[1] * best
}

/// What the best pose other than the first explains, as a share of inliers at the first one's scale; 0 without any.
pub fn next_best(field: &Field, ranked: &[Scored]) -> f64 {
    let Some(best) = ranked.first() else { return 0.0 };
    let other = ranked.iter().find(|other| apart(field, &best.pose, &other.pose));
    other.map_or(0.0, |other| other.explained / best.explained * best.inliers)
}

/// Whether two poses differ by more than ten degrees, or move the surface by more than fifteen class millimetres.
fn apart(field: &Field, a: &Pose, b: &Pose) -> bool {
    let entries = a.rotation.as_flattened().iter().zip(b.rotation.as_flattened());
    let trace: f32 = entries.map(|(x, y)| x * y).sum();
    let [a, b] = [a, b].map(|pose| Placed { centre: Point::origin(), pose: *pose });
    let moved = |q: &Point| (b.to_model(&a.to_scan(q)) - q).norm();
    let points = &field.samples.points;
    let mean = points.iter().map(moved).sum::<f64>() / points.len().max(1) as f64;
    (trace - 1.0) / 2.0 < 10f32.to_radians().cos() || mean > 15.0 * field.millimetre
}
