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
//! No heap, no panic, no unsafe code: the caller lends all memory ([`workspace`] tells how much),
//! constructors check everything, steps do a bounded piece of work and cannot fail.
#![no_std]
#![forbid(unsafe_code)]
#![deny(missing_docs)]

pub mod arithmetic;
pub mod box_filter;
pub mod cells;
pub mod cholesky;
pub mod cloud;
pub mod columns;
pub mod completion;
pub mod corner_rows;
pub mod corners;
pub mod cube;
pub mod curvature;
pub mod curve;
pub mod depth;
pub mod error;
pub mod field;
pub mod fitted;
pub mod fixed;
pub mod format;
pub mod global_fit;
pub mod gradient;
pub mod grid;
pub mod hull;
pub mod hull_rows;
pub mod lent;
pub mod local_fit;
pub mod mirror;
pub mod model;
pub mod nodes;
pub mod patch;
pub mod pose;
pub mod pose_fit;
pub mod pose_row;
pub mod sample;
pub mod schedule;
pub mod standing;
pub mod wire;
pub mod workspace;

pub use arithmetic::{Arithmetic, Fixed, Float};
pub use cloud::Cloud;
pub use completion::Completion;
pub use error::Error;
pub use global_fit::GlobalFit;
pub use hull::{Hull, HullBuilder, Reach};
pub use local_fit::LocalFit;
pub use model::Model;
pub use pose::Pose;
pub use pose_fit::{PoseBuffers, PoseFit};
pub use schedule::{Pass, Schedule};
pub use standing::Standing;
pub use workspace::{Progress, Sizes, Workspace};
