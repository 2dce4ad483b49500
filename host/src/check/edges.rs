//! Edges with more than two triangles, and loose pieces: told, not repaired.

use super::{Checked, Flat, counted};
use crate::surface::{Edges, components};

/// Counts non-manifold edges and pieces; `edges` are those of the mesh.
pub(super) fn check(checked: &mut Checked, edges: &Edges, flat: Flat) {
    let crowded = edges.list.iter().filter(|edge| edge.uses > 2).count();
    if crowded > 0 {
        let what = counted(crowded, "edge has", "edges have");
        checked.note(format!("{what} more than two triangles: the surface cuts or repeats itself there"));
    }
    let pieces = components(&checked.mesh).into_iter().max().map_or(0, |last| last as usize + 1);
    if pieces > 1 {
        let then = match flat {
            Flat::LeftOut => "specks among them are left out when it is used",
            Flat::Kept => "all of them are used",
        };
        checked.note(format!("the surface has {pieces} loose pieces; {then}"));
    }
}
