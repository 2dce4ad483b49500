//! Makes the rim of an extracted surface presentable: marching cubes ends in a staircase where the stored
//! voxels end.

use super::{boundary_edges, carry, keep_triangles};
use crate::mesh::{Mesh, Vector};
use std::collections::BTreeMap;

/// Times the teeth are cut.
const CUTS: usize = 3;
/// Rounds the rim is smoothed, in rounds of a grid as fine as the model's: over five voxels, and over three to four
/// where the mesh is that coarse, because the rings behind the rim are few there and leave the surface with it.
const ROUNDS: usize = 22;
const COARSE_ROUNDS: usize = 12;
/// Share of the rim's motion that reaches the next ring of vertices inside, and rings it is carried, there.
const FADE: f64 = 0.75;
const RINGS: usize = 4;

/// Cuts single triangles that stick out of the rim and smooths the rest along the rim. The rings behind the rim
/// follow within the surface, so that no triangle is crushed; farther inside vertices stay where they are.
/// `factor` is how much finer than the model's voxels the mesh is: steps of the rim are as many times longer, and
/// smoothing, which spreads with the root of its rounds, takes the square of it.
pub fn trim_rim(mesh: &Mesh, factor: usize) -> Mesh {
    let mut mesh = mesh.clone();
    for _ in 0..CUTS {
        mesh = without_teeth(&mesh);
    }
    let rounds = if factor > 1 { ROUNDS } else { COARSE_ROUNDS };
    let smoothed = smooth(&mesh, rounds * factor * factor);
    if smoothed.iter().all(Option::is_none) {
        return mesh;
    }
    let normals = mesh.vertex_normals();
    let carried = carry(&mesh, &smoothed, libm::pow(FADE, 1.0 / factor as f64), RINGS * factor);
    let inner = |v: usize| carried[v] - normals[v] * carried[v].dot(&normals[v]);
    for (v, motion) in smoothed.iter().enumerate() {
        mesh.points[v] += motion.unwrap_or_else(|| inner(v));
    }
    mesh
}

/// The mesh without triangles of which two sides are on the rim.
fn without_teeth(mesh: &Mesh) -> Mesh {
    let mut rim = boundary_edges(mesh);
    rim.iter_mut().for_each(|edge| edge.sort_unstable());
    rim.sort_unstable();
    let open = |t: usize| {
        let [a, b, c] = mesh.triangles[t];
        let sides = [[a, b], [b, c], [c, a]].map(|[p, q]| [p.min(q), p.max(q)]);
        sides.iter().filter(|side| rim.binary_search(side).is_ok()).count()
    };
    keep_triangles(mesh, |t| open(t) < 2)
}

/// Where rim vertices go that are moved towards the middle of their neighbours on the rim again and again; `None`
/// inside.
fn smooth(mesh: &Mesh, rounds: usize) -> Vec<Option<Vector>> {
    let rim = boundary_edges(mesh);
    let mut places: BTreeMap<u32, Vector> =
        rim.as_flattened().iter().map(|&v| (v, mesh.points[v as usize].coords)).collect();
    for _ in 0..rounds {
        let mut sums: BTreeMap<u32, (Vector, f64)> = BTreeMap::new();
        for &[a, b] in &rim {
            for (to, from) in [(a, b), (b, a)] {
                let entry = sums.entry(to).or_default();
                entry.0 += places[&from];
                entry.1 += 1.0;
            }
        }
        for (vertex, (sum, count)) in sums {
            // Where two rims meet there is no way along.
            if count == 2.0 {
                places.entry(vertex).and_modify(|place| *place = (*place + sum / count) / 2.0);
            }
        }
    }
    let motion = |v: u32| places.get(&v).map(|place| place - mesh.points[v as usize].coords);
    (0..mesh.points.len() as u32).map(motion).collect()
}

#[cfg(test)]
mod tests {
    use super::super::shapes::sheet;
    use super::*;
    use crate::mesh::Point;

    #[test]
    fn a_tooth_is_cut_and_a_closed_mesh_is_left_alone() {
        let mut mesh = sheet(4);
        let whole = trim_rim(&mesh, 1).triangles.len();
        let tip = mesh.points.len() as u32;
        mesh.points.push(Point::new(2.5, -1.0, 0.0));
        let [a, b] = boundary_edges(&mesh)[0];
        mesh.triangles.push([b, a, tip]);
        assert_eq!(trim_rim(&mesh, 1).triangles.len(), whole);
        let ball = super::super::shapes::ball(12, 4.0);
        assert_eq!(trim_rim(&ball, 1), ball);
    }
}
