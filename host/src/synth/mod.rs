//! A shape class of our own, and a scanner to look at it: data for tests, demonstrations and the
//! built-in model, free of anybody's rights.
//!
//! Everything follows from seeds and is the same bit for bit on every platform: random numbers from
//! ChaCha8, transcendental functions from `libm`, sums in a fixed order whatever the number of threads.
//! Model frame of the heads: millimetres, x to the subject's left, y up, z forward.

pub mod head;
mod random;
pub mod scanner;
pub mod surroundings;
mod tessellate;

pub use head::Head;
pub use random::Random;
pub use scanner::{Kind, Scan, Settings as ScannerSettings, scan, scan_among};
pub use surroundings::Surrounding;
