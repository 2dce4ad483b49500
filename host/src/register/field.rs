//! What a scan is registered to: signed distances on a grid and oriented points of the surface, in voxels.

use crate::mesh::{Point, Vector};
use crate::points::{OrientedPoints, thin};
use crate::surface::{Volume, marching_cubes};
use crate::train::distance::Surface;
use crate::train::volume::{Lattice, sample};
use lacuna::Model;

/// Distances and points of the shape that is looked for.
pub struct Field {
    sides: [usize; 3],
    /// Signed distances in voxels, NaN where unknown or beyond the rim.
    distances: Vec<f32>,
    /// Points on the surface, voxels.
    pub samples: OrientedPoints,
    /// Longest side of the surface's bounds, voxels.
    pub size: f64,
}

impl Field {
    /// The mean shape of a model.
    pub fn of_model(model: &Model<'_>) -> Self {
        let mut means = vec![0i16; model.voxels()];
        for brick in model.bricks() {
            for voxel in 0..brick.voxels() {
                means[brick.first + voxel] = brick.mean(voxel);
            }
        }
        Self::new(model.grid().sides().map(usize::from), crate::fit::dense(model, &means))
    }

    /// A mesh, and the transform from its frame to voxels: (scale, translation).
    pub fn of_surface(surface: &Surface, low: Point, high: Point) -> (Self, f64, Vector) {
        let spacing = (high - low).max() / 48.0;
        let margin = 4.0 * spacing;
        let sides = (high - low).map(|length| ((length + 2.0 * margin) / spacing).ceil() as usize + 1).into();
        let lattice = Lattice { origin: low - Vector::repeat(margin), spacing, sides };
        let places: Vec<u32> = (0..lattice.len() as u32).collect();
        let volume = sample(surface, &lattice, &places);
        let known = |(&d, &border): (&f32, &bool)| if border { f32::NAN } else { d / spacing as f32 };
        let distances = volume.distances.iter().zip(&volume.border).map(known).collect();
        (Self::new(sides, distances), 1.0 / spacing, -lattice.origin.coords / spacing)
    }

    fn new(sides: [usize; 3], distances: Vec<f32>) -> Self {
        let mesh = marching_cubes(&Volume { dims: sides, values: &distances }, &Point::origin(), 1.0);
        let size = mesh.bounds().map_or(1.0, |(low, high)| (high - low).max());
        let samples = thin(&mesh, size / 22.0);
        Self { sides, distances, samples, size }
    }

    /// Distance at the nearest voxel, NaN where unknown.
    pub fn distance(&self, p: &Point) -> f32 {
        self.voxel(p).map_or(f32::NAN, |index| self.distances[index])
    }

    fn voxel(&self, p: &Point) -> Option<usize> {
        let [width, height, depth] = self.sides;
        let at = |x: f64, side: usize| (x > -0.5 && x < side as f64 - 0.5).then_some((x + 0.5) as usize);
        Some((at(p.z, depth)? * height + at(p.y, height)?) * width + at(p.x, width)?)
    }

    /// Whether an oriented point lies within `reach` of the surface and faces its way.
    pub fn agrees(&self, p: &Point, normal: &Vector, reach: f32) -> bool {
        let distance = self.distance(p);
        if distance.is_nan() || distance.abs() > reach {
            return false;
        }
        let along = |axis: usize| {
            let mut step = Vector::zeros();
            step[axis] = 1.0;
            f64::from(self.distance(&(p + step)) - self.distance(&(p - step)))
        };
        let gradient = Vector::new(along(0), along(1), along(2));
        gradient.dot(normal) > 0.6 * gradient.norm()
    }
}
