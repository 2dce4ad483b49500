//! Finer meshes by Loop's subdivision.

use super::topology::{Edge, Edges};
use crate::mesh::{Mesh, Point, Vector};

/// One step of Loop's scheme: every triangle becomes four. The old vertices come first, in their
/// order; then one for each edge.
///
/// Inside, weights are Warren's: 3/8 of the ends and 1/8 of the tips for an edge, 3/(8 n) of each of
/// n > 3 neighbours for a vertex, 3/16 for n = 3. The rim is a cubic B-spline of its own. Edges with
/// more than two triangles are halved, and vertices with other than two rim edges stay where they
/// are. Normals are dropped.
pub fn subdivide(mesh: &Mesh) -> Mesh {
    let edges = Edges::of(mesh);
    let mut points = moved_vertices(mesh, &edges);
    points.extend(edges.list.iter().map(|edge| edge_point(mesh, edge)));
    Mesh { points, normals: Vec::new(), triangles: quarters(mesh, &edges) }
}

/// What a vertex needs to know about its neighbours.
#[derive(Clone, Default)]
struct Ring {
    neighbours: u32,
    sum: Vector,
    rim_neighbours: u32,
    rim_sum: Vector,
}

fn moved_vertices(mesh: &Mesh, edges: &Edges) -> Vec<Point> {
    let mut rings = vec![Ring::default(); mesh.points.len()];
    for edge in &edges.list {
        let [a, b] = edge.ends.map(|v| v as usize);
        for (vertex, other) in [(a, b), (b, a)] {
            let (ring, to_other) = (&mut rings[vertex], mesh.points[other] - mesh.points[vertex]);
            ring.neighbours += 1;
            ring.sum += to_other;
            if edge.uses != 2 {
                ring.rim_neighbours += 1;
                ring.rim_sum += to_other;
            }
        }
    }
    mesh.points.iter().zip(&rings).map(|(point, ring)| point + shift(ring)).collect()
}

/// Differences to the neighbours are summed, not their places: a flat part far from the origin then
/// keeps its vertices to the last bit but one.
fn shift(ring: &Ring) -> Vector {
    match (ring.rim_neighbours, ring.neighbours) {
        (0, 3) => ring.sum * 3.0 / 16.0,
        (0, n) => ring.sum * 3.0 / (8.0 * f64::from(n.max(1))),
        (2, _) => ring.rim_sum / 8.0,
        _ => Vector::zeros(),
    }
}

fn edge_point(mesh: &Mesh, edge: &Edge) -> Point {
    let place = |vertex: u32| mesh.points[vertex as usize];
    let middle = nalgebra::center(&place(edge.ends[0]), &place(edge.ends[1]));
    if edge.uses != 2 {
        return middle;
    }
    let tips = edge.sides.map(|side| place(mesh.triangles[side as usize / 3][(side as usize + 2) % 3]));
    middle + (nalgebra::center(&tips[0], &tips[1]) - middle) / 4.0
}

fn quarters(mesh: &Mesh, edges: &Edges) -> Vec<[u32; 3]> {
    let first = mesh.points.len() as u32;
    let middles = edges.of_side.as_chunks::<3>().0.iter().map(|sides| sides.map(|edge| first + edge));
    let split = |([a, b, c], [ab, bc, ca]): ([u32; 3], [u32; 3])| {
        [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
    };
    mesh.triangles.iter().copied().zip(middles).flat_map(split).collect()
}

#[cfg(test)]
mod tests {
    use super::super::shapes::{assert_oriented, ball, sheet, volume_of};
    use super::super::{boundary_edges, is_manifold};
    use super::*;

    #[test]
    fn a_ball_stays_a_closed_manifold_and_keeps_its_size() {
        let mesh = ball(16, 6.0);
        let fine = subdivide(&mesh);
        assert_eq!(fine.triangles.len(), 4 * mesh.triangles.len());
        assert!(is_manifold(&fine) && boundary_edges(&fine).is_empty());
        assert_oriented(&fine, &Point::new(0.5, 0.25, 0.125));
        assert!((volume_of(&fine) / volume_of(&mesh) - 1.0).abs() < 0.02);
    }

    #[test]
    fn a_flat_sheet_stays_flat_and_keeps_its_area_and_its_inner_vertices() {
        let mesh = sheet(6);
        let fine = subdivide(&mesh);
        assert!(is_manifold(&fine));
        assert_eq!(boundary_edges(&fine).len(), 2 * boundary_edges(&mesh).len());
        assert!(fine.points.iter().all(|p| p.z == 0.0));
        let inner = |v: &usize| (2..4).contains(&(v % 6)) && (2..4).contains(&(v / 6));
        (0..36).filter(inner).for_each(|v| assert!((fine.points[v] - mesh.points[v]).norm() < 1e-12));
    }

    #[test]
    fn odd_meshes_do_no_harm() {
        assert_eq!(subdivide(&Mesh::default()), Mesh::default());
        let mut mesh = sheet(3);
        mesh.triangles = vec![[0, 1, 4], [4, 5, 8], [0, 1, 4], [0, 1, 3], [2, 2, 2]];
        assert_eq!(subdivide(&mesh).triangles.len(), 20);
    }
}
