//! How far training shapes lay apart, as `train` and `inspect` say it.

use crate::train::jitter::Apart;
use crate::unit::digits;

/// Root mean square motion of shapes to their common pose, as people say it.
#[derive(Clone, Copy, serde::Serialize)]
pub(super) struct Scatter {
    /// Turn about each axis, degrees.
    pub turn: f32,
    /// Shift along each axis, in the shapes' unit.
    pub shift: f32,
    /// Growth, per cent.
    pub growth: f32,
}

impl From<Apart> for Scatter {
    fn from(apart: Apart) -> Self {
        Self { turn: apart.turn.to_degrees(), shift: apart.shift, growth: 100.0 * apart.growth }
    }
}

impl Scatter {
    /// The same as a part of a sentence.
    pub(super) fn sentence(self, symbol: &str) -> String {
        let Self { turn, shift, growth } = self;
        let shift = digits(shift.into(), 1);
        format!("{turn:.1} degrees, {shift} {symbol} and {growth:.1} % of size (rms) from where they lay")
    }
}
