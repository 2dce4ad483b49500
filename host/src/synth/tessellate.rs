//! Triangulates a smooth surface over a star-shaped part of the plane.
//!
//! Begins with a fan inside the outline, splits edges that are too long in space, flips edges until
//! opposite angles sum to less than a straight angle, and moves vertices towards the middle of their
//! neighbours. The triangles stay counter-clockwise in the plane throughout, so the result is a
//! manifold disc whatever the surface does. Split points are jittered: every seed gives other triangles.

mod plane;
mod quality;

use super::random::Random;
use crate::mesh::{Mesh, Point};
use plane::{Side, Triangulation};

/// An edge this much longer than wanted is split.
const LONG: f64 = 1.35;
/// How far apart points are compared to find the stretch, in the plane.
const STRETCH_STEP: f64 = 1.0;
/// The stretch is mostly one way, so that its root is nearly enough.
const STRETCH_POWER: f64 = 0.65;
const ROUNDS: usize = 40;
const SMOOTHINGS: usize = 6;
const FLIPS: usize = 12;

/// A surface given by two coordinates.
pub(super) struct Surface<P, E> {
    /// The point of the surface.
    pub position: P,
    /// The length of edges wanted there.
    pub edge_mm: E,
}

impl<P: Fn([f64; 2]) -> Point, E: Fn([f64; 2]) -> f64> Surface<P, E> {
    /// The length of edges in the plane to begin with: shorter where the surface is stretched, so
    /// that no cliff falls between the vertices.
    fn flat_edge(&self, [x, y]: [f64; 2]) -> f64 {
        let here = (self.position)([x, y]);
        let along = ((self.position)([x + STRETCH_STEP, y]) - here).norm();
        let up = ((self.position)([x, y + STRETCH_STEP]) - here).norm();
        let stretch = (along.max(up) / STRETCH_STEP).max(1.0);
        1.2 * (self.edge_mm)([x, y]) / libm::pow(stretch, STRETCH_POWER)
    }
}

/// The surface inside `outline` (counter-clockwise, spaced as finely as wanted, star-shaped about
/// the mean of its corners; its edges are not split).
pub(super) fn tessellate<P, E>(surface: &Surface<P, E>, outline: &[[f64; 2]], random: &mut Random) -> Mesh
where
    P: Fn([f64; 2]) -> Point,
    E: Fn([f64; 2]) -> f64,
{
    // First as if the surface were flat: there, flips always lead to good triangles.
    let mut plane = Triangulation::fan(outline);
    refine(&mut plane, |[x, y]| (Point::new(x, y, 0.0), surface.flat_edge([x, y])), random);
    refine(&mut plane, |at| ((surface.position)(at), (surface.edge_mm)(at)), random);
    for _ in 0..SMOOTHINGS {
        quality::smooth(&mut plane, outline.len(), |at| (surface.position)(at));
        flip_all(&mut plane);
    }
    shuffled(&plane, random)
}

/// Splits and flips until no edge is too long. `on` gives the point of the surface and the length of
/// edges wanted there.
fn refine(plane: &mut Triangulation, on: impl Fn([f64; 2]) -> (Point, f64), random: &mut Random) {
    plane.place(&on);
    flip_all(plane);
    for _ in 0..ROUNDS {
        let count = split_long(plane, &on, random);
        flip_all(plane);
        if count == 0 {
            break;
        }
    }
}

/// Splits the edges that are too long, the longest first; returns how many were too long.
fn split_long(
    plane: &mut Triangulation,
    on: impl Fn([f64; 2]) -> (Point, f64),
    random: &mut Random,
) -> usize {
    let mut long: Vec<(f64, Side)> = plane.inner_sides().map(|side| (plane.excess(side), side)).collect();
    long.retain(|(excess, _)| *excess > LONG);
    long.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let mut touched = vec![false; plane.triangles.len()];
    for &(_, side) in &long {
        let both = [side.0, plane.neighbours[side.0 as usize][side.1]];
        // A triangle is split once a round: its name means another one afterwards.
        if both.iter().all(|&t| touched.get(t as usize) == Some(&false)) {
            both.iter().for_each(|&t| touched[t as usize] = true);
            let [a, b, _] = plane.corners(side);
            let middle = plane.between([a, b], random.range(0.4, 0.6));
            plane.split(side, middle, on(middle));
        }
    }
    long.len()
}

/// Flips until no edge wants to, at most [`FLIPS`] times over.
fn flip_all(plane: &mut Triangulation) {
    for _ in 0..FLIPS {
        let mut flips = 0;
        for triangle in 0..plane.triangles.len() as u32 {
            for side in (0..3).map(|side| (triangle, side)) {
                // Each edge is looked at from one of its triangles only.
                if plane.is_first(side) && quality::wants_flip(plane, side) {
                    plane.flip(side);
                    flips += 1;
                }
            }
        }
        if flips == 0 {
            break;
        }
    }
}

/// The mesh with vertices and triangles in random order.
fn shuffled(plane: &Triangulation, random: &mut Random) -> Mesh {
    let order = random.permutation(plane.points.len());
    let mut renamed = vec![0; order.len()];
    for (new, &old) in order.iter().enumerate() {
        renamed[old] = new as u32;
    }
    let triangles = random.permutation(plane.triangles.len());
    Mesh {
        points: order.iter().map(|&i| plane.points[i]).collect(),
        normals: vec![],
        triangles: triangles.iter().map(|&i| plane.triangles[i].map(|v| renamed[v as usize])).collect(),
    }
}
