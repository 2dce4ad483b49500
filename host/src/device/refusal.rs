//! A device's refusals as sentences.

use crate::sentence::sentence;
use lacuna::wire::Refusal;
use lacuna::wire::message::VERSION;

/// What was refused, why, and what to do.
pub fn refusal(refusal: &Refusal) -> String {
    match refusal {
        Refusal::Damaged => "the request arrived damaged: send it again".into(),
        Refusal::BadRequest => "it does not know this request: update its firmware".into(),
        Refusal::BrokenBatch => "it got bytes that are no whole number of points or pixels: send whole ones".into(),
        Refusal::UnknownVersion { spoken } => format!(
            "it speaks version {spoken} of the protocol, this program speaks {VERSION}: update the older one"
        ),
        Refusal::WrongSession { current: 0 } => "it has been reset: say hello and begin again".into(),
        Refusal::WrongSession { current } => {
            format!("it is in session {current:08x} with another host: leave it to one program")
        }
        Refusal::OutOfOrder { expected } => {
            format!("a request is missing before this one, it expects number {expected}: say hello again")
        }
        Refusal::Unsupported => {
            "it has no memory for rows of a depth image: leave out --depth-rows to send points".into()
        }
        Refusal::NoScan => "there is no scan: begin one first".into(),
        Refusal::WrongPlace { received } => {
            format!("it has {received} points and takes those that follow: go on from there")
        }
        Refusal::TooManyPoints { limit } => {
            format!("it takes at most {limit} points of this scan: build its firmware with more memory")
        }
        Refusal::PointsMissing { received, announced } => {
            format!("it has {received} of {announced} points: send the others first")
        }
        Refusal::Busy => "it is fitting, or has fitted, the scan: begin a new one for more points".into(),
        Refusal::NoResult => "there are no results yet: wait for the fit".into(),
        Refusal::OutOfRange { limit } => format!("there are only {limit} values: ask for fewer"),
        Refusal::WrongKind => {
            "points were sent for a scan announced as a depth image, or pixels for one of points: begin it again"
                .into()
        }
        Refusal::WrongRow { row, column } => {
            format!("it takes the depth image from row {row}, column {column} on: go on from there")
        }
        Refusal::RowTooLong { width } => {
            format!("a row of the depth image was announced with {width} pixels: send no more than that")
        }
        Refusal::ImageTooWide { limit, needed } => format!(
            "it keeps {limit} pixels of a depth image, this one needs {needed}: leave out --depth-rows to send \
             points, or build its firmware with more memory"
        ),
        Refusal::RowsMissing { received, announced } => {
            format!("it has {received} of {announced} rows of the depth image: send the others first")
        }
        Refusal::Core(error) => format!("its core says that {}", sentence("its model", error)),
    }
}
