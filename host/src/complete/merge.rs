//! One mesh of both: the fitted surface, moved onto the scan where the scan was measured.
//!
//! The fitted surface lies within a fraction of a millimetre of the measured one. Each of its vertices that
//! has measured surface next to it is moved there; the motion fades out into the inferred part, so that there
//! is no step at the seam. The mesh stays the manifold that the extraction made.

use crate::distance::Surface;
use crate::mesh::{Mesh, Point, Vector};
use crate::surface::{carry, carry_next_to_known, corner_pairs};
use rayon::prelude::*;

/// Label of a vertex that was moved onto the scan.
pub const MEASURED: u8 = 1;
/// Label of a vertex that the model filled in.
pub const INFERRED: u8 = 0;

/// Share of a motion that reaches the next ring of vertices beyond the seam.
const FADE: f64 = 0.92;
/// Rings the motion is carried.
const RINGS: usize = 40;
/// What noise makes of a surface that is measured, and of how views lie beside each other, in steps at the seam.
const NOISE: f64 = 2.0;
/// Times measured vertices that make a step at the seam are given up at most; seen: 12 on faces, beyond 30 in hair.
const YIELDS: usize = 60;

/// The completed mesh.
#[derive(Clone, Debug, Default)]
pub struct Merged {
    /// Its surface.
    pub mesh: Mesh,
    /// [`MEASURED`] or [`INFERRED`], one a vertex.
    pub labels: Vec<u8>,
    /// Distance to the scan, one a vertex, in the scan's unit.
    pub distances: Vec<f32>,
    /// How far each vertex was moved outward from the fitted surface, in the scan's unit.
    pub heights: Vec<f32>,
}

impl Merged {
    /// Area of the inferred surface; of a triangle at the seam, as much as of its corners.
    pub fn inferred_area(&self) -> f64 {
        let inferred = |&&v: &&u32| self.labels[v as usize] != MEASURED;
        let share = |corners: &[u32; 3]| corners.iter().filter(inferred).count() as f64 / 3.0;
        let area = |(t, corners)| self.mesh.area_of(t) * share(corners);
        self.mesh.triangles.iter().enumerate().map(area).sum()
    }
}

/// How the measured surface is found next to a vertex.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Farthest motion onto the scan, scan units.
    pub motion: f64,
    /// Farthest sideways part of it, for clouds, whose every point has a border; none for meshes.
    pub sideways: Option<f64>,
    /// Largest step at the seam, scan units: a measured vertex that stands out farther from inferred neighbours is
    /// a stray of the scan's ragged border.
    pub step: f64,
}

/// Moves `fitted` onto the scan where it was measured. Strays give way to the fitted surface in `YIELDS` rounds; what
/// becomes one in the last of them stays.
pub fn merge(fitted: &Mesh, scan: &Surface, limits: &Limits) -> Merged {
    let normals = fitted.vertex_normals();
    let mut motions: Vec<Option<Vector>> = fitted
        .points
        .par_iter()
        .zip(&normals)
        .map(|(point, normal)| motion(point, normal, scan, limits))
        .collect();
    for _ in 0..YIELDS {
        let near = carry_next_to_known(fitted, &motions, FADE, RINGS);
        let strays = strays(fitted, &normals, &motions, &near, limits.step);
        if strays.is_empty() {
            break;
        }
        strays.into_iter().for_each(|v| motions[v as usize] = None);
    }
    // Beyond the last ring a motion ends at FADE^RINGS of itself, a 28th: no step to be seen.
    let faded = carry(fitted, &motions, FADE, RINGS);
    let heights = faded.iter().zip(&normals).map(|(motion, normal)| motion.dot(normal) as f32).collect();
    let points: Vec<Point> = fitted.points.iter().zip(&faded).map(|(p, motion)| p + motion).collect();
    let distance =
        |p: &Point| scan.distance(p, f64::INFINITY).map_or(f32::INFINITY, |d| d.value.abs() as f32);
    let distances = points.par_iter().map(distance).collect();
    let labels = motions.iter().map(|m| if m.is_some() { MEASURED } else { INFERRED }).collect();
    Merged {
        mesh: Mesh { points, normals: vec![], triangles: fitted.triangles.clone() },
        labels,
        distances,
        heights,
    }
}

fn motion(point: &Point, normal: &Vector, scan: &Surface, limits: &Limits) -> Option<Vector> {
    let found = scan.distance(point, limits.motion)?;
    let scan_normal = found.normal.try_normalize(0.0)?;
    let noise = NOISE * limits.step;
    // Noise tilts single triangles; one that is tilted far from the fitted surface is a stray.
    let tilted = || found.value.abs() < noise && faces(scan, found.triangle, normal);
    if scan_normal.dot(normal) < 0.5 && !tilted() {
        return None;
    }
    let motion = found.closest - point;
    match limits.sideways {
        None if found.on_border => beneath(point, normal, scan, noise),
        None => Some(motion),
        Some(limit) => {
            let height = scan_normal * motion.dot(&scan_normal);
            ((motion - height).norm() <= limit).then_some(height)
        }
    }
}

/// Motion onto another sheet where a hole of the nearest one ends: views overlap, and each lacks single pixels.
fn beneath(point: &Point, normal: &Vector, scan: &Surface, reach: f64) -> Option<Vector> {
    let (motion, triangle) = scan.along(point, normal, reach)?;
    faces(scan, triangle, normal).then_some(motion)
}

/// Whether the scan around a triangle faces the way of a unit normal, within 60 degrees.
fn faces(scan: &Surface, triangle: u32, normal: &Vector) -> bool {
    let facing = scan.facing(triangle);
    facing.dot(normal) >= 0.5 * facing.norm() && facing != Vector::zeros()
}

/// Measured vertices that moved by more than `step` otherwise than an inferred neighbour, or farther outward: at sharp
/// edges the same motion may lead outward at one end and along the surface at the other. `faded` holds at the seam.
fn strays(
    mesh: &Mesh,
    normals: &[Vector],
    motions: &[Option<Vector>],
    faded: &[Vector],
    step: f64,
) -> Vec<u32> {
    let mut strays = Vec::new();
    for &corners in &mesh.triangles {
        for (from, to) in corner_pairs(corners) {
            let [measured, inferred] = [from, to].map(|v| v as usize);
            let seam = motions[measured].is_some() && motions[inferred].is_none();
            let height = |v: usize| faded[v].dot(&normals[v]);
            let apart =
                (faded[measured] - faded[inferred]).norm().max((height(measured) - height(inferred)).abs());
            if seam && apart > step {
                strays.push(from);
            }
        }
    }
    strays
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A flat strip from x = 0 to `length` at height z.
    fn strip(length: usize, z: f64) -> Mesh {
        let points = (0..=length).flat_map(|x| [0.0, 1.0].map(|y| Point::new(x as f64, y, z))).collect();
        let quad = |x: usize| {
            let a = 2 * x as u32;
            [[a, a + 2, a + 3], [a, a + 3, a + 1]]
        };
        Mesh { points, normals: vec![], triangles: (0..length).flat_map(quad).collect() }
    }

    #[test]
    fn measured_vertices_lie_on_the_scan_and_the_motion_fades() {
        let scan = Surface::new(&strip(10, 0.4)).unwrap();
        let mut fitted = strip(60, 0.0);
        fitted.points.iter_mut().for_each(|p| p.y = 0.25 + p.y / 2.0);
        let merged = merge(&fitted, &scan, &Limits { motion: 1.0, sideways: None, step: 0.25 });
        let height = |x: usize| merged.mesh.points[2 * x].z;
        assert_eq!((merged.labels[2 * 5], height(5)), (MEASURED, 0.4));
        assert_eq!(merged.labels[2 * 12], INFERRED);
        let (near, far) = (height(11), height(60));
        assert!(near > 0.05 && near < 0.4 && far == 0.0, "{near} {far}");
        let heights: Vec<f64> = (0..=60).map(height).collect();
        assert!(heights[1..].windows(4).all(|w| w[0] >= w[3] - 1e-12), "{heights:?}");
        assert!((merged.distances[2 * 20] - 10.0).abs() < 0.2);
    }

    #[test]
    fn a_hole_of_one_sheet_is_measured_where_another_covers_it() {
        let piece = |from: f64, to: f64, z: f64| {
            let mut piece = strip(1, z);
            piece.points.iter_mut().for_each(|p| p.x = from + (to - from) * p.x);
            piece
        };
        let mut sheet = piece(0.0, 4.9, 0.4);
        sheet.append(&piece(5.1, 10.0, 0.4));
        let mut fitted = strip(10, 0.0);
        fitted.points.iter_mut().for_each(|p| p.y = 0.25 + p.y / 2.0);
        let limits = Limits { motion: 1.0, sideways: None, step: 0.25 };
        let in_hole = |scan: &Mesh| {
            let merged = merge(&fitted, &Surface::new(scan).unwrap(), &limits);
            (merged.labels[2 * 5], merged.mesh.points[2 * 5].z)
        };
        assert_eq!(in_hole(&sheet).0, INFERRED);
        let mut both = sheet.clone();
        both.append(&piece(0.0, 10.0, 0.45));
        assert_eq!(in_hole(&both), (MEASURED, 0.45));
        // Too far beneath to be the same surface.
        sheet.append(&piece(0.0, 10.0, 0.8));
        assert_eq!(in_hole(&sheet).0, INFERRED);
    }

    #[test]
    fn a_steep_triangle_is_measured_near_the_fitted_surface_and_a_stray_far_from_it() {
        // Flat, then two down, then flat again.
        let mut scan = strip(3, 0.0);
        for point in &mut scan.points {
            (point.x, point.z) = [(0.0, 0.0), (1.0, 0.0), (1.1, -2.0), (5.0, -2.0)][point.x as usize];
        }
        let scan = Surface::new(&scan).unwrap();
        let limits = Limits { motion: 1.5, sideways: None, step: 0.25 };
        let at = |x: f64| motion(&Point::new(x, 0.5, -1.0), &Vector::z(), &scan, &limits);
        assert!(at(1.2).is_some(), "tilted by noise");
        assert!(at(2.0).is_none(), "the step is the nearest there too");
    }

    #[test]
    fn a_stray_at_the_seam_is_found_and_its_measured_neighbours_are_not() {
        let mesh = strip(4, 0.0);
        let measured = |height: f64| Some(Vector::z() * height);
        // Left to right: measured, measured but standing out, inferred.
        let heights = [0.1, 0.1, 0.1, 0.9, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        let motions: Vec<Option<Vector>> =
            heights.iter().enumerate().map(|(v, &h)| if v < 4 { measured(h) } else { None }).collect();
        let faded: Vec<Vector> = heights.iter().map(|&h| Vector::z() * h).collect();
        let mut found = strays(&mesh, &[Vector::z(); 10], &motions, &faded, 0.25);
        found.dedup();
        assert_eq!(found, [3]);
    }

    #[test]
    fn a_stray_at_a_sharp_edge_stands_out_though_its_neighbours_move_with_it() {
        let mesh = strip(2, 0.0);
        let motions: Vec<Option<Vector>> = (0..6).map(|v| (v < 4).then(|| Vector::z() * 0.4)).collect();
        let normals: Vec<Vector> = (0..6).map(|v| if v < 4 { Vector::z() } else { Vector::x() }).collect();
        let mut found = strays(&mesh, &normals, &motions, &[Vector::z() * 0.4; 6], 0.25);
        found.sort_unstable();
        found.dedup();
        assert_eq!(found, [2, 3]);
        assert!(strays(&mesh, &[Vector::z(); 6], &motions, &[Vector::z() * 0.4; 6], 0.25).is_empty());
    }
}
