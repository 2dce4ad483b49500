//! Signed distances of a training shape that may itself be a scan, with holes and folds: a hull along the lines
//! of sight (Curless & Levoy 1996, CL96 in the paper), and from there on along FH04's sources.
//!
//! Each point claims the voxels along its normal, up to the reach on both sides and one voxel sideways. The nearest
//! point wins and gives the distance to its tangent plane. An unknown voxel takes the point of its source in
//! the hull: size is the distance to that point, but for a voxel sideways, sign that of the source. (The root of
//! [`propagate`](super::propagate)'s cost is down to 1/√2 of the distance beyond a hull of this thickness.)
//!
//! Where a mesh cuts itself, a part of it shows its front to the inside or its back to the outside, and its signs
//! would reach far. Such points are known by the winding number in front of them, which differs by one from that
//! of all others, and are left out: no scanner sees them.

use super::propagate::{NO_SOURCE, sources};
use crate::bvh::Bvh;
use crate::mesh::{Mesh, Point, Vector, twice_area_vector};
use crate::points::{OrientedPoints, thin};
use crate::volume::{Lattice, Volume};
use rayon::prelude::*;

/// Edge of the cubes of the thinned points, voxels: with 1 some voxels near the surface are in nobody's reach and
/// wrong by 0.3, with 0.7 none is wrong by more than 0.13 (a ball of radius 12.5 voxels).
const PITCH: f64 = 0.7;

/// A point that differs more from the median winding number is hidden. Folds differ by one; the rim of an open
/// sheet differs by a quarter.
const HIDDEN: f64 = 0.7;

/// Crossings after which a ray is given up.
const CROSSINGS: usize = 100;

/// The lines of sight of a shape.
#[derive(Clone, Debug)]
pub struct Sights {
    seen: OrientedPoints,
    reach: f64,
}

/// What is known of each voxel of a lattice.
struct Hull {
    /// Signed distances in voxels, NaN where no line of sight passes.
    distances: Vec<f32>,
    /// The points they are measured from.
    claims: Vec<u32>,
}

/// Distances at `places` of the lattice: [`Sights::new`] and [`Sights::sample`] with the lattice's spacing.
pub fn sample(mesh: &Mesh, lattice: &Lattice, places: &[u32], reach: f64) -> Volume {
    Sights::new(mesh, lattice.spacing, reach).sample(lattice, places)
}

impl Sights {
    /// Lines of sight of a mesh or an oriented cloud, more than one a `spacing`, that reach `reach` to both sides;
    /// both in the mesh's unit.
    pub fn new(mesh: &Mesh, spacing: f64, reach: f64) -> Self {
        let seen = visible(mesh, thin(mesh, PITCH * spacing), spacing / 2.0);
        Self { seen, reach }
    }

    /// Signed distances at `places` of the lattice, in the mesh's unit.
    ///
    /// A voxel is on the border if no line of sight passes it and it lies aside from the normal of the point it
    /// is measured from: by more than one voxel, and one more for every reach of distance. That is beyond the
    /// rim, not far in front of the surface. Without any point all voxels are on the border, at the length of
    /// the lattice's diagonal.
    pub fn sample(&self, lattice: &Lattice, places: &[u32]) -> Volume {
        let hull = self.hull(lattice);
        let nearest = sources(&hull.distances, lattice.sides);
        let at = |&place: &u32| self.value(lattice, &hull, place as usize, nearest[place as usize]);
        let (distances, border) = places.par_iter().with_min_len(1024).map(at).unzip();
        Volume { distances, border }
    }

    fn value(&self, lattice: &Lattice, hull: &Hull, place: usize, source: u32) -> (f32, bool) {
        if source == NO_SOURCE {
            let diagonal = Vector::from(lattice.sides.map(|side| side as f64)).norm() * lattice.spacing;
            return (diagonal as f32, true);
        }
        let known = hull.distances[source as usize];
        if source as usize == place {
            return ((f64::from(known) * lattice.spacing) as f32, false);
        }
        let claim = hull.claims[source as usize] as usize;
        let offset = lattice.point(lattice.voxel(place)) - self.seen.points[claim];
        let (size, aside) = (offset.norm(), offset.cross(&self.seen.normals[claim]).norm());
        // One voxel aside is the gap between two lines of sight, not a part of the distance.
        let distance = (size * size - aside.min(lattice.spacing).powi(2)).max(0.0).sqrt();
        (distance.copysign(f64::from(known)) as f32, aside > lattice.spacing * (1.0 + size / self.reach))
    }

    fn hull(&self, lattice: &Lattice) -> Hull {
        let voxels = lattice.len();
        let mut hull = Hull { distances: vec![f32::NAN; voxels], claims: vec![0; voxels] };
        let mut nearest = vec![f32::INFINITY; voxels];
        let reach = self.reach / lattice.spacing;
        for (claim, (point, normal)) in self.seen.points.iter().zip(&self.seen.normals).enumerate() {
            let point = (point - lattice.origin) / lattice.spacing;
            each_reached(&point, normal, reach, lattice, |place, along, squared| {
                // Points come in a fixed order: of two equally near ones the first wins.
                if (squared as f32) < nearest[place] {
                    nearest[place] = squared as f32;
                    hull.distances[place] = along as f32;
                    hull.claims[place] = claim as u32;
                }
            });
        }
        hull
    }
}

/// Shows `found` the voxels along a normal: place, distance to the tangent plane, squared distance to the point;
/// all lengths in voxels.
fn each_reached(
    point: &Vector,
    normal: &Vector,
    reach: f64,
    lattice: &Lattice,
    mut found: impl FnMut(usize, f64, f64),
) {
    let extent = normal.map(|n| n.abs() * reach + 1.0);
    let range = |axis: usize| {
        let end = lattice.sides[axis] as f64;
        let (low, high) = (point[axis] - extent[axis], point[axis] + extent[axis]);
        low.ceil().clamp(0.0, end) as usize..(high.floor() + 1.0).clamp(0.0, end) as usize
    };
    for z in range(2) {
        for y in range(1) {
            for x in range(0) {
                let offset = Vector::new(x as f64, y as f64, z as f64) - point;
                let (along, squared) = (offset.dot(normal), offset.norm_squared());
                if along.abs() <= reach && squared - along * along <= 1.0 {
                    found(lattice.index([x, y, z]), along, squared);
                }
            }
        }
    }
}

/// The points in front of which the winding number is as for most others.
fn visible(mesh: &Mesh, points: OrientedPoints, ahead: f64) -> OrientedPoints {
    if mesh.triangles.is_empty() || points.points.is_empty() {
        return points;
    }
    let bvh = Bvh::new(mesh);
    let directions = directions();
    let front = |(point, normal): (&Point, &Vector)| {
        let origin = point + normal * ahead;
        directions.iter().map(|direction| crossings(mesh, &bvh, origin, direction)).sum::<f64>()
            / directions.len() as f64
    };
    let levels: Vec<f64> = points.points.par_iter().zip(&points.normals).map(front).collect();
    let mut sorted = levels.clone();
    let (_, &mut median, _) = sorted.select_nth_unstable_by(levels.len() / 2, f64::total_cmp);
    let all = points.points.into_iter().zip(points.normals).zip(levels);
    let seen = all.filter(|(_, level)| (level - median).abs() < HIDDEN);
    let (points, normals) = seen.map(|(point, _)| point).unzip();
    OrientedPoints { points, normals }
}

/// Surfaces a ray leaves less those it enters: one inside a closed mesh.
fn crossings(mesh: &Mesh, bvh: &Bvh, mut origin: Point, direction: &Vector) -> f64 {
    let mut sum = 0.0;
    for _ in 0..CROSSINGS {
        let Some((t, triangle)) = bvh.cast(&origin, direction, f64::INFINITY) else { break };
        let [a, b, c] = mesh.corners(triangle as usize);
        sum += twice_area_vector(&[a, b, c]).dot(direction).signum();
        let size = (b - a).norm() + (c - a).norm();
        origin += direction * (t + 1e-6 * size);
    }
    sum
}

/// Corners of an icosahedron, turned so that none lies along an axis, where meshes made by hand have edges.
fn directions() -> [Vector; 12] {
    let golden = (1.0 + libm::sqrt(5.0)) / 2.0;
    let turn = nalgebra::Rotation3::from_euler_angles(0.1, 0.2, 0.3);
    std::array::from_fn(|i| {
        let sign = |bit: usize| if i & bit == 0 { 1.0 } else { -1.0 };
        let (short, long) = (sign(1), sign(2) * golden);
        let corner =
            [Vector::new(0.0, short, long), Vector::new(short, long, 0.0), Vector::new(long, 0.0, short)];
        (turn * corner[i / 4]).normalize()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{PI, TAU};

    /// A grid of 81 by 81 vertices at `at(u, v)`, u and v from 0 to 1; u to the right, v ahead, seen from above.
    fn grid(at: impl Fn(f64, f64) -> [f64; 3]) -> Mesh {
        let points = (0..6561).map(|i| Point::from(at(f64::from(i % 81) / 80.0, f64::from(i / 81) / 80.0)));
        let corners = (0..6480_u32).filter(|i| i % 81 < 80);
        let triangles = corners.flat_map(|i| [[i, i + 1, i + 82], [i, i + 82, i + 81]]).collect();
        Mesh { points: points.collect(), normals: vec![], triangles }
    }

    /// What is found in a cube of 40³ voxels of 2 mm around the origin.
    fn everywhere(mesh: &Mesh) -> Vec<(Point, f64, bool)> {
        let lattice = Lattice { origin: Point::new(-39.0, -39.0, -39.0), spacing: 2.0, sides: [40; 3] };
        let places: Vec<u32> = (0..lattice.len() as u32).collect();
        let volume = sample(mesh, &lattice, &places, 7.0);
        let point = |i| lattice.point(lattice.voxel(i));
        (0..lattice.len()).map(|i| (point(i), f64::from(volume.distances[i]), volume.border[i])).collect()
    }

    #[test]
    fn a_ball_has_its_distances() {
        let ball = grid(|u, v| {
            let (ring, height) = (libm::sin(PI * v) * 25.0, -25.0 * libm::cos(PI * v));
            [ring * libm::cos(TAU * u), ring * libm::sin(TAU * u), height]
        });
        let (mut hull, mut far) = (0.0_f64, 0.0_f64);
        for (p, found, border) in everywhere(&ball).into_iter().filter(|(p, ..)| p.coords.norm() > 6.0) {
            let exact = p.coords.norm() - 25.0;
            let worst = if exact.abs() < 7.0 { &mut hull } else { &mut far };
            *worst = worst.max((found - exact).abs() / 2.0);
            assert!(!border, "{p}");
        }
        assert!(hull < 0.13 && far < 0.16, "{hull} {far}");
    }

    #[test]
    fn a_fold_turns_no_sign_far_from_it() {
        for height in [-5.0, 5.0] {
            // A loop like that of a rope, which vanishes ahead and behind.
            let sheet = grid(|u, v| {
                let (s, y) = (80.0 * u - 40.0, 80.0 * v - 40.0);
                let turn = (PI * s / 12.0).clamp(-PI, PI);
                let size = (1.5 - y.abs() / 20.0).clamp(0.0, 1.0);
                [s - 10.0 * size * libm::sin(turn), y, size * height * (1.0 + libm::cos(turn))]
            });
            let flat = |p: &Point| p.x.abs().max(p.y.abs()) < 30.0 && (p.z - height).abs() > 8.0;
            assert!(everywhere(&sheet).iter().all(|(p, d, _)| !flat(p) || (p.z - height) * d > 0.0));
        }
    }

    #[test]
    fn beyond_the_rim_is_border() {
        for (p, distance, border) in everywhere(&grid(|u, v| [40.0 * u - 20.0, 40.0 * v - 20.0, 0.3])) {
            let aside = p.x.abs().max(p.y.abs()) - 20.0;
            assert!(aside > 0.0 || !border && (distance - (p.z - 0.3)).abs() < 0.3, "{p} {distance}");
            assert!(border || aside <= 4.0 + (p.z.abs() + 4.0) * 0.4, "{p}");
        }
    }

    #[test]
    fn nothing_is_all_border() {
        assert!(everywhere(&Mesh::default()).iter().all(|(_, d, border)| *border && d.is_finite()));
    }
}
