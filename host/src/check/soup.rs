//! Triangles written one by one, each with vertices of its own: nothing tells that they touch.

use super::{Checked, counted};
use crate::io::Weld;
use crate::mesh::Mesh;

/// Vertices a triangle from which on hardly any is shared: half of one to one are usual, three where none is.
const ALONE: usize = 2;

/// Joins vertices at the same place, if hardly any triangles share vertices.
pub(super) fn check(checked: &mut Checked) {
    if checked.mesh.points.len() < ALONE * checked.mesh.triangles.len() {
        return;
    }
    if let Some(mesh) = joined(&checked.mesh) {
        checked.put_joined(mesh, "triangles");
    }
}

/// A mesh with one vertex at each place, if it has fewer then. Normals are left to the triangles: those of the corners may
/// differ.
pub(super) fn joined(mesh: &Mesh) -> Option<Mesh> {
    let mut weld = Weld::for_triangles(mesh.triangles.len());
    let places: Result<Vec<u32>, _> = mesh.points.iter().map(|p| weld.add((*p).into())).collect();
    let places = places.ok().filter(|_| weld.points.len() < mesh.points.len())?;
    let triangles = mesh.triangles.iter().map(|corners| corners.map(|v| places[v as usize])).collect();
    Some(Mesh { points: weld.points, triangles, normals: vec![] })
}

impl Checked {
    /// Goes on with a mesh whose vertices were joined, which the parts named had of their own.
    pub(super) fn put_joined(&mut self, mesh: Mesh, parts: &str) {
        let fewer = self.mesh.points.len() - mesh.points.len();
        self.mesh = mesh;
        self.repaired(format!(
            "{} joined with others at the same place: {parts} had vertices of their own",
            counted(fewer, "vertex", "vertices")
        ));
    }
}
