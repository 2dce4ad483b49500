//! Where the fits have a surface.
//!
//! Sums of modes are no distances: away from every training shape they may hardly grow on the way outward, fall again
//! and be negative, an island that no shape has and that [`largest_component`](crate::surface::largest_component) drops
//! from the surface of either fit. A change of the distances by less than a voxel ([`level`](mod@super::level),
//! [`diffusion`](super::diffusion)) bridges the flat gap, and the completed surface has the island and the bridge. So where
//! nothing was measured no surface is much farther outside than what is seen of the fits:
//!
//! ```text
//! Φ ← max(Φ, d - f),    f = FAR max(1, (SURE / σ)²)
//! ```
//!
//! d being the distance from the nearest of their surfaces and σ the deviation of Φ that the scan leaves. What the class is
//! sure of may be lost by both fits for being thin (the tip of an ear); where it is unsure of more than the width in which
//! [`level`](mod@super::level) looks for a volume, that volume is no evidence.

use super::dense::Dense;
use crate::distance::Surface;
use crate::mesh::{Mesh, Point, Vector};
use crate::register::Placed;
use rayon::prelude::*;

/// How far outside of the fits surface may be that was not measured, class millimetres. (4, 6, 8 everywhere, without: largest
/// error of a vertebra whose fits have an island 10.7, 11.3, 11.8, 28.4 mm, 9.4 being the global fit's own; missing part of
/// another one, whose process the fits end too early, 0.604, 0.574, 0.560, 0.558 mm; of a face from the side, whose ear they
/// lose, 2.31, 2.11, 1.98, 1.81 mm: hence the next constant.)
const FAR: f64 = 8.0;
/// Deviation below which it may be farther, class millimetres. (Where they are six and more outside of both fits, tips of ears of
/// nine scans have 2.2 at most and are up to 20 outside; beyond ten, a rod that is no part of a vertebra has 3.0 to 6.8.)
const SURE: f64 = 3.3;
/// Distances beyond this make no surface, voxels.
const APART: f32 = 2.0;

/// The surfaces of the fits, each its largest piece.
pub struct Support {
    surfaces: Vec<Surface>,
}

impl Support {
    /// That of meshes; those without triangles have none.
    pub fn of(meshes: [&Mesh; 2]) -> Self {
        Self { surfaces: meshes.into_iter().filter_map(Surface::new).collect() }
    }

    /// How far outside of the nearest of them a place is, at most `limit`, in their unit, negative inside of one; none where
    /// one ends there, or without any.
    pub fn outside(&self, place: &Point, limit: f64) -> Option<f64> {
        self.surfaces.first()?;
        let outside = |surface: &Surface| match surface.distance(place, limit) {
            Some(found) => (!found.on_border).then_some(found.value),
            None => Some(limit),
        };
        self.surfaces.iter().map(outside).try_fold(limit, |least, outside| Some(least.min(outside?)))
    }

    /// Takes from distances what lies too far outside. `deviations` are those of the distances, NaN where unknown; `measured`
    /// tells the voxels that stay; `millimetre` is a class millimetre in voxels.
    pub fn limit(
        &self,
        field: &mut Dense,
        deviations: &[f32],
        measured: &[bool],
        placed: &Placed,
        millimetre: f64,
    ) {
        let scale = f64::from(placed.pose.scale);
        let limited = |i: usize| {
            let far = farthest(f64::from(deviations[i]) / millimetre) * millimetre;
            let place = Point::from(Vector::from(field.voxel(i).map(|v| v as f64)));
            let outside = self.outside(&placed.to_scan(&place), (far + f64::from(APART)) / scale)?;
            let least = (outside * scale - far) as f32;
            (field.values[i] < least).then_some((i, least))
        };
        let near = |&i: &usize| field.values[i] < APART && !measured[i];
        let near: Vec<usize> = (0..field.values.len()).filter(near).collect();
        let limited: Vec<(usize, f32)> = near.into_par_iter().filter_map(limited).collect();
        limited.into_iter().for_each(|(i, least)| field.values[i] = least);
    }
}

/// How far outside surface may be where the distance has a deviation, NaN if it is unknown, class millimetres.
fn farthest(deviation: f64) -> f64 {
    let sure = (SURE / deviation).max(1.0);
    FAR * sure * sure
}

#[cfg(test)]
mod tests {
    use super::super::level::level;
    use super::super::zero_level;
    use super::*;
    use lacuna::Pose;

    const N: usize = 40;
    const MILLIMETRE: f64 = 0.3;
    const PLACED: Placed = Placed { centre: Point::new(0.0, 0.0, 0.0), pose: Pose::IDENTITY };

    /// A peg along x up to 16, an island from 23 on, and between them distances of a fifth of a voxel.
    fn peg_and_island() -> Dense {
        let along = |x: f32| match x {
            x if x < 6.0 => 6.0 - x,
            x if x < 10.0 => 0.0,
            x if x < 22.0 => ((x - 10.0) * 0.5).min(3.2),
            x if x < 27.0 => (3.2 - (x - 22.0) * 0.5).max(1.0),
            x => (x - 29.0).max(1.0),
        };
        let value = |[x, y, z]: [f32; 3]| libm::hypotf(y - 20.0, z - 20.0) - 3.0 + along(x);
        let values = (0..N * N * N).map(|i| value(crate::raster::voxel([N; 3], i).map(|v| v as f32)));
        Dense { sides: [N; 3], values: values.collect() }
    }

    /// Largest x of the surface.
    fn end(surface: &Mesh) -> f64 {
        surface.points.iter().map(|p| p.x).fold(0.0, f64::max)
    }

    /// Where the surface ends that was cut at the level of the expected volume, and limited where the distances have this
    /// deviation.
    fn ends(deviation: f32, measured: bool) -> f64 {
        let mut field = peg_and_island();
        let seen = zero_level::surface(&field, &PLACED, 1);
        assert!((14.0..17.0).contains(&end(&seen)), "{}", end(&seen));
        level(&mut field, &[1.9; N * N * N], &[false; N * N * N]);
        assert!(end(&zero_level::surface(&field, &PLACED, 1)) > 25.0, "bridged");
        let support = Support::of([&seen, &Mesh::default()]);
        support.limit(&mut field, &[deviation; N * N * N], &[measured; N * N * N], &PLACED, MILLIMETRE);
        end(&zero_level::surface(&field, &PLACED, 1))
    }

    #[test]
    fn a_bridge_to_an_island_ends_near_what_is_seen_of_the_fit() {
        let unsure = ends(1.9, false);
        assert!((15.0..19.5).contains(&unsure), "{unsure}");
    }

    #[test]
    fn what_was_measured_and_what_the_class_is_sure_of_stays() {
        assert!(ends(1.9, true) > 25.0);
        assert!(ends(0.45, false) > 25.0);
    }

    #[test]
    fn where_a_surface_ends_and_without_one_nothing_is_told() {
        let sheet = crate::surface::shapes::sheet(9);
        let support = Support::of([&sheet, &Mesh::default()]);
        let outside = |x: f64, z: f64| support.outside(&Point::new(x, 4.2, z), 5.0);
        assert_eq!(
            [(3.4, 2.0), (3.4, -2.0), (3.4, 7.0)].map(|(x, z)| outside(x, z)),
            [2.0, -2.0, 5.0].map(Some)
        );
        assert_eq!(outside(9.0, 1.0), None);
        assert_eq!(Support::of([&Mesh::default(); 2]).outside(&Point::origin(), 5.0), None);
    }

    #[test]
    fn surface_may_be_farther_where_the_class_is_surer() {
        assert_eq!([f64::INFINITY, f64::NAN, 7.0, SURE].map(farthest), [FAR; 4]);
        assert_eq!(farthest(0.5 * SURE), 4.0 * FAR);
        assert_eq!(farthest(0.0), f64::INFINITY);
    }
}
