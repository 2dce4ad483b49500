//! Vertices that no triangle uses: they would count for the size of the mesh.

use super::{Checked, counted};
use crate::surface::keep_triangles;

/// Takes out vertices without triangles.
pub(super) fn check(checked: &mut Checked) {
    let mut used = vec![false; checked.mesh.points.len()];
    checked.mesh.triangles.as_flattened().iter().for_each(|&v| used[v as usize] = true);
    let unused = used.iter().filter(|&&used| !used).count();
    if unused == 0 {
        return;
    }
    checked.mesh = keep_triangles(&checked.mesh, |_| true);
    let what = counted(unused, "vertex", "vertices");
    checked.repaired(format!("{what} without a triangle left out"));
}
