//! Takes the roughness off a surface and leaves its shape: Taubin 1995, a signal processing approach to fair surface
//! design.

use super::Edges;
use crate::mesh::{Mesh, Vector};
use rayon::prelude::*;

/// Share of the way towards the mean of the neighbours, and of the way back that keeps the volume. Waves along the
/// surface pass up to an eigenvalue of 1/λ - 1/μ = 0.21 of the graph's Laplacian: those longer than 14 edges.
const TOWARDS: f64 = 0.5;
const BACK: f64 = 0.56;

/// Moves every inner vertex towards the mean of its neighbours and back, `rounds` times; the rim stays. Connectivity
/// stays as well; normals are dropped.
pub fn fair(mesh: &Mesh, rounds: usize) -> Mesh {
    let neighbours = inner_neighbours(mesh);
    let mut points = mesh.points.clone();
    for share in std::iter::repeat_n([TOWARDS, -BACK], rounds).flatten() {
        points = (0..points.len())
            .into_par_iter()
            .map(|v| {
                let near = &neighbours[v];
                let ways: Vector = near.iter().map(|&to| points[to as usize] - points[v]).sum();
                points[v] + ways * (share / near.len().max(1) as f64)
            })
            .collect();
    }
    Mesh { points, normals: Vec::new(), triangles: mesh.triangles.clone() }
}

/// The neighbours of each vertex; none for vertices on the rim.
fn inner_neighbours(mesh: &Mesh) -> Vec<Vec<u32>> {
    let mut neighbours = vec![Vec::new(); mesh.points.len()];
    let edges = Edges::of(mesh);
    for edge in &edges.list {
        let [a, b] = edge.ends;
        neighbours[a as usize].push(b);
        neighbours[b as usize].push(a);
    }
    for edge in edges.list.iter().filter(|edge| edge.uses != 2) {
        edge.ends.iter().for_each(|&v| neighbours[v as usize].clear());
    }
    neighbours
}

#[cfg(test)]
mod tests {
    use super::super::shapes::{ball, sheet, volume_of};
    use super::*;

    #[test]
    fn a_rough_sheet_becomes_smooth_and_its_rim_stays() {
        let flat = sheet(20);
        let mut rough = flat.clone();
        let inner = |v: usize| (1..19).contains(&(v % 20)) && (1..19).contains(&(v / 20));
        (0..400).filter(|&v| inner(v)).for_each(|v| rough.points[v].z = if v % 3 == 0 { 0.4 } else { -0.2 });
        let faired = fair(&rough, 10);
        let highest = |mesh: &Mesh| mesh.points.iter().map(|p| p.z.abs()).fold(0.0, f64::max);
        assert!(highest(&faired) < 0.2 * highest(&rough), "{}", highest(&faired));
        (0..400).filter(|&v| !inner(v)).for_each(|v| assert_eq!(faired.points[v], flat.points[v]));
    }

    #[test]
    fn a_ball_keeps_its_volume() {
        let mesh = ball(32, 12.0);
        let change = volume_of(&fair(&mesh, 10)) / volume_of(&mesh) - 1.0;
        assert!(change.abs() < 0.005, "{change}");
    }

    #[test]
    fn odd_meshes_do_no_harm() {
        assert_eq!(fair(&Mesh::default(), 3), Mesh::default());
        let mut mesh = sheet(3);
        mesh.triangles = vec![[0, 1, 4], [0, 1, 4], [0, 1, 3], [2, 2, 2]];
        assert!(fair(&mesh, 3).points.iter().all(|p| p.iter().all(|c| c.is_finite())));
    }
}
