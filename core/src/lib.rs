//! Completes range scans with a local statistical shape prior, inside the scanner.
//!
//! A signed distance is negative inside the shape. The model is a mean distance volume M with whitened
//! modes b' on a sparse band of voxels; a scan becomes a thin [`hull`] of measured distances; a [`global_fit`]
//! finds one weight vector for it, a [`local_fit`] a smoothly varying field of them. The zero level of the
//! fitted distances is the completed surface.
//!
//! Data flows one way: scan ([`cloud`]) → [`pose`] → [`hull`] → [`global_fit`] → [`local_fit`] → distances;
//! [`completion`] runs it as one job, and [`wire`] lets a host run that job on a device.
//! Lengths are in voxels, 1/256 voxel in integers; millimetres live at the edge, in the [`pose`].
//! No heap, no panic, no unsafe code: the caller lends all memory ([`sizes`] tells how much),
//! constructors check everything, steps do a bounded piece of work and cannot fail. That nothing can panic is proved by the
//! linker, for the profile of the firmwares in `targets`: optimised for speed or for size, link-time optimisation, one code
//! unit, no overflow checks. Other profiles may keep checks that never fail. A step takes up to 18 KiB of stack.
//!
//! ```
//! use lacuna::completion::{Completion, Outcome, Settings};
//! use lacuna::cloud::Packed;
//! use lacuna::brick::MAX_BRICK_VOXELS;
//! use lacuna::{Cloud, Error, Fixed, Memory, Model, Pose, Schedule, pose_fit::ROUNDS};
//!
//! /// `model`: the bytes of a model file; `points`: packed by [`cloud::pack`](lacuna::cloud::pack) in steps of `step` scan
//! /// units; `memory`: statics of the [`Sizes`](lacuna::Sizes) that the model requires; `surface` is told of every stored
//! /// voxel's place and signed distance, 1/256 voxel.
//! fn complete(
//!     model: &[u8],
//!     (points, step): (&[Packed], f32),
//!     rough_pose: Pose,
//!     mut memory: Memory<'_, Fixed>,
//!     mut surface: impl FnMut([u16; 3], i16),
//! ) -> Result<Outcome, Error> {
//!     let model = Model::from_bytes(model)?;
//!     let schedule = Schedule::of(&model);
//!     let settings = Settings { rounds: &ROUNDS, schedule };
//!     let cloud = Cloud::new(points, step)?;
//!     let mut job = Completion::new(&model, cloud, rough_pose, settings, memory.reborrow())?;
//!     while let Some((_stage, _progress)) = job.step() {
//!         // Serve the line, feed the watchdog.
//!     }
//!     let outcome = job.outcome()?;
//!     if let Some(fit) = job.local() {
//!         for brick in model.bricks() {
//!             let mut buffer = [0; MAX_BRICK_VOXELS];
//!             let distances = fit.ordered_distances(&brick, &mut buffer);
//!             brick.places().zip(distances).for_each(|((_, place), &distance)| surface(place, distance));
//!         }
//!     }
//!     Ok(outcome)
//! }
//! ```
//!
//! Features: `defmt` gives errors, stages and outcomes a format for logs; `vector` is for processors with a vector unit
//! for integers (Cortex-M55), the same bits in fewer instructions.
#![no_std]
#![forbid(unsafe_code)]
#![deny(missing_docs)]
#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

// What an application uses: the model, the scan, the stages of a completion and the wire.
pub mod brick;
pub mod cloud;
pub mod completion;
pub mod curve;
pub mod depth;
pub mod digest;
pub mod error;
pub mod format;
pub mod global_fit;
pub mod grid;
pub mod hull;
pub mod local_fit;
pub mod memory;
pub mod mirror;
pub mod model;
pub mod pose;
pub mod pose_fit;
pub mod progress;
pub mod schedule;
pub mod sizes;
pub mod standing;
pub mod wire;
pub mod workspace;

// What these are made of: public for the host, benches and tests, which look at single steps. It may change at any time.
pub mod arithmetic;
pub mod box_filter;
pub mod columns;
pub mod corner_rows;
pub mod corners;
pub mod cube;
pub mod distance_cache;
pub mod fixed;
pub mod gradient;
pub mod nodes;
pub mod patch;
pub mod pose_row;
pub mod sample;
pub mod trilinear;

mod bytes;
mod cells;
mod cholesky;
mod curvature;
mod field;
mod hint;
mod hull_rows;
mod lent;
mod packed;
mod reach;
mod target;

pub use arithmetic::{Arithmetic, Fixed, Float};
pub use cloud::Cloud;
pub use completion::Completion;
pub use error::Error;
pub use global_fit::GlobalFit;
pub use hull::{Hull, HullBuilder, Reach};
pub use local_fit::LocalFit;
pub use memory::Memory;
pub use model::Model;
pub use pose::Pose;
pub use pose_fit::{PoseBuffers, PoseFit};
pub use progress::Progress;
pub use schedule::{Pass, Schedule};
pub use sizes::Sizes;
pub use standing::Standing;
pub use workspace::Workspace;
