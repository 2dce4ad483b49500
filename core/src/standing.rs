//! How a measured point lies to the surface that was fitted together with the pose: part of it, or clutter.

use crate::model::Model;
use crate::pose::dot;
use crate::pose_row::steepness;
use crate::sample::far;

/// Points farther than this from the jointly fitted surface are clutter, class millimetres.
pub const CLUTTER: f32 = 8.0;
/// Points nearer than this to it that face its way are inliers, class millimetres.
pub const INLIER: f32 = 3.0;

/// Of a class learned from fewer shapes than this, what is beyond the band may be farther off the mean: a side of a whole femur is,
/// with 8 shapes.
const MANY: f32 = 20.0;

/// How a point lies to the jointly fitted surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Standing {
    /// Near it and facing its way.
    Inlier,
    /// Neither near nor far, or where nothing is known of it.
    Other,
    /// Far from it though inside the band.
    Clutter,
    /// Outside the band, far in front of the mean.
    Beyond,
}

/// Distance and gradient of a surface.
type Sample = (f32, [f32; 3]);

impl Standing {
    /// Judges a point and its normal (voxels) against the surface that `sample` tells distance and gradient of; it tells nothing
    /// outside the band.
    pub fn of(
        model: &Model<'_>,
        point: [f32; 3],
        normal: [f32; 3],
        mut sample: impl FnMut([f32; 3]) -> Option<Sample>,
    ) -> Self {
        match sample(point) {
            Some(sample) => Self::from_sample(model, sample, normal),
            None => Self::beyond(model, point),
        }
    }

    /// The same of a point where distance and gradient are known.
    pub fn from_sample(model: &Model<'_>, (distance, gradient): Sample, normal: [f32; 3]) -> Self {
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

    /// In front of the band only the mean is known.
    fn beyond(model: &Model<'_>, point: [f32; 3]) -> Self {
        let Some((distance, gradient)) = far(model, point) else { return Self::Other };
        let few = (MANY / model.header().shapes.max(1) as f32).max(1.0);
        let limit = few * CLUTTER * model.header().scales.millimetre * steepness(gradient);
        if distance > limit { Self::Beyond } else { Self::Other }
    }

    /// Whether a point is left out of the hull: a collar would draw the surface to where the band ends, 20 mm off a neck.
    pub const fn is_left_out(self) -> bool {
        matches!(self, Self::Clutter | Self::Beyond)
    }
}
