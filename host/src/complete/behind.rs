//! Where the scan lies deep behind the fitted surface, that follows: the scanner has looked through there, so nothing of the
//! shape can be in front of what it measured, however unusual that is for the class. (What lies in front of the surface may be
//! none of the class: hair, a collar.)
//!
//! The model stores no voxels so far from its shapes, and the fit knows nothing of such points. (Nor does anything of those so
//! far behind that the fitted distances do not go there, by five voxels beyond the stored ones.) Their depths d are the
//! deviations there; in front of them and beside them, along the surface, it is expected to be
//!
//! ```text
//! δ(x) = s(r) Σ wᵢ dᵢ / Σ wᵢ + (1 - s(r)) δ₀(x),    wᵢ = (1 - rᵢ / R)² / (rᵢ² + 1/4),    s(r) = (1 - r / R)² (1 + 2 r / R)
//! ```
//!
//! with rᵢ the distance from point i across its normal, r the least of them, and δ₀ the deviation as it was fitted.

use super::dense::Dense;
use crate::mesh::{Point, Vector};

/// The distance R, voxels.
const BESIDE: f64 = 8.0;
/// How far from the surfaces, the scan's and the fitted one, distances change, voxels.
const AROUND: f64 = 3.0;
/// A fit that is nearer to a point than this has followed it, voxels.
pub const FOLLOWED: f64 = 0.5;
/// Fewest deep points within [`TOGETHER`] of one, itself among them, that make it one of a surface and no stray.
const FEWEST: usize = 8;
/// How near such points are to each other, voxels.
const TOGETHER: f64 = 4.0;
/// A point is in front of a deep one if it is so near to the line from that along its normal, voxels, and farther along it than
/// [`HIDING`]: then the deep one is what was measured wrongly.
const OPENING: f64 = 1.5;
/// Way along that line, as a share of the depth.
const HIDING: f64 = 0.5;

/// A point of the scan behind the fitted surface, voxels.
pub struct Deep {
    /// Where it is.
    pub place: Point,
    /// The way that the scan faces there.
    normal: Vector,
    /// How far behind.
    depth: f64,
}

/// Those of the points, each with its normal, in voxels, that lie more than `deep` voxels behind the global fit, that the
/// local one has not followed, and that no other point is in front of.
pub fn deep_points([global, local]: [&Dense; 2], points: &[(Point, Vector)], deep: f64) -> Vec<Deep> {
    let found = |&(place, normal): &(Point, Vector)| {
        let (distance, gradient) = global.at(&place)?;
        let missed = local.at(&place).is_some_and(|(distance, _)| distance.abs() > FOLLOWED);
        let behind = -distance > deep && missed && gradient.dot(&normal) > 0.0;
        behind.then_some(Deep { place, normal, depth: -distance })
    };
    let hides = |deep: &Deep, (other, _): &(Point, Vector)| {
        let [along, across] = deep.offset(other);
        along > HIDING * deep.depth && across < OPENING
    };
    let mut found: Vec<Deep> = points.iter().filter_map(found).collect();
    found.retain(|deep| !points.iter().any(|other| hides(deep, other)));
    let beside = |a: &Deep, b: &Deep| (a.place - b.place).norm() <= TOGETHER;
    let counts: Vec<usize> = found.iter().map(|a| found.iter().filter(|b| beside(a, b)).count()).collect();
    let mut counts = counts.into_iter();
    found.retain(|_| counts.next().is_some_and(|count| count >= FEWEST));
    found
}

/// Sums over the points around a voxel.
#[derive(Clone, Copy)]
struct Sums {
    weights: f64,
    depths: f64,
    nearest: f64,
}

/// The voxels that the points tell of, and the deviations that are expected there; `deviations` are those that were fitted,
/// one a voxel of the grid.
pub fn drawn(grid: &Dense, deviations: &[f32], points: &[Deep]) -> Vec<(usize, f32)> {
    let mut around = vec![None; if points.is_empty() { 0 } else { deviations.len() }];
    for point in points {
        let reach = libm::hypot(BESIDE, point.depth + AROUND).ceil() as usize;
        grid.around(&point.place, reach).for_each(|(i, voxel)| point.tell(&voxel, &mut around[i]));
    }
    let draw = |(i, sums): (usize, Option<Sums>)| {
        let Sums { weights, depths, nearest } = sums?;
        let r = nearest / BESIDE;
        let share = (1.0 - r) * (1.0 - r) * (1.0 + 2.0 * r);
        let fitted = f64::from(deviations[i]);
        Some((i, (fitted + share * (depths / weights - fitted)) as f32))
    };
    around.into_iter().enumerate().filter_map(draw).collect()
}

impl Deep {
    /// How far a place is from the point along its normal, and across it.
    fn offset(&self, place: &Point) -> [f64; 2] {
        let offset = place - self.place;
        let along = offset.dot(&self.normal);
        [along, (offset - self.normal * along).norm()]
    }

    /// Adds what the point tells of a voxel.
    fn tell(&self, voxel: &Point, sums: &mut Option<Sums>) {
        let [along, across] = self.offset(voxel);
        if across >= BESIDE || !(-AROUND..self.depth + AROUND).contains(&along) {
            return;
        }
        let weight = (1.0 - across / BESIDE).powi(2) / (across * across + 0.25);
        let before = sums.unwrap_or(Sums { weights: 0.0, depths: 0.0, nearest: BESIDE });
        *sums = Some(Sums {
            weights: before.weights + weight,
            depths: before.depths + weight * self.depth,
            nearest: before.nearest.min(across),
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::complete::diffusion::diffuse;

    const N: usize = 40;
    const HEIGHT: f64 = 31.5;

    /// A plane that faces upwards.
    fn plane(height: f64) -> Dense {
        let values = (0..N * N * N).map(|i| (i / N / N) as f32 - height as f32).collect();
        Dense { sides: [N; 3], values }
    }

    /// A patch of 10 by 10 voxels in the middle, at a height.
    fn patch(height: f64, normal: f64) -> Vec<(Point, Vector)> {
        let place = |i: u32| Point::new(15.2 + f64::from(i % 10), 15.2 + f64::from(i / 10), height);
        (0..100).map(|i| (place(i), Vector::z() * normal)).collect()
    }

    fn found(points: Vec<(Point, Vector)>, local: &Dense) -> Vec<Deep> {
        deep_points([&plane(HEIGHT), local], &points, 1.2)
    }

    #[test]
    fn the_surface_goes_down_to_what_was_measured_and_up_again_beside_it() {
        let (global, mut local, own) = (plane(HEIGHT), plane(HEIGHT), plane(27.0));
        let points = patch(27.0, 1.0);
        let places: Vec<Point> = points.iter().map(|(place, _)| *place).collect();
        let measured =
            diffuse(&mut local, &global, &places, 2, &found(points, &global), |i| Some(own.values[i]));
        assert!(measured.iter().any(|&measured| measured));
        let crossings = |x: usize, y: usize| -> Vec<f32> {
            let at = |z: usize| local.values[(z * N + y) * N + x];
            let crosses = |&z: &usize| (at(z) < 0.0) != (at(z + 1) < 0.0);
            (0..N - 1).filter(crosses).map(|z| z as f32 + at(z) / (at(z) - at(z + 1))).collect()
        };
        let heights: Vec<f32> = (0..N)
            .map(|x| crossings(x, 20))
            .map(|of| {
                assert_eq!(of.len(), 1, "one surface: {of:?}");
                of[0]
            })
            .collect();
        assert!(heights[15..25].iter().all(|height| (height - 27.0).abs() < 0.1), "{heights:?}");
        assert!([3, 36].iter().all(|&x| (heights[x] - 31.5).abs() < 0.05), "{heights:?}");
        assert!(
            heights[24..36].is_sorted() && heights.windows(2).all(|w| (w[1] - w[0]).abs() < 1.0),
            "{heights:?}"
        );
    }

    #[test]
    fn what_is_not_behind_or_was_followed_or_is_a_stray_draws_nothing() {
        let unmoved = plane(HEIGHT);
        assert_eq!(found(patch(27.0, 1.0), &unmoved).len(), 100);
        assert_eq!(found(patch(27.0, -1.0), &unmoved).len(), 0, "it faces the other way");
        assert_eq!(found(patch(35.0, 1.0), &unmoved).len(), 0, "in front");
        assert_eq!(found(patch(31.0, 1.0), &unmoved).len(), 0, "hardly behind");
        assert_eq!(found(patch(27.0, 1.0), &plane(27.3)).len(), 0, "followed");
        assert_eq!(found(patch(27.0, 1.0)[..7].to_vec(), &unmoved).len(), 0, "strays");
        let hidden = [patch(27.0, 1.0), patch(31.4, 1.0)].concat();
        assert_eq!(found(hidden, &unmoved).len(), 0, "behind what was measured, too");
        let beside = patch(31.4, 1.0).into_iter().map(|(place, normal)| (place + Vector::x() * 12.0, normal));
        let both = patch(27.0, 1.0).into_iter().chain(beside).collect();
        assert_eq!(found(both, &unmoved).len(), 100, "beside what was measured, too");
        assert!(drawn(&unmoved, &vec![0.25; N * N * N], &[]).is_empty());
    }
}
