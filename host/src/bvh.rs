//! Bounding box tree over the triangles of a mesh: closest point, first hit of a ray, visibility.
//!
//! A node holds the boxes of four children as `f32`, padded outwards, so that one pass of short
//! vector instructions looks at all of them; triangles are tested in `f64`, and no result depends on
//! the boxes. Queries neither allocate nor panic; equal distances go to the lowest triangle index.

mod build;
mod node;
mod ray;
#[cfg(test)]
mod tests;
mod triangle;

use crate::mesh::{Mesh, Point, Vector};
use node::{Child, Node, Query, Stack};
use triangle::Triangle;

/// Where on a triangle a closest point lies. Decides which pseudo-normal applies, and whether the
/// point is on the border of the surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Feature {
    /// Inside the triangle.
    Face,
    /// On the edge from corner `i` to corner `(i + 1) % 3`.
    Edge(u8),
    /// On corner `i`.
    Vertex(u8),
}

/// The point of a mesh that is closest to a query.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Index into [`Mesh::triangles`].
    pub triangle: u32,
    /// The closest point.
    pub point: Point,
    /// Its squared distance from the query.
    pub squared_distance: f64,
    /// The part of the triangle it lies on.
    pub feature: Feature,
}

/// Bounding box tree over the triangles of a mesh. It copies what it needs of the mesh.
#[derive(Clone, Debug, Default)]
pub struct Bvh {
    /// Subtracted from all places, for boxes are in single precision; zero where that suffices.
    origin: Vector,
    nodes: Vec<Node>,
    leaves: Vec<Triangle>,
}

impl Bvh {
    /// Builds the tree: about 1 us a triangle. A mesh without triangles is allowed and is never hit.
    pub fn new(mesh: &Mesh) -> Self {
        let origin = origin(mesh);
        let corners: Vec<_> =
            (0..mesh.triangles.len()).map(|i| mesh.corners(i).map(|corner| corner - origin)).collect();
        let (nodes, order) = build::build(&corners);
        let leaves = order.iter().map(|&i| Triangle::new(corners[i as usize], i)).collect();
        Self { origin, nodes, leaves }
    }

    /// The point of the surface closest to `p`, if one lies within `max_distance` (inclusive; may be
    /// infinite). The smaller `max_distance`, the faster the answer.
    pub fn closest(&self, p: &Point, max_distance: f64) -> Option<Hit> {
        let p = &(p - self.origin);
        let query = Query::new(p);
        let mut best = None;
        let mut limit = max_distance * max_distance;
        let mut stack = Stack::new();
        if !self.nodes.is_empty() {
            stack.push(Child::ROOT, 0.0);
        }
        while let Some(child) = stack.pop(node::bound(limit)) {
            if child.is_node() {
                stack.push_near_last(&self.nodes[child.first as usize], &query, node::bound(limit));
            } else {
                for triangle in child.triangles(&self.leaves) {
                    limit = triangle.improve(p, limit, &mut best);
                }
            }
        }
        best.map(|hit: Hit| Hit { point: hit.point + self.origin, ..hit })
    }
}

/// Farther from 0 0 0 than this, in lengths of the mesh, its places are centred.
const FAR: f64 = 100.0;

/// The middle of a mesh that lies far from 0 0 0: as maps have it, in coordinates of millions of metres.
fn origin(mesh: &Mesh) -> Vector {
    let Some((low, high)) = mesh.bounds() else { return Vector::zeros() };
    let middle = nalgebra::center(&low, &high).coords;
    if middle.amax() > FAR * (high - low).amax() { middle } else { Vector::zeros() }
}
