//! The float reference: the paper's equations, dense and literal, in `f64`.
//!
//! It exists to be compared with, not to be fast, and shares no code with the core: what both have in common
//! is the description, not a line. Every voxel of the grid is there, stored or not; box means are loops over
//! boxes; nothing is quantised. Lengths are in voxels, distances negative inside, arrays x fastest.
//!
//! | file | content |
//! |---|---|
//! | [`grid`] | places of samples in an array |
//! | [`pca`] | eqs. (4)-(5): mean, modes, standard deviations |
//! | [`hull`] | distances along the lines of sight, section 3.2 |
//! | [`global`] | eq. (9), the fixed point (11)-(13), the direct solution it converges to |
//! | [`nodes`] | the weight grid of the local fit: trilinear weights, active nodes, box means |
//! | [`local`] | the local fit as the core defines it |
//! | [`paper`] | the local fit as printed, eqs. (3) and (14)-(16) |

pub mod global;
pub mod grid;
pub mod hull;
pub mod local;
pub mod nodes;
pub mod paper;
pub mod pca;
#[cfg(test)]
mod toy;

pub use grid::Grid;
pub use hull::Reach;
pub use local::{Pass, Settings};
pub use pca::Model;

/// Measured signed distance of each voxel of a grid, voxels; `None` outside the hull.
pub type Hull = Vec<Option<f64>>;
