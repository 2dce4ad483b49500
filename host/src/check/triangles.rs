//! Triangles that cover nothing, or are there twice: the same way round or as the other side of a sheet.

use super::{Checked, Flat, counted};
use crate::io::Weld;
use crate::mesh::Mesh;
use rustc_hash::{FxHashMap, FxHashSet};
use std::collections::hash_map::Entry;

/// Takes out copies and, unless they are kept, zero-area triangles; without any other triangle the mesh is refused. Returns
/// whether there were two sides of a sheet, of which nothing tells which is the outer one.
pub(super) fn check(checked: &mut Checked, flat: Flat) -> bool {
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
        checked.refused(text);
        return false;
    }
    if flat == Flat::LeftOut {
        let mut kept = covering.iter();
        mesh.triangles.retain(|_| kept.next() == Some(&true));
        join_sides(mesh);
    }
    let flat = before - mesh.triangles.len();
    let (mut seen, mut either_way) = (FxHashMap::default(), false);
    mesh.triangles.retain(|corners| {
        let (sorted, even) = sorted(*corners);
        match seen.entry(sorted) {
            Entry::Vacant(first) => {
                first.insert(even);
                true
            }
            Entry::Occupied(first) => {
                either_way |= *first.get() != even;
                false
            }
        }
    });
    let copies = before - flat - mesh.triangles.len();
    if flat > 0 {
        checked.repaired(format!("{} without area left out", counted(flat, "triangle", "triangles")));
    }
    if copies > 0 {
        let what = counted(copies, "triangle that is", "triangles that are");
        checked.repaired(format!("{what} there twice left out"));
    }
    either_way
}

/// Joins the vertices at the same place where triangles are there twice by their places alone: sheets that were exported with
/// both their sides may have vertices of their own for each. Normals are left to the triangles: those of the sides differ.
fn join_sides(mesh: &mut Mesh) {
    let mut weld = Weld::for_triangles(mesh.points.len());
    let places: Result<Vec<u32>, _> = mesh.points.iter().map(|p| weld.add((*p).into())).collect();
    let Ok(places) = places else { return };
    let joined: Vec<[u32; 3]> = mesh.triangles.iter().map(|c| c.map(|v| places[v as usize])).collect();
    let different =
        |triangles: &[[u32; 3]]| triangles.iter().map(|c| sorted(*c).0).collect::<FxHashSet<_>>().len();
    if weld.points.len() < mesh.points.len() && different(&joined) < different(&mesh.triangles) {
        (mesh.points, mesh.triangles) = (weld.points, joined);
        mesh.normals.clear();
    }
}

/// Corners in order, and whether an even number of exchanges leads there: the two sides of a triangle differ in that.
const fn sorted([a, b, c]: [u32; 3]) -> ([u32; 3], bool) {
    let (low, high, even) = if a < b { (a, b, true) } else { (b, a, false) };
    if c < low {
        ([c, low, high], even)
    } else if c < high {
        ([low, c, high], !even)
    } else {
        ([low, high, c], even)
    }
}
