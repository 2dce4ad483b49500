//! Which way triangles face: neighbours that contradict each other, and closed surfaces turned inside out.

use super::inwards::outwardness_of;
use super::{Checked, counted};
use crate::mesh::{Mesh, Point};
use crate::surface::Edges;

/// Turns the smaller side of contradicting winding round, and closed surfaces that face inwards; `edges` are those
/// of the mesh, whose triangles may have been there `either_way`.
pub(super) fn check(checked: &mut Checked, edges: &Edges, either_way: bool) {
    let contradicting = edges.list.iter().any(|e| e.uses == 2 && same_way(&checked.mesh, e.sides));
    if contradicting || either_way {
        match turned(&checked.mesh, edges, either_way) {
            Some(turn) => repair(checked, &turn),
            None => checked
                .note("the winding contradicts itself along a one-sided surface; it stays as it is".into()),
        }
    }
    if is_closed(edges) && volume(&checked.mesh) < 0.0 {
        checked.mesh.triangles.iter_mut().for_each(|corners| corners.swap(1, 2));
        checked.mesh.normals.iter_mut().for_each(|normal| *normal = -*normal);
        checked.repaired("the closed surface faced inwards; its triangles were turned round".into());
    }
}

/// Whether a mesh is a closed surface that faces outwards.
pub fn encloses(mesh: &Mesh) -> bool {
    !mesh.triangles.is_empty() && is_closed(&Edges::of(mesh)) && volume(mesh) > 0.0
}

fn is_closed(edges: &Edges) -> bool {
    edges.list.iter().all(|edge| edge.uses == 2)
}

fn repair(checked: &mut Checked, turn: &[bool]) {
    let turned = turn.iter().filter(|&&turn| turn).count();
    if turned == 0 {
        return;
    }
    for (corners, _) in checked.mesh.triangles.iter_mut().zip(turn).filter(|(_, turn)| **turn) {
        corners.swap(1, 2);
    }
    // Normals of the file belong to the old winding: those of the triangles hold.
    checked.mesh.normals.clear();
    let what = counted(turned, "triangle that faces", "triangles that face");
    checked.repaired(format!("{what} the other way than the neighbours turned round"));
}

/// Whether two sides run along their edge in the same direction.
fn same_way(mesh: &Mesh, sides: [u32; 2]) -> bool {
    let start = |side: u32| mesh.triangles[side as usize / 3][side as usize % 3];
    start(sides[0]) == start(sides[1])
}

/// A side of less than this share of a piece's area is the wrong one; of more, its form must tell,
const FEWER: f64 = 0.4;
/// if it bulges this clearly to one side: scans of one view are at -0.08 to 0.46, those of faces from 0.25 on.
const CLEARLY: f64 = 0.15;

/// Which triangles must be turned so that all neighbours agree; none for a one-sided surface. In every piece the
/// side with the larger area stays, huge triangles counted as large ones; of sides of about the same area, and of those that
/// had been there `either_way`, the one that faces outwards, if the form tells.
fn turned(mesh: &Mesh, edges: &Edges, either_way: bool) -> Option<Vec<bool>> {
    let count = mesh.triangles.len();
    let (mut turn, mut piece) = (vec![false; count], vec![usize::MAX; count]);
    for first in 0..count {
        if piece[first] != usize::MAX {
            continue;
        }
        piece[first] = first;
        let (mut members, mut next) = (vec![first], 0);
        while let Some(&triangle) = members.get(next) {
            next += 1;
            for side in 3 * triangle..3 * triangle + 3 {
                let edge = &edges.list[edges.of_side[side] as usize];
                if edge.uses != 2 {
                    continue;
                }
                let other = edge.sides[usize::from(edge.sides[0] as usize == side)] as usize / 3;
                let wanted = turn[triangle] != same_way(mesh, edge.sides);
                if piece[other] == usize::MAX {
                    (piece[other], turn[other]) = (first, wanted);
                    members.push(other);
                } else if turn[other] != wanted {
                    return None;
                }
            }
        }
        let limit = largest(mesh, &members);
        let vote = |turned: bool| -> f64 {
            members.iter().filter(|&&t| turn[t] == turned).map(|&t| mesh.area_of(t).min(limit)).sum()
        };
        let [turned, kept] = [true, false].map(vote);
        let open = either_way || turned.min(kept) >= FEWER * (turned + kept);
        let out = || outwardness_of(members.iter().map(|&t| wound(mesh, t, turn[t])));
        let told = if open { out().filter(|out| out.abs() > CLEARLY) } else { None };
        if told.map_or(turned > kept, |out| out < 0.0) {
            members.iter().for_each(|&t| turn[t] = !turn[t]);
        }
    }
    Some(turn)
}

/// The corners of a triangle, the other way round if it is turned.
fn wound(mesh: &Mesh, triangle: usize, turned: bool) -> [Point; 3] {
    let [a, b, c] = mesh.corners(triangle);
    if turned { [a, c, b] } else { [a, b, c] }
}

/// The largest area that counts, a few times the median: a single spike must not turn a whole scan.
fn largest(mesh: &Mesh, members: &[usize]) -> f64 {
    let mut areas: Vec<f64> = members.iter().map(|&t| mesh.area_of(t)).collect();
    let middle = areas.len() / 2;
    let (_, median, _) = areas.select_nth_unstable_by(middle, f64::total_cmp);
    4.0 * *median
}

/// Six times the enclosed volume, about the first vertex: positive if the triangles face outwards.
fn volume(mesh: &Mesh) -> f64 {
    let origin = mesh.points[0];
    let tetrahedron = |t: usize| {
        let [a, b, c] = mesh.corners(t).map(|p| p - origin);
        a.dot(&b.cross(&c))
    };
    (0..mesh.triangles.len()).map(tetrahedron).sum()
}
