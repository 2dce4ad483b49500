//! A case small enough to be completed a thousand times.

use lacuna::completion::Settings;
use lacuna::pose_fit::ROUNDS;
use lacuna::wire::message::{Begin, Hint, Iterations, MAX_BATCH};
use lacuna::{Fixed, Model, Schedule};
use lacuna_host::complete::Start;
use lacuna_host::complete::depth_rows::DepthImage;
use lacuna_host::complete::start::{Known, Thinned};
use lacuna_host::device::Scan;
use lacuna_host::fit::{Digests, fit};
use lacuna_host::mesh::Point;
use lacuna_host::points::OrientedPoints;
use lacuna_host::register::Placed;
use lacuna_host::synth::{self, Head, ScannerSettings};
use lacuna_host::verify::{Case, Class};
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
        let settings = Settings { rounds: &ROUNDS, schedule: Schedule::of(&model) };
        let digests = fit::<Fixed>(&model, &packed, &case.pose, settings).expect("the small case").digests;
        Small { scan: scan_of(&case, 1), digests, model: case.model }
    })
}

/// The same head as a depth image, sent row by row.
pub fn small_depth() -> &'static Small {
    static SMALL: OnceLock<Small> = OnceLock::new();
    SMALL.get_or_init(|| {
        let class = Class::SMALL;
        let head = Head::sample(class.seed, class.shapes).mesh();
        let settings = ScannerSettings { size: (96, 72), ..ScannerSettings::default() };
        let seen = synth::scan(&head, class.kind, &settings, class.seed);
        let image = DepthImage::new(&seen.views[0], 1.0).expect("a camera");
        let file = small().model.clone();
        let model = Model::from_bytes(&file).expect("the small case");
        let hint = Placed { centre: Point::origin(), pose: small().scan.begin.pose };
        let (rough, depth) = image.placed(&seen.mesh, &hint).expect("an extent");
        let packed = &depth.packed;
        let settings = Settings { rounds: &ROUNDS, schedule: Schedule::of(&model) };
        let digests = fit::<Fixed>(&model, packed, &rough.pose, settings).expect("the small case").digests;
        let points = OrientedPoints::default();
        let thinned = Thinned { points, elsewhere: 0.0, clutter: 0.0, rough };
        let known = Known { placed: rough, hint: Hint::Rough, registration: None };
        let start = Start { thinned, known, depth: Some(depth) };
        Small { scan: Scan::new(&start, Iterations::Varying), digests, model: file }
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
    Scan { begin, points: packed.points, depth: None, batch: MAX_BATCH }
}
