//! Why a device does not do what it is asked.

use crate::error::Error;
use serde::{Deserialize, Serialize};

/// Why a request was refused, with what the host needs to go on. Nothing has changed on the device.
///
/// On the line a refusal is its number in this list: new ones go to its end.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Refusal {
    /// A frame arrived damaged; nothing in it can be trusted, so this answer bears the header of the last
    /// executed request. Send again.
    Damaged,
    /// The frame is intact but no request of this version: a message of a later version, or a wrong field.
    BadRequest,
    /// The device speaks another version of the protocol.
    UnknownVersion {
        /// The one it speaks.
        spoken: u16,
    },
    /// The request belongs to no conversation, or to an old one. Say hello.
    WrongSession {
        /// The device's session; 0 after a reset.
        current: u32,
    },
    /// A request is missing in between.
    OutOfOrder {
        /// The sequence number that would be executed.
        expected: u32,
    },
    /// A depth image, for which this device has no memory.
    Unsupported,
    /// Points, pixels or a fit before a scan was begun.
    NoScan,
    /// These points do not continue those received.
    WrongPlace {
        /// Points received: number of the next one.
        received: u32,
    },
    /// More points than the device holds, or than were announced.
    TooManyPoints {
        /// Most points.
        limit: u32,
    },
    /// A fit before all announced points have arrived.
    PointsMissing {
        /// Points received.
        received: u32,
        /// Points announced.
        announced: u32,
    },
    /// Points or pixels during or after the fit: begin a new scan.
    Busy,
    /// A result was asked for before the fit ended well.
    NoResult,
    /// A result was asked for beyond its end.
    OutOfRange {
        /// Number of values there are.
        limit: u32,
    },
    /// The core refuses: the device's model, the scan, or too little memory.
    Core(Error),
    /// Points for a scan that was announced as a depth image, or pixels for one that was not.
    WrongKind,
    /// These pixels are before the next one, or beyond the image.
    WrongRow {
        /// Row of the next pixel.
        row: u16,
        /// Its column.
        column: u16,
    },
    /// More pixels than are left of the row.
    RowTooLong {
        /// Pixels in a row, as announced.
        width: u16,
    },
    /// The device cannot keep as much of the rows as it needs for the normals.
    ImageTooWide {
        /// Pixels it keeps.
        limit: u32,
        /// Pixels it would have to keep: two rows for each pixel of the normals' reach.
        needed: u32,
    },
    /// A fit before all rows have arrived.
    RowsMissing {
        /// Whole rows received.
        received: u16,
        /// Rows announced.
        announced: u16,
    },
    /// Bytes that are no whole number of points or pixels.
    BrokenBatch,
}
