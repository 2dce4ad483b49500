//! Completes the scan the firmware carries, and prints digests and counts.

use crate::count::{Counts, Scale};
use crate::text::Line;
use crate::{MODEL, Machine, SCAN, memory, stack};
use lacuna::cloud::Bytes;
use lacuna::completion::{Outcome, Settings};
use lacuna::model::MAX_BRICK_VOXELS;
use lacuna::pose_fit::ROUNDS;
use lacuna::{Cloud, Completion, Error, Fixed, Model, Reach, Schedule, schedule};

/// Why the example ended early; the line before has said it.
pub struct Refused;

/// Runs the completion with every step counted.
///
/// # Errors
/// A model or a scan that the core refuses.
pub fn run<M: Machine>(machine: &mut M) -> Result<(), Refused> {
    let scale = Scale::measure(machine);
    Line::new("machine ").text(M::NAME).print();
    complete(machine, &scale).map_err(|_| {
        Line::new("refused").print();
        Refused
    })?;
    Line::new("stack").number(stack::high_water(machine) as u64).print();
    Ok(())
}

fn complete<M: Machine>(machine: &mut M, scale: &Scale) -> Result<(), Error> {
    let start = machine.ticks();
    let model = Model::from_bytes(&MODEL)?;
    let checked = machine.ticks().wrapping_sub(start);
    let Some((points, memory)) = memory::take() else { return Err(Error::EmptyHull) };
    let scan = Bytes(&SCAN);
    let packed = scan.points();
    let count = packed.len().min(points.len());
    for (slot, point) in points.iter_mut().zip(packed) {
        *slot = point;
    }
    let cloud = Cloud::new(points.get(..count).unwrap_or(&[]), scan.step())?;
    let schedule = Schedule { stride: model.header().stride, momentum: 0, passes: &schedule::DEFAULT };
    let settings =
        Settings { reach: Reach::of(&model), rounds: if scan.exact() { &[] } else { &ROUNDS }, schedule };
    let mut job = Completion::<Fixed>::new(&model, cloud, scan.pose(), settings, memory)?;
    let mut counts = Counts::default();
    loop {
        let task = job.local().and_then(|fit| fit.task());
        let before = machine.ticks();
        let Some((stage, _)) = job.step() else { break };
        counts.add((stage, task), machine.ticks().wrapping_sub(before));
    }
    Line::new("points").number(count as u64).print();
    Line::new("count model").number(scale.instructions(u64::from(checked))).print();
    for (name, ticks, steps, longest) in counts.stages() {
        let line = Line::new("count ").text(name).number(scale.instructions(ticks));
        line.text(" steps")
            .number(u64::from(steps))
            .text(" longest")
            .number(scale.instructions(u64::from(longest)))
            .print();
    }
    let outcome = *job.outcome()?;
    let mut digest = lacuna::format::Digest::new();
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
