//! What of the measured surface stands out of the shapes that the class can take: a swelling, a strap, a hand that lies on it.
//! The local fit follows it, and it counts as measured; only the global fit tells. And what of the inferred surface stands out
//! of either fit.

use super::dense::Dense;
use super::merge::{MEASURED, Merged};
use super::support::Support;
use crate::mesh::Mesh;
use crate::register::Placed;
use crate::surface::components;
use lacuna::pose_row::steepness;
use rayon::prelude::*;
use serde::Serialize;

/// What lies farther outside the global fit than this stands out, class millimetres.
const OUT: f64 = 5.0;
/// Inferred surface that lies farther outside both fits than this is invented, class millimetres. (Nine scans of faces and two
/// models: beyond it there is 121 square class millimetres of an ear in one of the 18, nothing in the others; of a rod that was
/// no part of a vertebra 2093, up to 63 outside.)
const INVENTED: f64 = 14.0;
/// Times that which is looked for.
const HIGHEST: f64 = 10.0;
/// Area of a patch that is nothing to talk about, square class millimetres: twenty whole faces 273 at most, their ears, with 30
/// training shapes; nine bumps of 10 to 20 mm on cheeks 11 to 311 (five, partly left out as clutter) and 411 to 1192.
const LITTLE: f64 = 320.0;
/// Of a class that was learned from fewer shapes than this, more stands out of what it can take: two whole femurs 513 and 631,
/// with 8 shapes.
const MANY: f64 = 20.0;

/// The largest patch that stands out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Outgrowth {
    /// Its area.
    pub area: f64,
    /// How far at most: of measured surface along the normal of the global fit, of inferred from the nearest of both fits.
    pub height: f64,
    /// Largest area that is nothing to talk about.
    pub little: f64,
}

impl Outgrowth {
    /// What stands out of a completed mesh, in its unit. `global` is the global fit of a class that was learned from `shapes`;
    /// `millimetre` is a class millimetre in the mesh's unit.
    pub fn of(merged: &Merged, global: &Dense, placed: &Placed, millimetre: f64, shapes: u32) -> Self {
        let scale = f64::from(placed.pose.scale);
        let height = |v: usize| {
            let (distance, gradient) = global.at(&placed.to_model(&merged.mesh.points[v]))?;
            Some(distance / f64::from(steepness(gradient.map(|c| c as f32).into())) / scale)
        };
        let measured = |v: usize| merged.labels[v] == MEASURED;
        let largest = Self::largest(merged, OUT * millimetre, |v| if measured(v) { height(v) } else { None });
        let few = f64::max(1.0, MANY / f64::from(shapes.max(1)));
        Self { little: few * LITTLE * millimetre * millimetre, ..largest }
    }

    /// What nobody measured and neither fit has.
    pub fn invented(merged: &Merged, support: &Support, millimetre: f64) -> Self {
        let least = INVENTED * millimetre;
        let inferred = |v: usize| merged.labels[v] != MEASURED;
        // Of what is so high it does not matter how much higher it is.
        let height = |v: usize| support.outside(&merged.mesh.points[v], HIGHEST * least);
        let largest = Self::largest(merged, least, |v| if inferred(v) { height(v) } else { None });
        Self { little: LITTLE * millimetre * millimetre, ..largest }
    }

    /// The largest patch of a mesh whose vertices are higher than `least`.
    fn largest(merged: &Merged, least: f64, height: impl Fn(usize) -> Option<f64> + Sync) -> Self {
        let heights = (0..merged.labels.len()).into_par_iter().map(|v| height(v).unwrap_or(0.0));
        let heights: Vec<f64> = heights.collect();
        let out = |corners: &&[u32; 3]| corners.iter().all(|&v| heights[v as usize] > least);
        let triangles = merged.mesh.triangles.iter().filter(out).copied().collect();
        let mesh = Mesh { triangles, points: merged.mesh.points.clone(), normals: vec![] };
        let mut patches: Vec<Self> = Vec::new();
        for (t, patch) in components(&mesh).into_iter().enumerate() {
            patches.resize(patches.len().max(patch as usize + 1), Self::default());
            let Self { area, height, .. } = &mut patches[patch as usize];
            *area += mesh.area_of(t);
            *height = mesh.triangles[t].iter().map(|&v| heights[v as usize]).fold(*height, f64::max);
        }
        patches.into_iter().max_by(|a, b| a.area.total_cmp(&b.area)).unwrap_or_default()
    }

    /// Whether it is so much that the scan shows something that the class has not.
    pub fn is_large(&self) -> bool {
        self.area > self.little
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Point, Vector};
    use crate::surface::shapes::ball;
    use lacuna::Pose;

    #[test]
    fn a_bump_on_a_ball_stands_out_where_it_was_measured() {
        let sides = [40; 3];
        let middle = Point::new(20.0, 20.0, 20.0);
        let place = |i: usize| Point::from(crate::raster::voxel(sides, i).map(|v| v as f64));
        let values = (0..64000).map(|i| ((place(i) - middle).norm() - 10.0) as f32).collect();
        let global = Dense { sides, values };
        let mesh = ball(40, 10.0);
        let centre =
            mesh.points.iter().fold(Vector::zeros(), |sum, p| sum + p.coords) / mesh.points.len() as f64;
        // A cap, and a smaller one opposite.
        let lifted = |p: &Point| {
            let away = (p.coords - centre).normalize();
            middle + away * if away.z > 0.9 || away.z < -0.93 { 17.0 } else { 10.5 }
        };
        let points: Vec<Point> = mesh.points.iter().map(lifted).collect();
        let count = points.len();
        let merged = |label: u8| Merged {
            mesh: Mesh { points: points.clone(), ..mesh.clone() },
            labels: vec![label; count],
            ..Merged::default()
        };
        let placed = Placed { centre: Point::origin(), pose: Pose::IDENTITY };
        let of =
            |label, millimetre, shapes| Outgrowth::of(&merged(label), &global, &placed, millimetre, shapes);
        let found = of(MEASURED, 1.0, 30);
        let cap = std::f64::consts::TAU * 17.0 * 17.0 * 0.1;
        assert!((found.height - 7.0).abs() < 0.2, "{found:?}");
        assert!((0.6..1.2).contains(&(found.area / cap)), "{found:?} of {cap}");
        let large = [(1.0, 30), (0.6, 30), (0.6, 8)].map(|(mm, shapes)| of(MEASURED, mm, shapes).is_large());
        assert_eq!(large, [false, true, false], "of a class of few shapes more stands out");
        assert_eq!(of(1 - MEASURED, 1.0, 30).area, 0.0);
    }

    #[test]
    fn what_was_inferred_far_from_both_fits_is_invented() {
        let ball = ball(40, 6.0);
        let support = Support::of([&ball, &Mesh::default()]);
        let lifted = |height: f64| {
            let points = ball.points.iter().map(|p| if p.z > 4.0 { p + Vector::z() * height } else { *p });
            Mesh { points: points.collect(), ..ball.clone() }
        };
        let merged = |height: f64, label: u8| Merged {
            mesh: lifted(height),
            labels: vec![label; ball.points.len()],
            ..Merged::default()
        };
        let millimetre = 0.3;
        let found = Outgrowth::invented(&merged(9.0, 1 - MEASURED), &support, millimetre);
        assert!(found.is_large() && (8.0..10.0).contains(&found.height), "{found:?}");
        for nothing in [merged(9.0, MEASURED), merged(3.0, 1 - MEASURED)] {
            assert_eq!(Outgrowth::invented(&nothing, &support, millimetre).area, 0.0);
        }
    }
}
