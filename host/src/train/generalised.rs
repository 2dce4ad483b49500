//! Generalised alignment: every shape to the mean of all, again and again, none of them the pattern.
//!
//! The mean is the mean of the signed distances of the shapes where they lie so far. First each shape is drawn to it by
//! similarities, on distances in both directions, from the shape's points to the mean and from the mean's points to
//! the shape, along the normals: rims that end elsewhere and dense places weigh nothing. Then by what a similarity
//! explains of a smooth deformation, see [`super::deform`]. The mean scale of all shapes stays one.

use super::deform::drawn;
use crate::mesh::{Point, Vector, bounds};
use crate::points::OrientedPoints;
use crate::raster;
use crate::register::field::Field;
use crate::register::probe::{Probe, Sums};
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

/// Gates of the rounds by similarities, class millimetres; each round takes a new mean.
const GATES: [f64; 12] = [24.0, 20.0, 16.0, 14.0, 12.0, 12.0, 10.0, 10.0, 10.0, 10.0, 10.0, 10.0];
/// Gauss-Newton steps of such a round.
const STEPS: usize = 2;
/// Rounds by deformations.
const BENT: usize = 8;
/// Distances beyond this say little about the mean, class millimetres.
const FAR: f32 = 30.0;
/// Nodes of the mean's lattice along its longest side.
const NODES: f64 = 56.0;

/// Moves the shapes to their mean: `motions` take them to a common frame, roughly before and well afterwards.
pub fn towards_mean(shapes: &[Shape], motions: &mut [Similarity3<f64>]) {
    for gate in GATES {
        centre_scales(motions);
        let (mean, to_mean) = mean(shapes, motions);
        let pattern = Probe::of_all(&mean.samples);
        motions.par_iter_mut().zip(shapes).for_each(|(motion, shape)| {
            *motion = to_mean.inverse() * stepped(shape, &mean, &pattern, to_mean * *motion, gate);
        });
    }
    for _ in 0..BENT {
        centre_scales(motions);
        let (mean, to_mean) = mean(shapes, motions);
        motions.par_iter_mut().zip(shapes).for_each(|(motion, shape)| {
            *motion = to_mean.inverse() * drawn(&mean, &shape.points, &(to_mean * *motion));
        });
    }
    centre_scales(motions);
}

/// A shape's pose after steps on distances in both directions; `pattern` are the mean's points.
fn stepped(
    shape: &Shape,
    mean: &Field,
    pattern: &Probe,
    mut pose: Similarity3<f64>,
    gate: f64,
) -> Similarity3<f64> {
    let probe = Probe::of_all(&shape.points);
    for _ in 0..STEPS {
        let mut sums = Sums::about(probe.middle(&pose));
        probe.add(mean, &pose, gate, &mut sums);
        pattern.add_back(&shape.field, &(pose * shape.to_field.inverse()), gate, &mut sums);
        pose = sums.moved(mean, &pose);
    }
    pose
}

/// The mean scale becomes one.
fn centre_scales(motions: &mut [Similarity3<f64>]) {
    let growth = motions.iter().map(|m| libm::log(m.scaling())).sum::<f64>() / motions.len().max(1) as f64;
    let back = Similarity3::from_scaling(libm::exp(-growth));
    motions.iter_mut().for_each(|motion| *motion = back * *motion);
}

/// From a voxel of the mean to a shape's field, and the length of the field's voxels in the mean's.
struct Way(Similarity3<f64>, f32);

/// The mean shape, and the transform from the common frame to its voxels.
fn mean(shapes: &[Shape], motions: &[Similarity3<f64>]) -> (Field, Similarity3<f64>) {
    let moved = shapes.iter().zip(motions).flat_map(|(s, m)| s.points.points.iter().map(move |p| m * p));
    let (low, high) = bounds(moved).unwrap_or_default();
    let spacing = (high - low).max() / NODES;
    let origin = low - Vector::repeat(3.0 * spacing);
    let sides: [usize; 3] = (high - low).map(|length| (length / spacing).ceil() as usize + 7).into();
    let to_mean = Similarity3::from_scaling(1.0 / spacing) * Translation3::from(-origin.coords);
    let way = |(shape, motion): (&Shape, &Similarity3<f64>)| {
        let way = shape.to_field * motion.inverse() * to_mean.inverse();
        Way(way, (1.0 / way.scaling()) as f32)
    };
    let ways: Vec<Way> = shapes.iter().zip(motions).map(way).collect();
    let millimetres = shapes.iter().zip(&ways).map(|(shape, way)| shape.field.millimetre * f64::from(way.1));
    let millimetre = millimetres.sum::<f64>() / shapes.len().max(1) as f64;
    let value = |i: usize| {
        let node = Point::from(raster::voxel(sides, i).map(|v| v as f64));
        mean_distance(shapes, &ways, &node, FAR * millimetre as f32)
    };
    let values: Vec<f32> = (0..raster::len(sides)).into_par_iter().map(value).collect();
    (Field::of_values(sides, &values, millimetre), to_mean)
}

/// Mean distance at a node, NaN where fewer than half of the shapes know theirs or it is `far` away.
fn mean_distance(shapes: &[Shape], ways: &[Way], node: &Point, far: f32) -> f32 {
    let (mut sum, mut count) = (0.0, 0);
    for (shape, Way(way, long)) in shapes.iter().zip(ways) {
        if let Some((distance, _)) = shape.field.at((way * node).coords.map(|c| c as f32).into()) {
            sum += (distance * long).clamp(-far, far);
            count += 1;
        }
    }
    let mean = sum / count as f32;
    if 2 * count > shapes.len() && mean.abs() < 0.9 * far { mean } else { f32::NAN }
}
