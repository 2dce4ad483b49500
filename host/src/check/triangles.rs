//! Triangles that cover nothing, or are there twice: the same way round or as the other side of a sheet.

use super::soup::joined;
use super::{Checked, Flat, counted};
use crate::mesh::Mesh;
use rustc_hash::{FxHashMap, FxHashSet};
use std::collections::hash_map::Entry;

/// Share of the triangles that are there as the other side of another one, from which on the mesh is a sheet with both sides.
const BOTH: f64 = 0.5;

/// Takes out copies and, unless they are kept, zero-area triangles; without any other triangle the mesh is refused. Returns
/// whether there were both sides of a sheet, of which nothing tells which is the outer one.
pub(super) fn check(checked: &mut Checked, flat: Flat) -> bool {
    let mesh = &mut checked.mesh;
    let before = mesh.triangles.len();
    let with_area: Vec<bool> = (0..before).map(|t| mesh.has_area(t)).collect();
    if !with_area.contains(&true) {
        let text = format!("none of its {before} triangles has an area; export the surface itself");
        checked.refused(text);
        return false;
    }
    if flat == Flat::LeftOut {
        let mut kept = with_area.iter();
        mesh.triangles.retain(|_| kept.next() == Some(&true));
        join_sides(checked);
    }
    let mesh = &mut checked.mesh;
    let flat = before - mesh.triangles.len();
    let (mut seen, mut opposite) = (FxHashMap::default(), 0);
    mesh.triangles.retain(|corners| {
        let (sorted, even) = sorted(*corners);
        match seen.entry(sorted) {
            Entry::Vacant(first) => {
                first.insert(even);
                true
            }
            Entry::Occupied(first) => {
                opposite += usize::from(*first.get() != even);
                false
            }
        }
    });
    let left = mesh.triangles.len();
    let copies = before - flat - left;
    if flat > 0 {
        checked.repaired(format!("{} without area left out", counted(flat, "triangle", "triangles")));
    }
    if copies > 0 {
        let what = counted(copies, "triangle that is", "triangles that are");
        checked.repaired(format!("{what} there twice left out"));
    }
    opposite as f64 >= BOTH * left as f64
}

/// Joins the vertices at the same place where most triangles are there twice by their places alone: sheets that were exported
/// with both their sides may have vertices of their own for each.
fn join_sides(checked: &mut Checked) {
    let different =
        |triangles: &[[u32; 3]]| triangles.iter().map(|c| sorted(*c).0).collect::<FxHashSet<_>>().len();
    let is_double = |mesh: &Mesh| {
        let [before, left] = [&checked.mesh, mesh].map(|mesh| different(&mesh.triangles));
        (before - left) as f64 >= BOTH * left as f64
    };
    if let Some(mesh) = joined(&checked.mesh).filter(is_double) {
        checked.put_joined(mesh, "the two sides of its sheets");
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
