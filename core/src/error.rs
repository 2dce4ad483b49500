//! What can be wrong with a model, a buffer or an option: all of it is found before a fit starts, but for
//! [`Error::EmptyHull`], which the hull finds.
//!
//! On the [wire](crate::wire) an error travels as its number here: new ones go to the end of their list.

use serde::{Deserialize, Serialize};

/// Why a model, a buffer or an option is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Error {
    /// The bytes do not begin with the model magic: not a Lacuna model.
    NotAModel,
    /// The model has a format version this build does not read.
    UnknownVersion {
        /// The version found in the file.
        found: u16,
    },
    /// Fewer or more bytes than the model says it has.
    WrongLength {
        /// Bytes the model announces.
        expected: u32,
        /// Bytes given.
        found: u32,
    },
    /// The checksum does not match: the bytes were damaged.
    Damaged,
    /// The checksum matches but the contents contradict each other.
    Inconsistent(Part),
    /// A borrowed buffer is too small.
    BufferTooSmall {
        /// Which buffer.
        buffer: Buffer,
        /// Elements needed, as `required(..)` tells.
        needed: u32,
        /// Elements given.
        given: u32,
    },
    /// The node stride does not divide the model's brick edge, or is not within 1..=4.
    Stride {
        /// The stride asked for, voxels.
        asked: u8,
        /// The model's brick edge, voxels.
        brick: u8,
    },
    /// A kernel radius is too wide for the proved integer bounds: stride (2 radius + 1) may be
    /// [`WIDEST`](crate::schedule::WIDEST) at most.
    Radius {
        /// The radius asked for, nodes.
        asked: u8,
    },
    /// An option is not a number in its documented range.
    Option(OptionName),
    /// The pose is not a finite similarity with a positive scale.
    Pose,
    /// Fewer than the [`FEWEST_POINTS`](crate::pose_fit::FEWEST_POINTS) that a pose needs: in the scan, or in a round of
    /// the fit.
    TooFewPoints {
        /// Points given.
        given: u32,
    },
    /// The scan does not touch the model's band: no voxel is in the hull. A wrong pose, or normals whose length is not one.
    EmptyHull,
}

/// The variant with its numbers: for logs and `?`. Sentences for people are the caller's.
impl core::fmt::Display for Error {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        core::fmt::Debug::fmt(self, f)
    }
}

impl core::error::Error for Error {}

/// Parts of a model file, for [`Error::Inconsistent`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Part {
    /// The postcard header.
    Header,
    /// The grid's size, spacing or origin.
    Grid,
    /// The lengths and ridges carried for the fit.
    Scales,
    /// The per-mode table.
    Modes,
    /// The coarse mean.
    FarField,
    /// The map from brick cells to bricks.
    Map,
    /// The list of bricks.
    Directory,
    /// A brick's rows, exponents or values.
    Brick,
}

/// Buffers, for [`Error::BufferTooSmall`]. Those of a completion have the names of the fields of [`Sizes`](crate::Sizes).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Buffer {
    /// Hull targets, one a stored voxel.
    Targets,
    /// Hull keys, one a stored voxel; in a completion the residuals' buffer holds them.
    Keys,
    /// The global fit's normal equations.
    Normal,
    /// The global fit's sums over one brick.
    Block,
    /// The global fit's weights, one a mode.
    Global,
    /// Weights of the nodes.
    NodeWeights,
    /// Weights of the nodes before the last step.
    Previous,
    /// Residuals, one a stored voxel.
    Residuals,
    /// Masks of the hull, one a row of a brick.
    HullRows,
    /// Gradients of a group of modes.
    Gradient,
    /// The dense node field of the box filter.
    Dense,
    /// Reciprocal curvatures, one an active node.
    Reciprocals,
    /// The map from nodes to active nodes.
    Nodes,
    /// Values of one interpolated cell.
    Cell,
    /// The last rows of a depth image.
    DepthRows,
    /// Rows of the pose fit's points, transposed.
    PoseColumns,
    /// The pose fit's normal equations.
    PoseNormal,
    /// The pose fit's sums over one patch of points.
    PoseChunk,
    /// The pose fit's weights, one a mode.
    PoseWeights,
}

/// Options, for [`Error::Option`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum OptionName {
    /// Hull reach in front of or behind the surface.
    Reach,
    /// Hull reach sideways.
    Lateral,
    /// Ridge of the global fit. Nothing is refused by this name any more, the ridge is the model's; it stays because those
    /// after it travel by their numbers.
    Ridge,
    /// Step length of the local fit.
    Step,
    /// Step of a cloud's coordinates.
    CloudStep,
    /// Misfit scale of the pose.
    Misfit,
    /// Width and height of a depth image.
    ImageSize,
    /// Focal length of a depth camera.
    FocalLength,
    /// Principal point of a depth camera.
    PrincipalPoint,
    /// Length of a grey level of a depth image.
    DepthUnit,
    /// Largest depth difference within a surface.
    DepthJump,
    /// Stride or reach of a depth image's pixels.
    PixelStride,
}
