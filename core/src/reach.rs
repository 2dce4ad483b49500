//! How far the points of a scan reach: which voxels they can claim for the hull.

use crate::error::{Error, OptionName};
use crate::format::PER_VOXEL;
use crate::model::Model;

/// How far a point reaches, 1/256 voxel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Reach {
    /// In front of the surface, and claimed behind it; 1 to [`Reach::MOST_FRONT`].
    pub front: u16,
    /// Behind the surface, in the hull; at most `front`.
    pub behind: u16,
    /// Sideways; about one point spacing, [`Reach::LEAST_LATERAL`] to [`Reach::MOST_LATERAL`].
    pub lateral: u16,
}

impl Reach {
    /// Farthest in front of the surface, 7.5 voxels: the widest distance that a [`Target`](crate::hull::Target) holds is 8.
    pub const MOST_FRONT: u16 = 1920;
    /// Least reach sideways, a quarter of a voxel.
    pub const LEAST_LATERAL: u16 = 64;
    /// Farthest sideways, four voxels.
    pub const MOST_LATERAL: u16 = 1024;

    /// The reach a model was made for, one voxel sideways.
    pub fn of(model: &Model<'_>) -> Self {
        let scales = &model.header().scales;
        let units = |voxels: f32| (voxels * PER_VOXEL) as u16;
        Self { front: units(scales.front), behind: units(scales.behind), lateral: 256 }
    }

    /// Whether the hull's integers hold this reach.
    ///
    /// # Errors
    /// Which part of it is out of range.
    pub const fn check(&self) -> Result<(), Error> {
        if self.front > Self::MOST_FRONT || self.behind > self.front || self.front == 0 {
            return Err(Error::Option(OptionName::Reach));
        }
        if self.lateral < Self::LEAST_LATERAL || self.lateral > Self::MOST_LATERAL {
            return Err(Error::Option(OptionName::Lateral));
        }
        Ok(())
    }
}
