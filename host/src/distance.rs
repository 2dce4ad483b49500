//! Exact signed distances to a triangle mesh: closest point, sign by the angle-weighted pseudo-normal
//! (Bærentzen & Aanæs 2005), and whether the closest point lies on the mesh's border.

use crate::bvh::{Bvh, Feature};
use crate::mesh::{Mesh, Point, Vector};
use rustc_hash::FxHashMap;

/// A mesh prepared for distance queries.
pub struct Surface {
    bvh: Bvh,
    triangles: Vec<[u32; 3]>,
    faces: Vec<Vector>,
    /// Pseudo-normals of the edges opposite corner 2, 0, 1 (edge i runs from corner i to i + 1).
    edges: Vec<[Vector; 3]>,
    vertices: Vec<Vector>,
    border_edges: Vec<[bool; 3]>,
    border_vertices: Vec<bool>,
}

/// Distance of a point to a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Distance {
    /// Signed distance in the mesh's unit, negative inside.
    pub value: f64,
    /// Whether the closest point is on the border, where "inside" has no meaning.
    pub on_border: bool,
    /// The closest point.
    pub closest: Point,
    /// The pseudo-normal there, not of unit length.
    pub normal: Vector,
    /// A triangle that has it.
    pub triangle: u32,
}

impl Surface {
    /// Prepares a mesh; `None` when it has no triangle of positive area.
    pub fn new(mesh: &Mesh) -> Option<Self> {
        let faces: Vec<Vector> = (0..mesh.triangles.len()).map(|t| mesh.normal_of(t)).collect();
        if faces.iter().all(|n| *n == Vector::zeros()) {
            return None;
        }
        let mut shared: FxHashMap<(u32, u32), (Vector, u32)> = FxHashMap::default();
        let mut vertices = vec![Vector::zeros(); mesh.points.len()];
        for (t, (corners, normal)) in mesh.triangles.iter().zip(&faces).enumerate() {
            for i in 0..3 {
                let entry = shared.entry(edge_key(corners, i)).or_insert((Vector::zeros(), 0));
                entry.0 += normal;
                entry.1 += 1;
                vertices[corners[i] as usize] += normal * corner_angle(&mesh.corners(t), i);
            }
        }
        let mut border_vertices = vec![false; mesh.points.len()];
        let mut edges = Vec::with_capacity(faces.len());
        let mut border_edges = Vec::with_capacity(faces.len());
        for corners in &mesh.triangles {
            let found = [0, 1, 2].map(|i| shared[&edge_key(corners, i)]);
            edges.push(found.map(|(normal, _)| normal));
            border_edges.push(found.map(|(_, count)| count == 1));
            for (i, (_, count)) in found.iter().enumerate() {
                if *count == 1 {
                    border_vertices[corners[i] as usize] = true;
                    border_vertices[corners[(i + 1) % 3] as usize] = true;
                }
            }
        }
        let bvh = Bvh::new(mesh);
        let triangles = mesh.triangles.clone();
        Some(Self { bvh, triangles, faces, edges, vertices, border_edges, border_vertices })
    }

    /// Distance of `p`, if the surface is nearer than `limit`.
    pub fn distance(&self, p: &Point, limit: f64) -> Option<Distance> {
        let hit = self.bvh.closest(p, limit)?;
        let t = hit.triangle as usize;
        let vertex = |i: usize| self.triangles[t][i] as usize;
        let (normal, on_border) = match hit.feature {
            Feature::Face => (self.faces[t], false),
            Feature::Edge(i) => (self.edges[t][i as usize], self.border_edges[t][i as usize]),
            Feature::Vertex(i) => {
                (self.vertices[vertex(i as usize)], self.border_vertices[vertex(i as usize)])
            }
        };
        let size = hit.squared_distance.sqrt();
        let value = if (p - hit.point).dot(&normal) < 0.0 { -size } else { size };
        Some(Distance { value, on_border, closest: hit.point, normal, triangle: hit.triangle })
    }

    /// The way that the surface around a triangle faces, not of unit length: noise tilts single triangles.
    pub fn facing(&self, triangle: u32) -> Vector {
        self.triangles[triangle as usize].iter().map(|&v| self.vertices[v as usize]).sum()
    }

    /// Motion from `p` to where the line along a unit vector, forward or backward, meets the surface first, within
    /// `reach`, and the triangle there.
    pub fn along(&self, p: &Point, direction: &Vector, reach: f64) -> Option<(Vector, u32)> {
        let hit = |way: Vector| self.bvh.cast(p, &way, reach).map(|(t, triangle)| (t, way, triangle));
        let (ahead, behind) = (hit(*direction), hit(-direction));
        let (t, way, triangle) = ahead.into_iter().chain(behind).min_by(|a, b| a.0.total_cmp(&b.0))?;
        Some((way * t, triangle))
    }

    /// The tree underneath.
    pub fn bvh(&self) -> &Bvh {
        &self.bvh
    }
}

fn edge_key(corners: &[u32; 3], i: usize) -> (u32, u32) {
    let (a, b) = (corners[i], corners[(i + 1) % 3]);
    (a.min(b), a.max(b))
}

fn corner_angle(corners: &[Point; 3], i: usize) -> f64 {
    let (a, b) = (corners[(i + 1) % 3] - corners[i], corners[(i + 2) % 3] - corners[i]);
    libm::atan2(a.cross(&b).norm(), a.dot(&b))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square() -> Mesh {
        let points = [[0., 0., 0.], [4., 0., 0.], [4., 4., 0.], [0., 4., 0.]].map(Point::from).to_vec();
        Mesh { points, normals: vec![], triangles: vec![[0, 1, 2], [0, 2, 3]] }
    }

    #[test]
    fn the_normal_side_is_positive() {
        let surface = Surface::new(&square()).unwrap();
        let above = surface.distance(&Point::new(1.0, 2.0, 3.0), 10.0).unwrap();
        assert_eq!((above.value, above.on_border), (3.0, false));
        assert_eq!(surface.distance(&Point::new(2.0, 2.0, -3.0), 10.0).unwrap().value, -3.0);
    }

    #[test]
    fn beyond_the_rim_is_on_the_border() {
        let surface = Surface::new(&square()).unwrap();
        assert!(surface.distance(&Point::new(6.0, 2.0, 1.0), 10.0).unwrap().on_border);
        assert!(surface.distance(&Point::new(9.0, 2.0, 1.0), 3.0).is_none());
    }

    #[test]
    fn a_mesh_without_area_is_no_surface() {
        let mut mesh = square();
        mesh.triangles = vec![[0, 0, 1]];
        assert!(Surface::new(&mesh).is_none());
    }
}
