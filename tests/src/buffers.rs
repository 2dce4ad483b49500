//! A completion in exactly the memory that is lent, as firmware runs it.

use lacuna::completion::{Digests, Settings};
use lacuna::{Completion, Error, Fixed, Model, Pose, Reach, Schedule};
use lacuna_host::fit::Buffers;
use lacuna_host::points::PackedPoints;

/// Completes points in a known pose: digests of the stages.
///
/// # Errors
/// A buffer that is too small, or points that miss the model.
pub fn complete(
    model: &Model<'_>,
    points: &PackedPoints,
    pose: Pose,
    schedule: Schedule<'_>,
    buffers: &mut Buffers<Fixed>,
) -> Result<Digests, Error> {
    let settings = Settings { reach: Reach::of(model), rounds: &[], schedule };
    let mut job = Completion::new(model, points.cloud()?, pose, settings, buffers.memory())?;
    job.run();
    Ok(job.outcome()?.digests)
}
