//! Completes the scan the firmware carries, and prints digests and counts.

use crate::count::{Counts, Scale};
use crate::text::Line;
use crate::{MODEL, Machine, SCAN, memory, stack};
use lacuna::Progress;
use lacuna::brick::MAX_BRICK_VOXELS;
use lacuna::cloud::Bytes;
use lacuna::completion::{Outcome, Settings, Stage};
use lacuna::local_fit::Task;
use lacuna::{Cloud, Completion, Error, Fixed, Model, Schedule};

/// Why the example ended early.
#[derive(Clone, Copy, Debug)]
pub enum Refused {
    /// The static memory has been handed out before.
    Memory,
    /// The linked scan has more points than there is room for.
    TooManyPoints,
    /// The core refuses the model or the scan.
    Core(Error),
}

impl From<Error> for Refused {
    fn from(error: Error) -> Self {
        Self::Core(error)
    }
}

/// Runs the completion with every step counted.
///
/// # Errors
/// A model or a scan that cannot be used; a line says so.
pub fn run<M: Machine>(machine: &mut M) -> Result<(), Refused> {
    let scale = Scale::measure::<M>();
    Line::new("machine ").text(M::NAME).print();
    complete::<M>(&scale).inspect_err(|refused| {
        let reason = match refused {
            Refused::Memory => "the static memory is in use",
            Refused::TooManyPoints => "the scan has more points than cloud::CAPACITY",
            Refused::Core(Error::EmptyHull) => "the scan does not touch the model in this pose",
            Refused::Core(_) => "the core refuses the linked model or scan",
        };
        Line::new("refused: ").text(reason).print();
        #[cfg(feature = "defmt")]
        if let Refused::Core(error) = refused {
            defmt::error!("refused: {}", error);
        }
    })?;
    Line::new("stack").number(stack::high_water(machine) as u64).print();
    Ok(())
}

fn complete<M: Machine>(scale: &Scale) -> Result<(), Refused> {
    let start = M::ticks();
    let model = Model::from_bytes(&MODEL)?;
    let checked = M::ticks().wrapping_sub(start);
    let (memory::Scan { points, .. }, memory) = memory::take().ok_or(Refused::Memory)?;
    let scan = Bytes(&SCAN);
    let packed = scan.points();
    let count = packed.len();
    if count > points.len() {
        return Err(Refused::TooManyPoints);
    }
    for (slot, point) in points.iter_mut().zip(packed) {
        *slot = point;
    }
    let cloud = Cloud::new(points.get(..count).unwrap_or(&[]), scan.step())?;
    let schedule = Schedule::of(&model);
    let settings = Settings { rounds: scan.hint().rounds(&model), schedule };
    let start = M::ticks();
    let mut job = Completion::<Fixed>::new(&model, cloud, scan.pose(), settings, memory)?;
    let prepared = M::ticks().wrapping_sub(start);
    let mut counts = Counts::default();
    loop {
        let task = job.local().and_then(|fit| fit.task());
        let before = M::ticks();
        let Some((stage, progress)) = job.step() else { break };
        log(stage, progress);
        // The first step of the local fit prepares it; its task is not known before.
        let task = task.or((stage == Stage::Local).then_some(Task::Curvature));
        counts.add((stage, task), M::ticks().wrapping_sub(before));
    }
    Line::new("points").number(count as u64).print();
    Line::new("count model").number(scale.instructions(u64::from(checked))).print();
    Line::new("count setup").number(scale.instructions(u64::from(prepared))).print();
    for (name, ticks, steps, longest) in counts.stages() {
        let line = Line::new("count ").text(name).number(scale.instructions(ticks));
        line.text(" steps")
            .number(u64::from(steps))
            .text(" longest")
            .number(scale.instructions(u64::from(longest)))
            .print();
    }
    let outcome = job.outcome()?;
    #[cfg(feature = "defmt")]
    defmt::info!("{}", outcome);
    let mut digest = lacuna::digest::Digest::new();
    if let Some(fit) = job.local() {
        for brick in model.bricks() {
            for distance in fit.ordered_distances(&brick, &mut [0; MAX_BRICK_VOXELS]) {
                digest.add(&distance.to_le_bytes());
            }
        }
    }
    report(&outcome, digest.value());
    Ok(())
}

/// Logs the end of every stage.
#[cfg_attr(not(feature = "defmt"), allow(unused_variables))]
fn log(stage: Stage, progress: Progress) {
    #[cfg(feature = "defmt")]
    if progress.done == progress.total {
        defmt::info!("{} done in {} steps", stage, progress.total);
    }
}

fn report(outcome: &Outcome, distances: u32) {
    Line::new("inliers").number(u64::from(outcome.inliers)).print();
    Line::new("hull voxels").number(u64::from(outcome.hull_voxels)).print();
    let d = outcome.digests;
    let digests = [
        ("pose", d.pose),
        ("hull", d.hull),
        ("global", d.global),
        ("local", d.local),
        ("distances", distances),
    ];
    for (name, value) in digests {
        Line::new("digest ").text(name).hex(value).print();
    }
}
