//! Closes small holes: places where a cell of the grid was unknown, not the end of the class.

use super::Edges;
use crate::mesh::{Mesh, Point, Vector};
use std::collections::{BTreeMap, BTreeSet};

/// A closed curve along open edges is a hole, not a rim, if it has fewer edges than this share of the longest one.
const HOLE: f64 = 0.1;

/// The mesh with a fan of triangles over every small hole; the longest open curve stays, and so does a curve that
/// runs through a vertex twice.
pub fn close_holes(mesh: &Mesh) -> Mesh {
    let curves = open_curves(mesh);
    let longest = curves.iter().map(Vec::len).max().unwrap_or(0) as f64;
    let mut mesh = Mesh { normals: Vec::new(), ..mesh.clone() };
    for curve in curves.iter().filter(|curve| (curve.len() as f64) < HOLE * longest) {
        let sum: Vector = curve.iter().map(|&v| mesh.points[v as usize].coords).sum();
        let middle = mesh.points.len() as u32;
        mesh.points.push(Point::from(sum / curve.len() as f64));
        // Open edges run along their triangles: the fan runs the other way.
        let ends = curve.iter().zip(curve.iter().cycle().skip(1));
        mesh.triangles.extend(ends.map(|(&a, &b)| [b, a, middle]));
    }
    mesh
}

/// The closed curves a mesh is open along, as their vertices in the direction of the triangles.
pub fn open_curves(mesh: &Mesh) -> Vec<Vec<u32>> {
    let mut next: BTreeMap<u32, u32> = BTreeMap::new();
    let mut crossings = BTreeSet::new();
    for [a, b] in Edges::of(mesh).boundary() {
        if next.insert(a, b).is_some() {
            crossings.insert(a);
        }
    }
    let mut curves = Vec::new();
    while let Some((first, mut at)) = next.pop_first() {
        let mut curve = vec![first];
        while at != first {
            curve.push(at);
            let Some(following) = next.remove(&at) else { break };
            at = following;
        }
        if at == first && !curve.iter().any(|v| crossings.contains(v)) {
            curves.push(curve);
        }
    }
    curves
}

#[cfg(test)]
mod tests {
    use super::super::shapes::sheet;
    use super::super::{is_manifold, keep_triangles};
    use super::*;

    #[test]
    fn a_hole_is_closed_and_the_rim_stays() {
        let whole = sheet(20);
        let middle = 2 * (19 * 9 + 9);
        let holed = keep_triangles(&whole, |t| t != middle && t != middle + 1);
        assert_eq!(open_curves(&holed).len(), 2);
        let closed = close_holes(&holed);
        let curves = open_curves(&closed);
        assert_eq!((curves.len(), curves[0].len()), (1, 4 * 19));
        assert!(is_manifold(&closed));
        assert_eq!(close_holes(&whole), whole);
    }
}
