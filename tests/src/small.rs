//! A case small enough to be completed a thousand times.

use crate::default_schedule;
use lacuna::completion::Settings;
use lacuna::pose_fit::ROUNDS;
use lacuna::wire::message::{Begin, Hint, Iterations, MAX_BATCH};
use lacuna::{Fixed, Model, Reach};
use lacuna_host::device::Scan;
use lacuna_host::fit::{Digests, fit};
use lacuna_host::verify::Case;
use std::sync::OnceLock;

/// A small model with a scan, and what the host computes from it.
pub struct Small {
    /// The model file.
    pub model: Vec<u8>,
    /// The scan, with a rough pose.
    pub scan: Scan,
    /// What the stages compute.
    pub digests: Digests,
}

/// The case, made once.
pub fn small() -> &'static Small {
    static SMALL: OnceLock<Small> = OnceLock::new();
    SMALL.get_or_init(|| {
        let case = Case::small().expect("the small case");
        let model = Model::from_bytes(&case.model).expect("the small case");
        let packed = case.points.packed();
        let settings =
            Settings { reach: Reach::of(&model), rounds: &ROUNDS, schedule: default_schedule(&model) };
        let digests = fit::<Fixed>(&model, &packed, &case.pose, settings).expect("the small case").digests;
        Small { scan: scan_of(&case, 1), digests, model: case.model }
    })
}

/// A case's scan as a device takes it, from its pose as a rough one.
pub fn scan_of(case: &Case, number: u32) -> Scan {
    let packed = case.points.packed();
    let begin = Begin {
        scan: number,
        points: packed.points.len() as u32,
        step: packed.step,
        pose: case.pose,
        hint: Hint::Rough,
        iterations: Iterations::Varying,
    };
    Scan { begin, points: packed.points, batch: MAX_BATCH }
}
