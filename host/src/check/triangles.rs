//! Triangles that cover nothing, or are there twice: the same way round or as the other side of a sheet.

use super::{Checked, Flat, counted};
use crate::io::Weld;
use rustc_hash::FxHashSet;

/// Takes out copies and, unless they are kept, zero-area triangles; without any other triangle the mesh is refused.
pub(super) fn check(checked: &mut Checked, flat: Flat) {
    let mesh = &mut checked.mesh;
    let before = mesh.triangles.len();
    let covers = |&[a, b, c]: &[u32; 3]| {
        let [a, b, c] = [a, b, c].map(|v| mesh.points[v as usize]);
        // Scaled first: the product of tiny edges would vanish.
        let (u, v) = (b - a, c - a);
        let size = u.amax().max(v.amax());
        size > 0.0 && (u / size).cross(&(v / size)).norm() > 0.0
    };
    let covering: Vec<bool> = mesh.triangles.iter().map(covers).collect();
    if !covering.contains(&true) {
        let text = format!("none of its {before} triangles has an area; export the surface itself");
        return checked.refused(text);
    }
    if flat == Flat::LeftOut {
        let mut kept = covering.iter();
        mesh.triangles.retain(|_| kept.next() == Some(&true));
    }
    let flat = before - mesh.triangles.len();
    // Sheets that were exported with both their sides may have vertices of their own for each.
    let mut weld = Weld::for_triangles(mesh.points.len());
    let places: Result<Vec<u32>, _> = mesh.points.iter().map(|p| weld.add((*p).into())).collect();
    let place = |v: u32| places.as_ref().map_or(v, |places| places[v as usize]);
    let mut seen = FxHashSet::default();
    mesh.triangles.retain(|corners| {
        let mut sorted = corners.map(place);
        sorted.sort_unstable();
        seen.insert(sorted)
    });
    let copies = before - flat - mesh.triangles.len();
    if flat > 0 {
        checked.repaired(format!("{} without area left out", counted(flat, "triangle", "triangles")));
    }
    if copies > 0 {
        let what = counted(copies, "triangle that is", "triangles that are");
        checked.repaired(format!("{what} there twice left out"));
    }
}
