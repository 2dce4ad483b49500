//! How far a job that is done in steps has come.

/// How far a job has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Progress {
    /// Pieces of work done.
    pub done: u32,
    /// Pieces of work in all.
    pub total: u32,
}
