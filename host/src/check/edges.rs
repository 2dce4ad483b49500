//! Edges with more than two triangles, and loose pieces: told, not repaired.

use super::{Checked, Flat, counted};
use crate::surface::{Edges, components};

/// Counts non-manifold edges and pieces; `edges` are those of the mesh. Returns the number of each triangle's piece.
pub(super) fn check(checked: &mut Checked, edges: &Edges, flat: Flat) -> Vec<u32> {
    let crowded = edges.list.iter().filter(|edge| edge.uses > 2).count();
    if crowded > 0 {
        let what = counted(crowded, "edge has", "edges have");
        checked.note(format!("{what} more than two triangles: the surface cuts or repeats itself there"));
    }
    let pieces = components(&checked.mesh);
    let count = pieces.iter().max().map_or(0, |&last| last + 1);
    if count > 1 {
        let then = match flat {
            Flat::LeftOut => "specks among them are left out when it is used",
            Flat::Kept => "all of them are used",
        };
        checked.note(format!("the surface has {count} loose pieces; {then}"));
    }
    pieces
}
