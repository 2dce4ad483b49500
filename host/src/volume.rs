//! Signed distances of surfaces on a lattice: of training shapes, of a scan, of a target.

use crate::distance::{Distance, Surface};
use crate::mesh::Point;
use crate::raster;

/// A grid in space, in the meshes' unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lattice {
    /// Centre of voxel (0, 0, 0).
    pub origin: Point,
    /// Edge of a voxel.
    pub spacing: f64,
    /// Voxels along x, y, z.
    pub sides: [usize; 3],
}

impl Lattice {
    /// Voxels in all.
    pub fn len(&self) -> usize {
        raster::len(self.sides)
    }

    /// Whether there is no voxel.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Place of a voxel in an x-fastest array.
    pub fn index(&self, voxel: [usize; 3]) -> usize {
        raster::index(self.sides, voxel)
    }

    /// Voxel at a place in an x-fastest array.
    pub fn voxel(&self, index: usize) -> [usize; 3] {
        raster::voxel(self.sides, index)
    }

    /// Centre of a voxel.
    pub fn point(&self, voxel: [usize; 3]) -> Point {
        self.origin + nalgebra::Vector3::from(voxel.map(|v| v as f64 * self.spacing))
    }

    /// Every `stride`-th voxel and one beyond: the lattice of nodes.
    pub fn coarse(&self, stride: usize) -> Self {
        let sides = self.sides.map(|side| side / stride + 1);
        Self { origin: self.origin, spacing: self.spacing * stride as f64, sides }
    }
}

/// Distances at a list of voxels.
pub struct Volume {
    /// Signed distances, in the meshes' unit.
    pub distances: Vec<f32>,
    /// Whether the closest point is on the mesh's border.
    pub border: Vec<bool>,
}

/// The distance, measured to the tangent plane where the closest point is on the border: the surface goes on
/// straight for a little beyond its rim instead of ending in a jump of the sign.
fn extended(p: &Point, found: &Distance) -> f64 {
    match found.normal.try_normalize(0.0) {
        Some(normal) if found.on_border => (p - found.closest).dot(&normal),
        _ => found.value,
    }
}

/// Exact signed distances at `places` of the lattice (in ascending order, so that neighbours bound each other).
pub fn sample(surface: &Surface, lattice: &Lattice, places: &[u32]) -> Volume {
    let mut volume =
        Volume { distances: Vec::with_capacity(places.len()), border: Vec::with_capacity(places.len()) };
    let mut last: Option<(Point, f64)> = None;
    for &place in places {
        let p = lattice.point(lattice.voxel(place as usize));
        let bound = last.map_or(f64::INFINITY, |(q, d)| (d.abs() + (p - q).norm()) * 1.000_001 + 1e-9);
        let found = surface.distance(&p, bound).or_else(|| surface.distance(&p, f64::INFINITY));
        // Every surface has a closest point; one that had none would be infinitely far away.
        volume.distances.push(found.as_ref().map_or(f32::INFINITY, |found| extended(&p, found) as f32));
        volume.border.push(found.as_ref().is_none_or(|found| found.on_border));
        last = found.map(|found| (p, found.value)).or(last);
    }
    volume
}
