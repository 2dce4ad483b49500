//! Which way triangles face: neighbours that contradict each other, and closed surfaces turned inside out.

use super::inwards::outwardness_of;
use super::{Checked, counted};
use crate::mesh::{Mesh, Point, Vector, twice_area_vector};
use crate::normals::View;
use crate::surface::Edges;

/// Turns the smaller side of contradicting winding round, and closed surfaces that face inwards; `edges` are those
/// of the mesh, whose triangles may have been there `either_way`.
pub(super) fn check(checked: &mut Checked, edges: &Edges, either_way: bool) {
    let contradicting = edges.list.iter().any(|e| e.uses == 2 && same_way(&checked.mesh, e.sides));
    if contradicting || either_way {
        match turned(&checked.mesh, edges, either_way) {
            Some(turn) => repair(checked, &turn, either_way),
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

fn repair(checked: &mut Checked, turn: &[bool], either_way: bool) {
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
    let way =
        if either_way { "inwards, of sheets with both sides," } else { "the other way than the neighbours" };
    checked.repaired(format!("{what} {way} turned round"));
}

/// Whether two sides run along their edge in the same direction.
fn same_way(mesh: &Mesh, sides: [u32; 2]) -> bool {
    let start = |side: u32| mesh.triangles[side as usize / 3][side as usize % 3];
    start(sides[0]) == start(sides[1])
}

/// A side of less than this share of a piece's area is the wrong one. Where both have more, the form must tell.
const FEWER: f64 = 0.4;
/// How clearly a piece must bulge to one side so that its form tells: scans of one view are at -0.08 to 0.46, those of faces
/// from 0.25 on. (Their small pieces are at -0.4 to 0.6, but face as the largest one does, if that is seen from one side.)
const CLEARLY: f64 = 0.15;

/// Which triangles must be turned so that all neighbours agree; none for a one-sided surface. In every piece the
/// side with the larger area stays, huge triangles counted as large ones; of sides of about the same area, and of those that
/// had been there `either_way`, the one that faces outwards, if the form tells.
fn turned(mesh: &Mesh, edges: &Edges, either_way: bool) -> Option<Vec<bool>> {
    let (mut turn, mut pieces) = agreeing(mesh, edges)?;
    pieces.sort_by_key(|members| std::cmp::Reverse(members.len()));
    let mut view = View::default();
    for (number, members) in pieces.iter().enumerate() {
        if is_wrong(mesh, members, &turn, (either_way, view)) {
            members.iter().for_each(|&t| turn[t] = !turn[t]);
        }
        if number == 0 {
            view = View::of(mean_normal(mesh, members, &turn));
        }
    }
    Some(turn)
}

/// Which triangles must be turned so that each agrees with the first of its connected piece, and these pieces; none for a
/// one-sided surface.
fn agreeing(mesh: &Mesh, edges: &Edges) -> Option<(Vec<bool>, Vec<Vec<usize>>)> {
    let count = mesh.triangles.len();
    let (mut turn, mut is_known, mut pieces) = (vec![false; count], vec![false; count], Vec::new());
    for first in 0..count {
        if is_known[first] {
            continue;
        }
        is_known[first] = true;
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
                if !is_known[other] {
                    (is_known[other], turn[other]) = (true, wanted);
                    members.push(other);
                } else if turn[other] != wanted {
                    return None;
                }
            }
        }
        pieces.push(members);
    }
    Some((turn, pieces))
}

/// Whether a piece that agrees faces the wrong way; `view` is that of the largest one, if it was looked at already.
fn is_wrong(mesh: &Mesh, members: &[usize], turn: &[bool], (either_way, view): (bool, View)) -> bool {
    let limit = largest(mesh, members);
    let vote = |turned: bool| -> f64 {
        members.iter().filter(|&&t| turn[t] == turned).map(|&t| mesh.area_of(t).min(limit)).sum()
    };
    let [turned, kept] = [true, false].map(vote);
    if !either_way && turned.min(kept) < FEWER * (turned + kept) {
        return turned > kept;
    }
    if let Some(side) = view.side_of(&mean_normal(mesh, members, turn)) {
        return side < 0.0;
    }
    let out = outwardness_of(members.iter().map(|&t| wound(mesh, t, turn[t])));
    out.filter(|out| out.abs() > CLEARLY).map_or(turned > kept, |out| out < 0.0)
}

/// The mean normal of some triangles, weighted with their areas: 1 long if they are in a plane.
fn mean_normal(mesh: &Mesh, members: &[usize], turn: &[bool]) -> Vector {
    let normal = |&t: &usize| twice_area_vector(&wound(mesh, t, turn[t]));
    let sum: Vector = members.iter().map(normal).sum();
    sum / members.iter().map(|t| normal(t).norm()).sum::<f64>().max(f64::MIN_POSITIVE)
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
