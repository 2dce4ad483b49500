//! Partial scans of a training shape: what a scanner sees of it from sides that show much of it.

use crate::complete::viewable::facing;
use crate::mesh::{Mesh, Point, Vector};
use crate::synth::{Kind, Random, ScannerSettings, scan};
use nalgebra::{Matrix4, Similarity3, Translation3, UnitQuaternion};

/// Directions of which one is drawn.
const DIRECTIONS: usize = 60;
/// Least share of what the best direction shows that a direction must show: who scans shows as much as can be seen.
const WORTHWHILE: f64 = 0.9;
/// Half the longest extent of a shape in front of the simulated scanner, its millimetres.
const EXTENT: f64 = 130.0;

/// A partial scan in the frame of its shape.
pub struct Partial {
    /// The scan.
    pub mesh: Mesh,
    /// Which vertices of the shape it shows nothing of.
    pub missing: Vec<bool>,
}

/// Scans a shape from a random side that shows much of it. The same seed gives the same scan.
pub fn partial(shape: &Mesh, kind: Kind, seed: u64) -> Partial {
    let mut random = Random::new(seed, 77);
    let to_scanner = turn(shape, &mut random);
    let turned = Mesh { normals: vec![], ..shape.moved(&to_scanner) };
    let settings = ScannerSettings::small();
    let made = scan(&turned, kind, &settings, seed);
    let back = to_scanner.inverse().to_homogeneous()
        * made.model_to_scan.try_inverse().unwrap_or_else(Matrix4::identity);
    let mut mesh = made.mesh;
    mesh.points.iter_mut().for_each(|p| *p = back.transform_point(p));
    mesh.normals.clear();
    Partial { mesh, missing: made.missing }
}

/// Brings a random side of the shape before the scanner, in a size that fills its picture.
fn turn(shape: &Mesh, random: &mut Random) -> Similarity3<f64> {
    let (low, high) = shape.bounds().unwrap_or((Point::origin(), Point::origin()));
    let middle = nalgebra::center(&low, &high);
    let scale = 2.0 * EXTENT / (high - low).max().max(f64::MIN_POSITIVE);
    let directions: Vec<Vector> = (0..DIRECTIONS).map(|_| random.direction()).collect();
    let shown: Vec<f64> = directions.iter().map(|towards| facing(shape, towards)).collect();
    let best = shown.iter().copied().fold(0.0, f64::max);
    let good = (0..DIRECTIONS).find(|&i| shown[i] >= WORTHWHILE * best).unwrap_or(0);
    let rotation = UnitQuaternion::rotation_between(&directions[good], &Vector::z())
        .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector::x_axis(), std::f64::consts::PI));
    let roll = UnitQuaternion::from_axis_angle(&Vector::z_axis(), random.range(0.0, std::f64::consts::TAU));
    let turn = roll * rotation;
    Similarity3::from_parts(Translation3::from(-(turn * middle.coords) * scale), turn, scale)
}
