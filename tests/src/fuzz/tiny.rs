//! A model of five heads at 20 mm and a scan of a sixth one: a completion in milliseconds.

use crate::small::scan_of;
use lacuna::Model;
use lacuna::completion::Settings;
use lacuna_host::device::Scan;
use lacuna_host::synth::scanner::Kind;
use lacuna_host::verify::{Case, Class};
use std::sync::OnceLock;

/// Five heads, four modes, a node every second voxel.
pub const CLASS: Class = Class {
    name: "tiny",
    shapes: 5,
    spacing_mm: 20.0,
    stride: 2,
    kind: Kind::Front,
    seed: 21,
    symmetric: false,
};

/// The model and the scan, in its true pose.
pub struct Tiny {
    /// The model file.
    pub file: Vec<u8>,
    /// The scan with its pose, as a device takes it.
    pub scan: Scan,
}

impl Tiny {
    /// The model.
    pub fn model(&self) -> Model<'_> {
        Model::from_bytes(&self.file).expect("the trainer's own model")
    }

    /// What a completion of the scan runs with.
    pub fn settings(&self) -> Settings<'static> {
        self.scan.begin.settings(&self.model())
    }
}

/// The case, made once.
pub fn tiny() -> &'static Tiny {
    static TINY: OnceLock<Tiny> = OnceLock::new();
    TINY.get_or_init(|| {
        let case = Case::synthetic(&CLASS).expect("a class that can be trained");
        Tiny { scan: scan_of(&case, 7), file: case.model }
    })
}
