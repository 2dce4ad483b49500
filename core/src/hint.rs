//! How well a pose is known before a fit.

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
