//! Triangles written one by one, each with vertices of its own: nothing tells that they touch.

use super::Checked;
use crate::io::Weld;

/// Vertices a triangle from which on hardly any is shared: half of one to one are usual, three where none is.
const ALONE: usize = 2;

/// Joins vertices at the same place, if hardly any triangles share vertices. Normals are left to the triangles: those of
/// the corners may differ.
pub(super) fn check(checked: &mut Checked) {
    let mesh = &mut checked.mesh;
    let before = mesh.points.len();
    if before < ALONE * mesh.triangles.len() {
        return;
    }
    let mut weld = Weld::for_triangles(mesh.triangles.len());
    let joined: Result<Vec<u32>, _> = mesh.points.iter().map(|p| weld.add((*p).into())).collect();
    let Ok(joined) = joined else { return };
    let more = before - weld.points.len();
    if more == 0 {
        return;
    }
    mesh.triangles.iter_mut().flatten().for_each(|v| *v = joined[*v as usize]);
    mesh.points = weld.points;
    mesh.normals.clear();
    checked.repaired(format!(
        "{more} vertices joined with others at the same place: triangles had vertices of their own"
    ));
}
