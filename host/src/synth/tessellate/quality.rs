//! What makes triangles good: flips by the angles in space, vertices in the middle of their neighbours.

use super::plane::{Side, Triangulation};
use crate::mesh::{Point, Vector};

/// Smallest area in the plane, as a part of the area it had before, that a move may leave.
const SHRINK: f64 = 0.2;

/// Whether the other diagonal is better: the angles opposite to this one sum to more than a
/// straight angle in space, and the other one is a diagonal in the plane too.
pub(super) fn wants_flip(plane: &Triangulation, side: Side) -> bool {
    let Some(other) = plane.across(side) else { return false };
    let ([a, b, c], [.., d]) = (plane.corners(side), plane.corners(other));
    let quad = plane.area([a, b, c]) + plane.area([b, a, d]);
    if plane.area([a, d, c]).min(plane.area([d, b, c])) <= 0.02 * quad {
        return false;
    }
    let [a, b, c, d] = [a, b, c, d].map(|v| plane.points[v as usize]);
    sine_of_sum(a, b, c, d) < -1e-9 && !folds(a, b, c, d)
}

/// Has the sign of the sine of the sum of the angles at `c` and `d`.
fn sine_of_sum(a: Point, b: Point, c: Point, d: Point) -> f64 {
    let angle = |p: Point| ((a - p).cross(&(b - p)).norm(), (a - p).dot(&(b - p)));
    let ((sin_c, cos_c), (sin_d, cos_d)) = (angle(c), angle(d));
    (sin_c * cos_d + cos_c * sin_d) / ((libm::hypot(sin_c, cos_c) * libm::hypot(sin_d, cos_d)).max(1e-300))
}

/// Whether the flip would bend the surface sharply where it was not bent before.
fn folds(a: Point, b: Point, c: Point, d: Point) -> bool {
    let unit = |p: Point, q: Point, r: Point| {
        (q - p).cross(&(r - p)).try_normalize(0.0).unwrap_or_else(Vector::zeros)
    };
    let before = unit(a, b, c).dot(&unit(b, a, d));
    let after = unit(a, d, c).dot(&unit(d, b, c));
    after < before.min(0.5)
}

/// Moves every vertex but the first `fixed` a part of the way to the mean of its neighbours,
/// weighted by the length of the edges in space, which pulls it to where the surface is stretched.
pub(super) fn smooth(plane: &mut Triangulation, fixed: usize, position: impl Fn([f64; 2]) -> Point) {
    let stars = stars(plane);
    for (v, star) in stars.iter().enumerate().skip(fixed) {
        let target = mean_of_neighbours(plane, v as u32, star);
        let old = plane.plane[v];
        let before: Vec<f64> = star.iter().map(|&t| plane.area(plane.triangles[t as usize])).collect();
        plane.plane[v] = [0, 1].map(|i| old[i] + 0.6 * (target[i] - old[i]));
        let area = |t: &u32| plane.area(plane.triangles[*t as usize]);
        if star.iter().zip(&before).all(|(t, old)| area(t) > SHRINK * old) {
            plane.points[v] = position(plane.plane[v]);
        } else {
            plane.plane[v] = old;
        }
    }
}

/// The triangles at each vertex.
fn stars(plane: &Triangulation) -> Vec<Vec<u32>> {
    let mut stars = vec![vec![]; plane.points.len()];
    for (triangle, t) in plane.triangles.iter().zip(0..) {
        triangle.iter().for_each(|&v| stars[v as usize].push(t));
    }
    stars
}

fn mean_of_neighbours(plane: &Triangulation, v: u32, star: &[u32]) -> [f64; 2] {
    let (mut sum, mut total) = ([0.0, 0.0], 0.0);
    for &t in star {
        for &other in plane.triangles[t as usize].iter().filter(|&&u| u != v) {
            let (weight, at) = (plane.length([v, other]), plane.plane[other as usize]);
            sum = [sum[0] + weight * at[0], sum[1] + weight * at[1]];
            total += weight;
        }
    }
    sum.map(|s| s / total)
}
