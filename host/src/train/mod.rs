//! Training: meshes of one shape class become a model file.

pub mod align;
mod band;
pub mod calibration;
pub mod choice;
pub mod deform;
mod error;
pub mod factors;
mod footprint;
pub mod generalised;
pub mod grid;
pub mod held_out;
pub mod jitter;
pub mod leave_one_out;
pub mod line_of_sight;
mod mean_shape;
pub mod model_file;
pub mod pca;
mod plan;
pub mod prepared;
pub mod propagate;
mod realign;
mod settings;
pub mod strangers;
pub mod symmetry;
pub mod views;

pub use error::Error;
pub use footprint::{Footprint, Limits};
pub use settings::{Distances, Settings};

use crate::mesh::{self, Mesh, Point};
use plan::Plan;

/// Trains a model on aligned shapes: the model file.
///
/// # Errors
/// Shapes that cannot make a model; see [`Error`].
pub fn train(
    shapes: &[Mesh],
    settings: &Settings,
    progress: &(dyn Fn(u64, u64) + Sync),
) -> Result<Vec<u8>, Error> {
    Ok(choice::make(shapes, settings, progress)?.file)
}

/// Bounds of all shapes.
fn bounds(shapes: &[Mesh]) -> (Point, Point) {
    mesh::bounds(shapes.iter().flat_map(|shape| shape.points.iter().copied())).unwrap_or_default()
}
