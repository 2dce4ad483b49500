//! Smooth relief that no parameter explains: what a trained model meets in the real world.

use crate::mesh::{Point, Vector};
use crate::synth::Random;

const WAVES: usize = 48;

/// A sum of plane waves of 18 to 60 mm with random directions and phases.
#[derive(Clone, Debug)]
pub(super) struct Relief {
    waves: Vec<(Vector, f64)>,
    amplitude: f64,
}

impl Relief {
    /// A relief of `rms_mm` millimetres RMS.
    pub fn new(rms_mm: f64, seed: u64) -> Self {
        let mut random = Random::new(seed, RELIEF_STREAM);
        let mut wave = || {
            let length = random.range(18.0, 60.0);
            (random.direction() * (std::f64::consts::TAU / length), random.range(0.0, std::f64::consts::TAU))
        };
        let waves = (0..WAVES).map(|_| wave()).collect();
        Self { waves, amplitude: rms_mm * (2.0 / WAVES as f64).sqrt() }
    }

    /// `q`, moved away from or towards the axis of the head.
    pub fn apply(&self, q: Point) -> Point {
        let height: f64 = self.waves.iter().map(|(k, phase)| libm::sin(k.dot(&q.coords) + phase)).sum();
        let out = Vector::new(q.x, 0.0, q.z + 30.0);
        // Softened at the axis, where "outwards" has no meaning.
        q + out * (height * self.amplitude / (out.norm_squared() + 100.0).sqrt())
    }
}

/// Keeps the relief independent of whatever else is drawn from the same seed.
const RELIEF_STREAM: u64 = 0x7265_6c69_6566;
