//! Where the points of a scan are, each place once.

use crate::mesh::{Mesh, Vector};
use rustc_hash::FxHashMap;

/// Where a scan's points are: triangles that share no vertices have copies of each.
pub struct Places {
    /// The first of the points at each point's place; the point itself where it is not used.
    pub first: Vec<usize>,
    /// First points of places at which the surface faces one way.
    pub used: Vec<usize>,
    /// The way that it faces there, of unit length; elsewhere the point's own.
    pub facing: Vec<Vector>,
}

impl Places {
    /// Those of a scan.
    pub fn of(scan: &Mesh) -> Self {
        // Of a mesh it is the triangles that are used, whatever normals its file gives.
        let mut facing = if scan.is_cloud() { scan.vertex_normals() } else { scan.normals_of_triangles() };
        let mut sums: FxHashMap<[u64; 3], (usize, Vector, f64)> = FxHashMap::default();
        let mut first = Vec::with_capacity(facing.len());
        for (i, (point, normal)) in scan.points.iter().zip(&facing).enumerate() {
            // 0 and -0 are one place.
            let place = point.coords.map(|c| (c + 0.0).to_bits()).into();
            let (at, sum, count) = sums.entry(place).or_insert((i, Vector::zeros(), 0.0));
            (*sum, *count) = (*sum + normal, *count + 1.0);
            first.push(*at);
        }
        let mut used = Vec::with_capacity(sums.len());
        for (at, sum, count) in sums.into_values() {
            // Two sides of a sheet without thickness face both ways.
            if sum.norm() > 0.5 * count {
                facing[at] = sum.normalize();
                used.push(at);
            }
        }
        used.sort_unstable();
        for (i, at) in first.iter_mut().enumerate() {
            if used.binary_search(at).is_err() {
                *at = i;
            }
        }
        Self { first, used, facing }
    }

    /// Some of those that are used, `most` at most.
    pub fn samples(&self, most: usize) -> Vec<usize> {
        self.used.iter().step_by(self.used.len().div_ceil(most).max(1)).copied().collect()
    }
}
