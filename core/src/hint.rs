//! How well a pose is known before a fit, and which iterations refine it then.

use crate::model::Model;
use crate::pose_fit::{EXACT, ROUNDS, Round, SETTLED};
use serde::{Deserialize, Serialize};

/// How well a pose is known. On the line and in a [scan's bytes](crate::cloud::Bytes) it is its number here: new ones go to the
/// end.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Hint {
    /// Roughly: it is refined.
    Rough,
    /// Exactly, in the frame of the training shapes: held, or tied by the model's [`Jitter`](crate::format::Jitter).
    Exact,
    /// Refined already, together with the shape and without the clutter around it, which would mislead wide steps with all
    /// points: refined by the last rounds only.
    Settled,
}

impl Hint {
    /// How a pose known so well is refined: not at all if it is exact and the shapes were trained on as they lay.
    pub const fn rounds(self, model: &Model<'_>) -> &'static [Round] {
        match (self, model.jitter()) {
            (Self::Rough, _) => &ROUNDS,
            (Self::Settled, _) => &SETTLED,
            (Self::Exact, Some(_)) => &EXACT,
            (Self::Exact, None) => &[],
        }
    }

    /// Its number.
    pub const fn to_byte(self) -> u8 {
        self as u8
    }

    /// The hint of a number; those of later builds are taken for rough.
    pub const fn from_byte(byte: u8) -> Self {
        match byte {
            1 => Self::Exact,
            2 => Self::Settled,
            _ => Self::Rough,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_is_that_of_its_hint_and_others_are_rough() {
        for (number, hint) in [(0, Hint::Rough), (1, Hint::Exact), (2, Hint::Settled)] {
            assert_eq!((hint.to_byte(), Hint::from_byte(number)), (number, hint));
        }
        assert_eq!(Hint::from_byte(3), Hint::Rough);
    }
}
