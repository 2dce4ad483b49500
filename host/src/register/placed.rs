//! Where a scan lies in the model: between the scan's frame and the model's voxels.

use crate::mesh::{Point, Vector};
use lacuna::{Model, Pose};
use nalgebra::Matrix3;

/// A scan's place in the model: q = pose(p - centre), in voxels.
#[derive(Clone, Copy, Debug)]
pub struct Placed {
    /// A point near the scan, subtracted first so that single precision suffices.
    pub centre: Point,
    /// From the centred scan to voxels.
    pub pose: Pose,
}

impl Placed {
    /// By a similarity transform from the scan to the model's frame, both in the model's unit.
    pub fn new(model: &Model<'_>, rotation: &Matrix3<f64>, scale: f64, translation: &Vector) -> Self {
        let header = model.header();
        let spacing = f64::from(header.spacing);
        let origin = Vector::from(header.origin.map(f64::from));
        // What maps to the middle of the grid.
        let middle = Vector::from(header.sides.map(|side| f64::from(side) / 2.0));
        let centre = rotation.transpose() * (middle * spacing + origin - translation) / scale;
        let pose = Pose {
            rotation: rotation.transpose().map(|c| c as f32).into(),
            scale: (scale / spacing) as f32,
            translation: middle.map(|c| c as f32).into(),
        };
        Self { centre: centre.into(), pose }
    }

    /// Of a scan that is in the model's frame.
    pub fn identity(model: &Model<'_>) -> Self {
        Self::new(model, &Matrix3::identity(), 1.0, &Vector::zeros())
    }

    /// A scan point in voxels.
    pub fn to_model(&self, p: &Point) -> Point {
        Point::from(Vector::from(self.to_voxels(p).map(f64::from)))
    }

    /// The same as the core takes it.
    pub fn to_voxels(&self, p: &Point) -> [f32; 3] {
        self.pose.apply((p - self.centre).map(|c| c as f32).into())
    }

    /// Size of the scan in terms of the class's: scan units a model unit.
    pub fn size(&self, model: &Model<'_>) -> f64 {
        1.0 / (f64::from(self.pose.scale) * f64::from(model.header().spacing))
    }

    /// One class millimetre, in the scan's unit.
    pub fn class_millimetre(&self, model: &Model<'_>) -> f64 {
        f64::from(model.header().scales.millimetre) / f64::from(self.pose.scale)
    }

    /// The same place for points around another centre.
    pub fn about(&self, centre: Point) -> Self {
        let translation = self.to_voxels(&centre);
        Self { centre, pose: Pose { translation, ..self.pose } }
    }

    /// A voxel position in the scan's frame.
    pub fn to_scan(&self, q: &Point) -> Point {
        let pose = &self.pose;
        let moved = (q.coords - Vector::from(pose.translation.map(f64::from))) / f64::from(pose.scale);
        let rotation = Matrix3::from_row_slice(&pose.rotation.concat()).map(f64::from);
        self.centre + rotation.transpose() * moved
    }
}
