//! A scan as it is sent, and a device's results as the host's own.

use super::Results;
use crate::complete::Start;
use crate::fit::{Buffers, Digests, Fit, global_distances};
use lacuna::cloud::Packed;
use lacuna::format::{Digest, digest};
use lacuna::wire::message::{Begin, Hint, Iterations, MAX_BATCH};
use lacuna::{Error, Fixed, Model, Sizes};

/// A scan to be completed by a device.
#[derive(Clone, Debug)]
pub struct Scan {
    /// Its announcement.
    pub begin: Begin,
    /// Its points.
    pub points: Vec<Packed>,
    /// Points in a message, at most [`MAX_BATCH`].
    pub batch: usize,
}

impl Scan {
    /// A scan in a pose, numbered by what it holds.
    pub fn new(start: &Start, iterations: Iterations) -> Self {
        let packed = start.points.packed();
        let begin = Begin {
            scan: 0,
            points: packed.points.len() as u32,
            step: packed.step,
            pose: start.rough.pose,
            hint: if start.rounds.is_empty() { Hint::Exact } else { Hint::Rough },
            iterations,
        };
        let mut number = Digest::new();
        number.add(format!("{begin:?}").as_bytes());
        packed.points.iter().flatten().for_each(|value| number.add(&value.to_le_bytes()));
        let begin = Begin { scan: number.value(), ..begin };
        Self { begin, points: packed.points, batch: MAX_BATCH }
    }
}

impl Results {
    /// The results as if the fit had run here. The hull's targets stay on the device.
    ///
    /// # Errors
    /// A model that the iterations do not go with.
    pub fn into_fit(self, model: &Model<'_>, begin: &Begin) -> Result<Fit, Error> {
        let schedule = begin.settings(model).schedule;
        let sizes = Sizes::required(model, &schedule)?;
        let mut buffers = Buffers::<Fixed>::new(&sizes);
        let found = self.outcome.digests;
        let digests = Digests {
            pose: found.pose,
            hull: found.hull,
            global: found.global,
            local: found.local,
            distances: digest(self.distances.iter().map(|d| d.to_le_bytes())),
        };
        Ok(Fit {
            outcome: self.outcome,
            shape: self.shape,
            targets: vec![],
            global_distances: global_distances(model, &self.global, schedule, &mut buffers)?,
            global: self.global,
            local_distances: self.distances,
            digests,
            buffer_bytes: sizes.bytes::<Fixed>(),
        })
    }
}
