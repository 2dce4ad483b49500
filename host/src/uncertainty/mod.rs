//! How far each vertex of a completed mesh may be off.
//!
//! What is known at a vertex ([`cue`]) are the deviation that the scan leaves within the span of the modes
//! ([`posterior`]: weights and pose together) and the way along the surface to the nearest measured vertex
//! ([`path_lengths`](crate::surface::path_lengths)), with which grows what the modes do not explain. The trainer's calibration
//! ([`lacuna::format::Calibration`]) makes one number of them ([`expected`]): 68 % of all true errors lie below.
//! Where the class is harder to predict than elsewhere, the model says by how much ([`factors`]).
//! A measured vertex is off as the scan is, by what it shows and by what it does not show: if it was stitched from several
//! views ([`hidden`]), and between points that are far apart ([`coarse`]).
//! What the posterior says of the pose as a whole ([`spread`]) goes into the verdict.

pub mod coarse;
pub mod cue;
pub mod expected;
pub mod factors;
pub mod hidden;
pub mod posterior;
pub mod spread;

pub use cue::Cue;
pub use expected::{Expected, Share, shares};
