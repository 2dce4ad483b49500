//! What of a scan is not part of the class: hair, collar, table. It is left out of the completed mesh, measured,
//! and kept as pieces of their own where the user asks for it.

use super::merge::Merged;
use crate::distance::Surface;
use crate::mesh::Mesh;
use crate::surface::{keep, keep_triangles};
use rayon::prelude::*;

/// Label of a vertex of the scan that is not part of the class.
pub const CLUTTER: u8 = 2;
/// Farther than this from the completed mesh a scan is not represented by it, class millimetres.
pub const APART: f64 = 2.0;

/// The part of a scan that the completed mesh does not represent.
#[derive(Clone, Debug, Default)]
pub struct Clutter {
    /// Its surface, or its points where the scan is a cloud, in the scan's frame.
    pub mesh: Mesh,
    /// Its share of the scan: by area, or by the number of points.
    pub area_share: f64,
    /// Its area, scan units squared; 0 for a cloud.
    pub area: f64,
}

impl Clutter {
    /// What of `scan` is farther than `limit` (scan units) from the completed mesh.
    pub fn of(scan: &Mesh, completed: &Mesh, limit: f64) -> Self {
        let Some(surface) = Surface::new(completed) else { return Self::default() };
        let far: Vec<bool> = scan.points.par_iter().map(|p| surface.distance(p, limit).is_none()).collect();
        if scan.triangles.is_empty() {
            return Self::of_cloud(scan, &far);
        }
        // Whole triangles only: what touches the completed mesh is in it already.
        let left_out = |t: usize| scan.triangles[t].iter().all(|&v| far[v as usize]);
        let mesh = keep_triangles(scan, left_out);
        let area = mesh.area();
        Self { area_share: area / scan.area().max(f64::MIN_POSITIVE), area, mesh }
    }

    fn of_cloud(scan: &Mesh, far: &[bool]) -> Self {
        let mesh = keep(scan, |i| far[i]);
        Self { area_share: mesh.points.len() as f64 / far.len().max(1) as f64, area: 0.0, mesh }
    }

    /// Appends the clutter to a completed mesh, as pieces that share no vertex with it.
    pub fn append_to(&self, merged: &Merged) -> Merged {
        let mut all = merged.clone();
        all.mesh.append(&Mesh { normals: vec![], ..self.mesh.clone() });
        all.labels.resize(all.mesh.points.len(), CLUTTER);
        all.distances.resize(all.mesh.points.len(), 0.0);
        all.heights.resize(all.mesh.points.len(), 0.0);
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Point;

    fn sheet(z: f64) -> Mesh {
        let points = [[0., 0.], [4., 0.], [4., 4.], [0., 4.]].map(|[x, y]| Point::new(x, y, z)).to_vec();
        Mesh { points, normals: vec![], triangles: vec![[0, 1, 2], [0, 2, 3]] }
    }

    fn both(a: &Mesh, b: &Mesh) -> Mesh {
        let mut mesh = a.clone();
        mesh.append(b);
        mesh
    }

    #[test]
    fn what_is_far_is_measured_and_kept_apart() {
        let clutter = Clutter::of(&both(&sheet(0.1), &sheet(9.0)), &sheet(0.0), 2.0);
        assert_eq!((clutter.mesh.clone(), clutter.area, clutter.area_share), (sheet(9.0), 16.0, 0.5));
        let merged =
            Merged { mesh: sheet(0.0), labels: vec![1; 4], distances: vec![0.1; 4], heights: vec![0.1; 4] };
        let all = clutter.append_to(&merged);
        assert_eq!(all.labels, [1, 1, 1, 1, CLUTTER, CLUTTER, CLUTTER, CLUTTER]);
        assert_eq!(all.mesh.triangles[2..], [[4, 5, 6], [4, 6, 7]]);
        assert_eq!(all.distances.len(), 8);
    }

    #[test]
    fn points_of_a_cloud_count_one_by_one() {
        let mut cloud = both(&sheet(0.1), &sheet(9.0));
        cloud.triangles.clear();
        let clutter = Clutter::of(&cloud, &sheet(0.0), 2.0);
        assert_eq!((clutter.mesh.points.len(), clutter.area_share, clutter.area), (4, 0.5, 0.0));
    }

    #[test]
    fn nothing_is_left_out_of_a_scan_that_is_met() {
        assert_eq!(Clutter::of(&sheet(0.5), &sheet(0.0), 2.0).mesh, Mesh::default());
    }
}
