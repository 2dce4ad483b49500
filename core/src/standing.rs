//! How a measured point lies to the surface that was fitted together with the pose: part of it, or clutter.

use crate::cube::Cube;
use crate::model::Model;
use crate::pose::dot;
use crate::pose_row::steepness;

/// Points farther than this from the jointly fitted surface are clutter, class millimetres.
pub const CLUTTER: f32 = 8.0;
/// Points nearer than this to it that face its way are inliers, class millimetres.
pub const INLIER: f32 = 3.0;

/// How a point lies to the jointly fitted surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Standing {
    /// Near it and facing its way.
    Inlier,
    /// Neither near nor far, or outside the band.
    Other,
    /// Far from it though inside the band.
    Clutter,
}

impl Standing {
    /// Judges a point and its normal (voxels) against the surface of `cube`.
    pub fn of(cube: &mut Cube<'_, '_>, point: [f32; 3], normal: [f32; 3]) -> Self {
        let sample = cube.find(point).map(Cube::distance);
        Self::from_sample(cube.model(), sample, normal)
    }

    /// The same from the surface's distance and gradient at the point; `None` outside the band.
    pub fn from_sample(model: &Model<'_>, sample: Option<(f32, [f32; 3])>, normal: [f32; 3]) -> Self {
        let Some((distance, gradient)) = sample else { return Self::Other };
        let steepness = steepness(gradient);
        let millimetre = model.header().scales.millimetre * steepness;
        if distance.abs() > CLUTTER * millimetre {
            Self::Clutter
        } else if distance.abs() <= INLIER * millimetre && dot(gradient, normal) > 0.5 * steepness {
            Self::Inlier
        } else {
            Self::Other
        }
    }
}
