//! The host's end of the [wire protocol](lacuna::wire): lets a device complete a scan.
//!
//! A [`Link`] carries bytes, a [`Client`] gets an answer to a request whatever happens to the frames,
//! [`run`](fn@run) brings a scan to its results whatever happens to the device.

mod client;
mod link;
mod qemu;
mod refusal;
mod run;
mod scan;

pub use client::{Client, Statistics, Timing};
pub use link::{Link, serial, tcp};
pub use qemu::end_all as end_emulators;
pub use qemu::{Error as QemuError, Machine, Qemu};
pub use refusal::refusal;
pub use run::{Progress, Results, run};
pub use scan::Scan;

use lacuna::wire::Refusal;

/// Why a device did not do its work.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The line.
    #[error("the line to the device failed: {0}")]
    Line(#[from] std::io::Error),
    /// No answer.
    #[error("the device did not answer {0} times: is it running, and are line and baud rate right?")]
    Silent(u32),
    /// Answers, but no whole one.
    #[error(
        "{damaged} of {attempts} requests, or the device's answers to them, arrived damaged: are baud rate, parity and \
         ground of the line right, and is nothing else on it?"
    )]
    Damaged {
        /// Times the request was sent.
        attempts: u32,
        /// Times that something was damaged.
        damaged: u32,
    },
    /// An answer that is none.
    #[error(
        "the device answered with something else than was asked for: does it speak version {} of the protocol?",
        lacuna::wire::message::VERSION
    )]
    Unexpected,
    /// A message too long for a frame.
    #[error("the request does not fit into a frame")]
    TooLong,
    /// The device says no.
    #[error("the device refuses: {}", refusal(.0))]
    Refused(Refusal),
    /// Resets without end.
    #[error("the device lost the session {0} times: does it restart again and again?")]
    Unsteady(u32),
    /// The same state again and again.
    #[error("the device answers, but got no further for {} seconds: reset it", .0.as_secs())]
    Standstill(std::time::Duration),
    /// Distances that cannot be.
    #[error("the device's distances do not belong to this model")]
    Distances,
    /// Different models.
    #[error(
        "the device holds the model {held} ({held_checksum:08x}), not {given} ({given_checksum:08x}): give its file with --model"
    )]
    OtherModel {
        /// Class on the device.
        held: String,
        /// Its checksum.
        held_checksum: u32,
        /// Class on the host.
        given: String,
        /// Its checksum.
        given_checksum: u32,
    },
}

impl Error {
    /// Whether saying hello again helps: not against another host, whose scan that would end.
    const fn is_lost_session(&self) -> bool {
        matches!(self, Self::Refused(Refusal::WrongSession { current: 0 } | Refusal::OutOfOrder { .. }))
    }
}
