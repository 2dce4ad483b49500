//! Makes the rim of an extracted surface presentable: marching cubes ends in a staircase where the stored
//! voxels end.

use super::{boundary_edges, keep_triangles};
use crate::mesh::{Mesh, Point};

/// Times the teeth are cut and the rim is smoothed.
const CUTS: usize = 3;
const ROUNDS: usize = 12;

/// Cuts single triangles that stick out of the rim and smooths the rest along the rim. The vertices inside
/// stay where they are.
pub fn trim_rim(mesh: &Mesh) -> Mesh {
    let mut mesh = mesh.clone();
    for _ in 0..CUTS {
        mesh = without_teeth(&mesh);
    }
    smooth(&mut mesh);
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

/// Moves rim vertices towards the middle of their neighbours on the rim.
fn smooth(mesh: &mut Mesh) {
    let rim = boundary_edges(mesh);
    for _ in 0..ROUNDS {
        let mut sums: std::collections::BTreeMap<u32, (nalgebra::Vector3<f64>, f64)> = Default::default();
        for &[a, b] in &rim {
            for (to, from) in [(a, b), (b, a)] {
                let entry = sums.entry(to).or_default();
                entry.0 += mesh.points[from as usize].coords;
                entry.1 += 1.0;
            }
        }
        for (vertex, (sum, count)) in sums {
            if count == 2.0 {
                let point = &mut mesh.points[vertex as usize];
                *point = Point::from((point.coords + sum / count) / 2.0);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::shapes::sheet;
    use super::*;

    #[test]
    fn a_tooth_is_cut_and_a_closed_mesh_is_left_alone() {
        let mut mesh = sheet(4);
        let whole = trim_rim(&mesh).triangles.len();
        let tip = mesh.points.len() as u32;
        mesh.points.push(Point::new(2.5, -1.0, 0.0));
        let [a, b] = boundary_edges(&mesh)[0];
        mesh.triangles.push([b, a, tip]);
        assert_eq!(trim_rim(&mesh).triangles.len(), whole);
        let ball = super::super::shapes::ball(12, 4.0);
        assert_eq!(trim_rim(&ball), ball);
    }
}
