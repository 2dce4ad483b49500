//! The wire protocol: a host sends a scan to a device, which completes it and returns the bits the host would
//! have computed. Both ends are built from this module: [`device::serve`] is the whole of the device's, the
//! host's is `lacuna device`. Version 1.
//!
//! # Line
//! Any stream of bytes in both directions: a UART, USB serial, a TCP connection. Bytes may be damaged, lost or
//! repeated; their order is kept. The host asks, the device answers, never unasked.
//!
//! # Frames
//! ```text
//! 00  COBS( header | message | CRC-32 )  00
//! ```
//! - COBS (Cheshire & Baker 1999) leaves no zero within a frame: after any damage a receiver is in step again at
//!   the next zero. Empty frames mean nothing, so zeros may be added freely.
//! - Header and message are [postcard](https://postcard.jamesmunns.com/wire-format): integers as varints (seven
//!   bits a byte, low first), f32 and f64 little endian, an enum as the number of its variant, bytes and text
//!   after their length.
//! - The header is two u32: session and sequence number ([`frame::Header`]).
//! - CRC-32/ISO-HDLC over header and message, little endian.
//! - Header, message and checksum are at most 1024 bytes ([`frame::MAX_MESSAGE`]), points or results in a message
//!   at most 960 ([`message::MAX_DATA`]), a frame at most 1031 on the line ([`frame::MAX_FRAME`]).
//!
//! # Conversation
//! The host opens a session with `Hello`: it chooses the session number (not 0, and not the one before) and the
//! first sequence number. Every further request bears the session and the next sequence number, one higher each,
//! wrapping. The host sends one request and waits for the reply with the same header before it sends the next.
//!
//! | the device receives | and |
//! |---|---|
//! | the next sequence number | executes the request, replies, keeps the reply |
//! | the last one again | sends the kept reply again, executes nothing |
//! | `Hello` with another session number | opens that session; the scan stays |
//! | `Hello` with another version | refuses: `UnknownVersion`, with the one it speaks |
//! | another session number | refuses: `WrongSession`, with its own; 0 is none, after a reset |
//! | another sequence number | refuses: `OutOfOrder`, with the one it expects |
//! | an intact frame whose message it cannot read | refuses: `BadRequest`; the same sequence number stays due |
//! | an intact frame without a header | nothing |
//! | a damaged frame | answers `Damaged` with the header of the last executed request |
//! | fewer than 8 bytes between zeros | nothing |
//!
//! Without a reply in time, after a damaged one and after `Damaged`, the host sends the same request again, byte
//! for byte. It drops replies whose header is not its request's. So every request is executed once whatever
//! happens to the frames, and a `Damaged` out of season costs a repetition at most.
//!
//! # Messages
//! Numbers are those of the variants on the line; fields are in [`message`], in the order of the line.
//!
//! | no. | request | reply (no.) |
//! |---|---|---|
//! | 0 | `Hello` version | `Hello` (0) version |
//! | 1 | `Info` | `Info` (1): machine, budgets, the model's identity or why it is refused |
//! | 2 | `Begin` scan number, points, step, pose, hint (0 rough, 1 exact, 2 settled), iterations | `Status` (2) |
//! | 3 | `Points` number of the first, 12 bytes a point ([`Packed`](crate::cloud::Packed), little endian) | `Status` |
//! | 4 | `Fit` | `Status` |
//! | 5 | `Status` | `Status`: state, scan number, points or pixels received and announced |
//! | 6 | `Outcome` | `Outcome` (3): pose, agreement, inliers, clutter, hull voxels, digests |
//! | 7 | `Weights` which, number of the first | `Data` (4), as many as fit, empty at the end |
//! | 8 | `Distances` number of the first voxel | `Data`, as many as fit, [packed](distances), empty at the end |
//! | 9 | `Counters` | `Counters` (5): work and steps of each stage |
//! | 10 | `Cancel` | `Status` |
//! | 11 | `DepthRows` row, column of the first pixel, 2 bytes a pixel (depth, little endian, 0 is not measured) | `Status` |
//! | 12 | `BeginDepth` as `Begin`, then the [`Frame`](crate::depth::Frame): camera, jump, reach, stride, view | `Status` |
//!
//! Any request may be answered by `Refused` (6) with a [`Refusal`]; nothing has changed then.
//! A refusal that follows from the request itself is a reply like any other and kept; those in the table of the
//! conversation are not. Results are values, numbered from 0; a request for results changes nothing.
//!
//! # States
//! ```text
//!            Begin              Fit, all points there          the job ends
//!   Idle ────────────▶ Receiving ──────────────────▶ Fitting ───────────────▶ Done
//!    ▲                  │  ▲  ▲                          │ EmptyHull ...
//!    │      Points ─────┘──┘  └── Fit refused            └──────────────────▶ Failed ── Fit ──▶ Fitting
//!    └── Cancel, from anywhere;  Begin, from anywhere but when refused ▶ Receiving
//! ```
//! Points are accepted in Receiving, in order, without gaps (`WrongPlace` tells the next), pixels in order (`WrongRow`).
//! `BeginDepth` does what `Begin` does. Fit in Fitting and in Done changes nothing. Results are there in Done. Status,
//! Info, Counters, Cancel and Begin are answered in every state, between two bounded pieces of a fit.
//!
//! # Depth images
//! A scan may come as the depth image that a scanner's camera makes, in place of points. `BeginDepth` announces it:
//!
//! | field | bytes | content |
//! |---|---|---|
//! | begin | | as `Begin`; its points are the most that the image may give |
//! | width, height | varint u16 | pixels of the image, 1 at least |
//! | fx, fy, cx, cy, unit | f32 | a pixel (u, v) with the value d sees Z = d unit, X = (u - cx) Z / fx, Y = (v - cy) Z / fy |
//! | jump | f32 | neighbours whose Z differs by more are of different surfaces |
//! | reach | u8 | distance r of the four neighbours that make a normal, pixels, 1 at least |
//! | stride | varint u16 | every so many pixels of every so many rows become points, 1 at least |
//! | view | 13 f32 | [`Pose`](crate::Pose) from the camera to the scan: rotation row by row, scale, translation |
//!
//! Then the pixels come in `DepthRows`, row by row from the top. A message holds pixels of one row, a row may take several
//! messages. Pixels that are left out were not measured; the last one of the image has to come. Status counts pixels,
//! those left out too: `received` = row · width + column of the next one, `announced` = width · height. The device makes
//! points of the pixels as they come ([`depth`](crate::depth)), keeps 2 r rows at most, and forgets them. With the last
//! pixel it brings the points into the order of a space-filling [curve](crate::curve).
//! The host can make the same points with the same code, so the results are the same bits.
//!
//! | `BeginDepth`, `DepthRows` or `Fit` is refused | |
//! |---|---|
//! | `Unsupported` | the device has no memory for rows |
//! | `ImageTooWide` | 2 r rows are more pixels than it keeps; with how many |
//! | `Core` `Option` | width, height, reach or stride is 0, fx, fy or unit is not a positive number, cx or cy is not finite, jump is not 0 or a positive number, the step of the points is not a positive number |
//! | `Core` `Pose` | the view, or the rough pose of the scan, is no similarity |
//! | `NoScan` | pixels before `BeginDepth` |
//! | `WrongKind` | pixels after `Begin`, or points after `BeginDepth` |
//! | `WrongRow` | pixels before the next one, or beyond the image; with row and column of the next one |
//! | `RowTooLong` | more pixels than are left of the row |
//! | `TooManyPoints` | the pixels would make more points than were announced, or more are announced than the device holds |
//! | `RowsMissing` | `Fit` before the last pixel |
//! | `BrokenBatch` | an odd number of bytes |
//! | `Busy` | pixels during or after the fit |
//!
//! # Interruption
//! - *The host or the cable goes away.* The device keeps scan, fit and results. The host says hello in a new
//!   session and asks for the status: if the scan number is its own, it goes on at the point or pixel the device asks
//!   for, waits for the fit, or fetches the results. The number should follow from the scan's contents.
//! - *The device is reset.* It knows no session: the next request is refused, `WrongSession` 0. The host says
//!   hello; the status is Idle with scan number 0; it begins again.
//!
//! # A device without a model
//! If the model is refused, the device answers Hello and Info, which tells why, and refuses everything else with
//! the core's [`Error`](crate::Error).
//!
//! # Versions
//! The version is one number. Within a version messages, refusals, errors, hints and iterations may be added at the end
//! of their lists, nothing else; a device that does not know a message, or a value in it, answers `BadRequest`.
//! Frames, header, Hello and `Refused` `UnknownVersion` are the same in all versions.

mod desk;
pub mod device;
pub mod distances;
pub mod frame;
mod intake;
mod line;
pub mod message;
pub mod refusal;
mod results;

pub use device::{Buffers, Device, serve};
pub use refusal::Refusal;
