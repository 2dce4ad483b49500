//! What host and device say to each other. See the [specification](super) for when.
//!
//! On the line a message is its number in [`Request`] or [`Reply`]: new ones go to the end.

use super::refusal::Refusal;
use crate::cloud::POINT_BYTES;
use crate::completion::{Outcome, Settings, Stage};
use crate::depth::Frame;
use crate::error::Error;
use crate::format::Unit;
use crate::model::Model;
use crate::pose::Pose;
use crate::schedule::Schedule;
use serde::{Deserialize, Serialize};

pub use crate::pose_fit::Hint;

/// The protocol version of this build.
pub const VERSION: u16 = 1;
/// Most bytes of points or results in a message.
pub const MAX_DATA: usize = 960;
/// Most points in a message.
pub const MAX_BATCH: usize = MAX_DATA / POINT_BYTES;
/// Bytes of a pixel of a depth image.
pub const PIXEL_BYTES: usize = 2;
/// Most pixels in a message.
pub const MAX_PIXELS: usize = MAX_DATA / PIXEL_BYTES;

/// What the host asks.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Request<'a> {
    /// Opens a session: the header's, which must not be 0. The scan on the device stays.
    Hello {
        /// The version the host speaks.
        version: u16,
    },
    /// Asks for [`Info`].
    Info,
    /// Begins a scan and forgets the one before, with its results.
    Begin(Begin),
    /// The next points.
    Points {
        /// Number of the first of them.
        first: u32,
        /// [`POINT_BYTES`] for each.
        batch: &'a [u8],
    },
    /// Sees to it that the scan is fitted: begins the fit unless it runs or has ended well.
    Fit,
    /// Asks for [`Status`].
    Status,
    /// Asks what the fit found.
    Outcome,
    /// Asks for weights, as many from `first` on as a message holds.
    Weights {
        /// Which.
        of: Vector,
        /// Number of the first value.
        first: u32,
    },
    /// Asks for distances from a voxel on, as many as a message holds, [packed](super::distances).
    Distances {
        /// Number of the first voxel.
        first: u32,
    },
    /// Asks for [`Counters`].
    Counters,
    /// Stops the fit and forgets the scan.
    Cancel,
    /// The next pixels of a depth image, all of one row. Those left out since the last message were not measured.
    DepthRows {
        /// The row; 0 is the first.
        row: u16,
        /// Column of the first pixel.
        column: u16,
        /// Two bytes for each, little endian; 0 is "not measured".
        pixels: &'a [u8],
    },
    /// Announces a scan that comes as a depth image, and forgets the scan before.
    BeginDepth(BeginDepth),
}

/// What the device answers.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Reply<'a> {
    /// To [`Request::Hello`].
    Hello {
        /// The version the device speaks.
        version: u16,
    },
    /// To [`Request::Info`].
    Info(#[serde(borrow)] Info<'a>),
    /// To [`Request::Begin`], [`Request::Points`], [`Request::Fit`], [`Request::Status`], [`Request::Cancel`],
    /// [`Request::DepthRows`], [`Request::BeginDepth`].
    Status(Status),
    /// To [`Request::Outcome`].
    Outcome(Outcome),
    /// To [`Request::Weights`] (little endian) and [`Request::Distances`] (packed). Empty at the end.
    Data {
        /// Number of the first value.
        first: u32,
        /// At most [`MAX_DATA`].
        bytes: &'a [u8],
    },
    /// To [`Request::Counters`].
    Counters(Counters),
    /// To any.
    Refused(Refusal),
}

/// A scan to come.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Begin {
    /// A number of the host's choice, by which it knows the scan again after an interruption.
    pub scan: u32,
    /// Points to come.
    pub points: u32,
    /// Scan units a step of the points' positions.
    pub step: f32,
    /// From the scan to voxels.
    pub pose: Pose,
    /// How well the pose is known.
    pub hint: Hint,
    /// Iterations of the local fit.
    pub iterations: Iterations,
}

impl Begin {
    /// What a completion of this scan runs with: on a device, and on a host that wants the same bits.
    pub fn settings(&self, model: &Model<'_>) -> Settings<'static> {
        let schedule = self.iterations.schedule(model);
        Settings { rounds: self.hint.rounds(model), schedule }
    }
}

/// A scan to come as a depth image.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct BeginDepth {
    /// As for points, of which there may be fewer than announced.
    pub begin: Begin,
    /// How pixels become points.
    pub frame: Frame,
}

/// Iterations of the local fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Iterations {
    /// [`Schedule::of`].
    Varying,
    /// [`Schedule::with_momentum`]: needs a second copy of the weights.
    Momentum,
}

impl Iterations {
    /// Their schedule, with the stride that a model is made for.
    pub const fn schedule(self, model: &Model<'_>) -> Schedule<'static> {
        match self {
            Self::Varying => Schedule::of(model),
            Self::Momentum => Schedule::with_momentum(model),
        }
    }
}

/// Which weights.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Vector {
    /// Estimated with the pose: f32, one a mode; all zero where the pose was held.
    Shape,
    /// Of the global fit: f64, one a mode.
    Global,
}

/// What the device is and holds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Info<'a> {
    /// The machine's name.
    pub machine: &'a str,
    /// Version of the core.
    pub core: &'a str,
    /// Most points of a scan.
    pub max_points: u32,
    /// Static memory lent to points, rows of depth images, fit and protocol, bytes.
    pub ram: u32,
    /// Bytes of the model.
    pub flash: u32,
    /// [`MAX_MESSAGE`](super::frame::MAX_MESSAGE) of the device.
    pub max_message: u16,
    /// Its model, or why that is refused.
    #[serde(borrow)]
    pub model: Result<Identity<'a>, Error>,
}

/// A model's identity.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Identity<'a> {
    /// Name of the shape class, its first 64 bytes.
    pub class: &'a str,
    /// CRC-32 of the file.
    pub checksum: u32,
    /// Modes, K.
    pub modes: u8,
    /// Edge of a voxel.
    pub spacing: f32,
    /// Its unit.
    pub unit: Unit,
    /// Stored voxels: as many distances there are.
    pub voxels: u32,
}

/// How far a scan has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Status {
    /// What the device does.
    pub state: State,
    /// The scan's number, 0 without a scan.
    pub scan: u32,
    /// Points received, or pixels: whole rows of the announced width and a part of the next one.
    pub received: u32,
    /// Points announced, or pixels of the depth image.
    pub announced: u32,
}

/// What the device does.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum State {
    /// Nothing: there is no scan.
    Idle,
    /// Waits for points or pixels, or with all of them for the fit.
    Receiving,
    /// Fits.
    Fitting {
        /// The stage under way.
        stage: Stage,
        /// Pieces of its work done.
        done: u32,
        /// Pieces of its work in all.
        total: u32,
    },
    /// Has results.
    Done,
    /// The fit ended without: the scan does not go with the model.
    Failed(Error),
}

/// What the last fit cost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Counters {
    /// Pose and shape together.
    pub pose: Count,
    /// The hull.
    pub hull: Count,
    /// The global fit.
    pub global: Count,
    /// The local fit.
    pub local: Count,
    /// Distances computed for replies since then, however often they were asked for.
    pub distances: Count,
}

/// What a stage cost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Count {
    /// By the machine's own counter: instructions, cycles or ticks; 0 without one.
    pub work: u64,
    /// Bounded pieces of work.
    pub steps: u32,
}

impl Count {
    /// Adds a piece of work.
    pub const fn add(&mut self, work: u64) {
        self.work = self.work.saturating_add(work);
        self.steps = self.steps.saturating_add(1);
    }
}
