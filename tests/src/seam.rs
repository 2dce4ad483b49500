//! The seam between the measured and the inferred part of a completed mesh, in numbers.

use lacuna_host::complete::merge::{MEASURED, Merged};
use lacuna_host::surface::{Edges, open_curves};

/// Largest step at the seam: by how much the surface was moved off the fitted one at a measured vertex more than at
/// an inferred one that is joined to it by an edge and not farther than `reach` away. In the scan's unit.
pub fn largest_step(merged: &Merged, reach: f64) -> f64 {
    steps(merged, reach).into_iter().fold(0.0, f64::max)
}

/// The step at every edge of the seam.
pub fn steps(merged: &Merged, reach: f64) -> Vec<f64> {
    let mesh = &merged.mesh;
    let is_seam = |ends: &[usize; 2]| {
        let measured = ends.map(|v| merged.labels[v] == MEASURED);
        measured[0] != measured[1] && (mesh.points[ends[0]] - mesh.points[ends[1]]).norm() <= reach
    };
    let edges = Edges::of(mesh).list;
    let seam = edges.iter().map(|edge| edge.ends.map(|v| v as usize)).filter(is_seam);
    seam.map(|[a, b]| f64::from((merged.heights[a] - merged.heights[b]).abs())).collect()
}

/// Lengths in edges of the closed curves a mesh is open along, ascending.
pub fn rims(mesh: &lacuna_host::mesh::Mesh) -> Vec<usize> {
    let mut lengths: Vec<usize> = open_curves(mesh).iter().map(Vec::len).collect();
    lengths.sort_unstable();
    lengths
}
