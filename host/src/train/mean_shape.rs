//! The mean shape: the mean of the signed distances of shapes where they lie.

use crate::mesh::{Point, Vector, bounds};
use crate::points::OrientedPoints;
use crate::raster;
use crate::register::field::Field;
use crate::register::probe::Probe;
use nalgebra::{Similarity3, Translation3};
use rayon::prelude::*;

/// A shape as the alignment sees it.
pub struct Shape {
    /// Its distances.
    pub field: Field,
    /// From its frame to the field's voxels.
    pub to_field: Similarity3<f64>,
    /// Points on it, in its frame.
    pub points: OrientedPoints,
}

/// Distances beyond this say little about the mean, class millimetres.
const FAR: f32 = 30.0;
/// Nodes of the mean's lattice along its longest side.
const NODES: f64 = 56.0;

/// From a voxel of the mean to a shape's field, and the length of the field's voxels in the mean's.
struct Way(Similarity3<f64>, f32);

/// A shape and its motion to the common frame.
type Placed<'a> = (&'a Shape, &'a Similarity3<f64>);

/// A mean shape.
pub struct Mean {
    /// Its distances.
    pub field: Field,
    /// Its points, voxels.
    pub pattern: Probe,
    /// From the common frame to its voxels.
    pub to_mean: Similarity3<f64>,
}

impl Mean {
    /// Of all shapes where they lie.
    pub fn of_all(shapes: &[Shape], motions: &[Similarity3<f64>]) -> Self {
        Self::of(&shapes.iter().zip(motions).collect::<Vec<_>>())
    }

    /// Of all but one of them.
    pub fn of_others(shapes: &[Shape], motions: &[Similarity3<f64>], but: usize) -> Self {
        let others = shapes.iter().zip(motions).enumerate().filter(|(i, _)| *i != but);
        Self::of(&others.map(|(_, placed)| placed).collect::<Vec<_>>())
    }

    fn of(placed: &[Placed]) -> Self {
        let (field, to_mean) = mean(placed);
        Self { pattern: Probe::of_all(&field.samples), field, to_mean }
    }

    /// A pose, from a shape's frame to the voxels, as a motion to the common frame.
    pub fn back(&self, pose: Similarity3<f64>) -> Similarity3<f64> {
        self.to_mean.inverse() * pose
    }
}

/// The distances of the mean shape, and the transform from the common frame to its voxels.
fn mean(placed: &[Placed]) -> (Field, Similarity3<f64>) {
    let moved = placed.iter().flat_map(|(s, m)| s.points.points.iter().map(move |p| *m * p));
    let (low, high) = bounds(moved).unwrap_or_default();
    let spacing = (high - low).max() / NODES;
    let origin = low - Vector::repeat(3.0 * spacing);
    let sides: [usize; 3] = (high - low).map(|length| (length / spacing).ceil() as usize + 7).into();
    let to_mean = Similarity3::from_scaling(1.0 / spacing) * Translation3::from(-origin.coords);
    let way = |(shape, motion): &Placed| {
        let way = shape.to_field * motion.inverse() * to_mean.inverse();
        Way(way, (1.0 / way.scaling()) as f32)
    };
    let ways: Vec<Way> = placed.iter().map(way).collect();
    let millimetres =
        placed.iter().zip(&ways).map(|((shape, _), way)| shape.field.millimetre * f64::from(way.1));
    let millimetre = millimetres.sum::<f64>() / placed.len().max(1) as f64;
    let value = |i: usize| {
        let node = Point::from(raster::voxel(sides, i).map(|v| v as f64));
        mean_distance(placed, &ways, &node, FAR * millimetre as f32)
    };
    let values: Vec<f32> = (0..raster::len(sides)).into_par_iter().map(value).collect();
    (Field::of_values(sides, &values, millimetre), to_mean)
}

/// Mean distance at a node, NaN where fewer than half of the shapes know theirs or it is `far` away.
fn mean_distance(placed: &[Placed], ways: &[Way], node: &Point, far: f32) -> f32 {
    let (mut sum, mut count) = (0.0, 0);
    for ((shape, _), Way(way, long)) in placed.iter().zip(ways) {
        if let Some((distance, _)) = shape.field.at((way * node).coords.map(|c| c as f32).into()) {
            sum += (distance * long).clamp(-far, far);
            count += 1;
        }
    }
    let mean = sum / count as f32;
    if 2 * count > placed.len() && mean.abs() < 0.9 * far { mean } else { f32::NAN }
}
