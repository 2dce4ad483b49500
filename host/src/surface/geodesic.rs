//! Lengths of the shortest ways along a mesh's edges.

use super::neighbours::Neighbours;
use crate::mesh::Mesh;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// A length in the heap: ordered as its bits, which is right for numbers that are not negative.
type Entry = Reverse<(u64, u32)>;

/// Length of the shortest way along edges from each vertex to one of `sources`; infinite where there is none
/// (Dijkstra 1959).
pub fn path_lengths(mesh: &Mesh, sources: &[u32]) -> Vec<f64> {
    let neighbours = Neighbours::new(mesh, |_| true);
    let mut lengths = vec![f64::INFINITY; mesh.points.len()];
    let mut open: BinaryHeap<Entry> = BinaryHeap::new();
    for &source in sources {
        lengths[source as usize] = 0.0;
        open.push(Reverse((0, source)));
    }
    while let Some(Reverse((bits, vertex))) = open.pop() {
        let length = f64::from_bits(bits);
        if length > lengths[vertex as usize] {
            continue;
        }
        for &next in neighbours.of(vertex) {
            let longer = length + (mesh.points[vertex as usize] - mesh.points[next as usize]).norm();
            if longer < lengths[next as usize] {
                lengths[next as usize] = longer;
                open.push(Reverse((longer.to_bits(), next)));
            }
        }
    }
    lengths
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Point;

    #[test]
    fn ways_lead_along_the_surface_and_not_across_a_gap() {
        // Two strips of unit squares side by side, one of them unreachable.
        let point = |i: usize| Point::new((i / 2) as f64, (i % 2) as f64, 0.0);
        let mut points: Vec<Point> = (0..20).map(point).collect();
        points.extend((0..4).map(|i| point(i) + crate::mesh::Vector::z() * 0.1));
        let square = |x: u32| [[2 * x, 2 * x + 2, 2 * x + 3], [2 * x, 2 * x + 3, 2 * x + 1]];
        let triangles = (0..9).chain([10]).flat_map(square).collect();
        let mesh = Mesh { points, normals: vec![], triangles };
        let found = path_lengths(&mesh, &[0, 1]);
        assert_eq!((found[0], found[8], found[19]), (0.0, 4.0, 9.0));
        assert_eq!(found[20], f64::INFINITY);
    }
}
