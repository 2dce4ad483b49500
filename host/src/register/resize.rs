//! A scene's pose, found again from other sizes: hair that lies close to a face, or a collar taken for its jaw, draws the size
//! of the face to its own, and a refinement ends near the size that it began with.

use super::field::Field;
use super::joint::near;
use super::rank::{Scored, hopeless, ranked};
use super::trim::settled;
use crate::mesh::{Point, Vector};
use crate::points::OrientedPoints;
use lacuna::{Model, Pose};
use rayon::prelude::*;

/// Growths of the scan from which the pose is refined again.
const GROWTHS: [f32; 4] = [0.8, 0.9, 1.1, 1.2];
/// Most rounds of growths; it ends sooner when a round finds no better pose.
const ROUNDS: usize = 4;

/// The refined poses of a scene, best first, with those found from other sizes of the best one.
pub fn resized(
    model: &Model<'_>,
    field: &Field,
    points: &OrientedPoints,
    mut finals: Vec<Scored>,
) -> Vec<Scored> {
    for _ in 0..ROUNDS {
        let Some(best) = finals.first().filter(|best| best.is_among_clutter() && !hopeless(best)) else {
            break;
        };
        let (pose, explained) = (best.pose, best.explained);
        let middle = middle(points, &near(field, points, &pose));
        let other = |&growth: &f32| settled(model, field, points, grown(&pose, &middle, growth)).ok();
        finals.extend(GROWTHS.par_iter().filter_map(other).collect::<Vec<_>>());
        finals = ranked(finals);
        if finals[0].explained <= explained {
            break;
        }
    }
    finals
}

/// The mean of some of the points.
fn middle(points: &OrientedPoints, chosen: &[usize]) -> Point {
    let sum = chosen.iter().fold(Vector::zeros(), |sum, &i| sum + points.points[i].coords);
    Point::from(sum / chosen.len().max(1) as f64)
}

/// The pose in which the scan is so many times as large, `middle` where it was.
fn grown(pose: &Pose, middle: &Point, growth: f32) -> Pose {
    let middle = pose.apply(middle.coords.map(|c| c as f32).into());
    let moved = |axis: usize| middle[axis] + (pose.translation[axis] - middle[axis]) * growth;
    Pose { scale: pose.scale * growth, translation: [0, 1, 2].map(moved), ..*pose }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scan_grows_about_the_middle_of_what_lies_near() {
        let pose = Pose {
            scale: 0.5,
            translation: [3.0, -2.0, 8.0],
            rotation: [[0., 1., 0.], [0., 0., 1.], [1., 0., 0.]],
        };
        let middle = Point::new(10.0, 20.0, 30.0);
        let bigger = grown(&pose, &middle, 1.2);
        let at = |pose: &Pose, p: [f32; 3]| Vector::from(pose.apply(p).map(f64::from));
        let centre = at(&pose, [10.0, 20.0, 30.0]);
        assert!((at(&bigger, [10.0, 20.0, 30.0]) - centre).norm() < 1e-5);
        let arms = [pose, bigger].map(|pose| at(&pose, [11.0, 25.0, 28.0]) - centre);
        assert!((arms[1] - arms[0] * 1.2).norm() < 1e-5, "{arms:?}");
    }
}
