//! The model file, byte for byte. All numbers are little endian; nothing is aligned, nothing is padded.
//!
//! | offset | size | content |
//! |---|---|---|
//! | 0 | 8 | magic `LACUNA\x1a\n` |
//! | 8 | 2 | format version, 4 |
//! | 10 | 2 | length of the header, H |
//! | 12 | 4 | length of the whole file |
//! | 16 | 4 | CRC-32/ISO-HDLC of all bytes but these four |
//! | 20 | H | [`Header`], then `Option` of [`Symmetry`], of [`Calibration`], of [`Jitter`] and of [`factors`](factor), postcard |
//! | | 8 K | modes, the strongest first: f32 standard deviation (root mean square over the band, voxels), f32 gain g, both above 0 and at most [`MAX_MODE`] |
//! | | 2 F | far field: i16 mean distance (1/256 voxel) at every `far_stride`-th voxel, [`UNKNOWN`] off the support |
//! | | 2 C | map: u16 brick number per brick cell, [`ABSENT`] where none is stored |
//! | | 12 B | directory, by rising cell: per brick u32 cell, u32 number of its first voxel, u32 offset of its record |
//! | | | brick records, in the order of the directory |
//!
//! with K modes, F = product of (side / far_stride + 1), C brick cells, B bricks, all x fastest.
//! Offsets count from the first record. A record of a brick of edge b with n stored voxels is
//!
//! | size | content |
//! |---|---|
//! | K | exponents E, [`MIN_EXPONENT`](crate::arithmetic::MIN_EXPONENT)..=[`MAX_EXPONENT`](crate::arithmetic::MAX_EXPONENT) |
//! | 3 b² | rows along x, y fastest: u8 mask of the stored voxels (bit 0 is x = 0), u16 voxels in the rows before |
//! | 2 n | mean distances M, i16, 1/256 voxel |
//! | n K | basis, i8: b'_k = value · 2^-E voxels per standard deviation, the modes of a voxel side by side |
//!
//! Voxels are numbered through the file: brick by brick, row by row, along x.
//!
//! # Versions
//! The version is one number, apart from that of the program. It changes whenever a reader of the previous one
//! would misread or refuse the bytes: a field added to the header, a table added, a number meant otherwise. What a
//! version means never changes afterwards.
//!
//! A reader knows a list of versions, reads each of them for ever, to the same numbers, and refuses all others by
//! name ([`Error::UnknownVersion`](crate::Error::UnknownVersion)), before it looks at anything behind the first 20
//! bytes, which are the same in all versions. The program writes the newest one. A new version therefore brings
//! a way to read it, not a change of the way the older ones are read, and a model of its own in
//! `fixtures/data/versions`; those of the older ones stay there, and a test reads all of them.
//!
//! A header is read to its last byte; more or fewer bytes than its fields take are refused, so nothing can be added
//! to it without a new version.
//!
//! | version | since | what changed |
//! |---|---|---|
//! | 1 | 0.1.0 | the first one; its header ends without symmetry and calibration |
//! | 2 | 0.1.0 | symmetry and calibration behind the header's fields |
//! | 3 | 0.1.0 | jitter behind them |
//! | 4 | 0.1.0 | a factor of the expected error for each brick behind them |

use crate::arithmetic::DISTANCE_BITS;
use crate::digest::Digest;
use serde::{Deserialize, Serialize};

/// First bytes of a model; the last two catch transfers that treat it as text.
pub const MAGIC: [u8; 8] = *b"LACUNA\x1a\n";
/// The format version this build writes; it reads this one and all before it.
pub const VERSION: u16 = 4;
/// Length of the part before the header.
pub const PREFIX: usize = 20;
/// Offset of the version.
pub const VERSION_AT: usize = 8;
/// Offset of the header's length.
pub const HEADER_LENGTH_AT: usize = 10;
/// Offset of the file's length.
pub const LENGTH_AT: usize = 12;
/// Offset of the checksum.
pub const CHECKSUM_AT: usize = 16;
/// Units of a stored distance that are one voxel.
pub const PER_VOXEL: f32 = (1 << DISTANCE_BITS) as f32;
/// Map entry of a brick cell that is not stored.
pub const ABSENT: u16 = u16::MAX;
/// Far field value off the support.
pub const UNKNOWN: i16 = i16::MIN;
/// Most modes of a model.
pub const MAX_MODES: u8 = 127;
/// Largest standard deviation of a mode, voxels, and largest gain.
pub const MAX_MODE: f32 = 255.0;
/// Bytes of one mode in the mode table.
pub const MODE_BYTES: usize = 8;
/// Bytes of one entry of the directory.
pub const ENTRY_BYTES: usize = 12;
/// Bytes of one row in a brick record.
pub const ROW_BYTES: usize = 3;

/// CRC-32 of a model file, its own four bytes left out.
pub fn checksum(file: &[u8]) -> u32 {
    let mut digest = Digest::new();
    digest.add(file.get(..CHECKSUM_AT).unwrap_or(file));
    digest.add(file.get(PREFIX..).unwrap_or(&[]));
    digest.value()
}

/// Unit of the scans and meshes a model belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Unit {
    /// Millimetres.
    Millimetre,
    /// Metres.
    Metre,
    /// Inches.
    Inch,
    /// Micrometres.
    Micrometre,
}

/// Lengths and ridges of the fit, in voxels: chosen by the trainer from the size of the class.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Scales {
    /// One "class millimetre", voxels: 1/280 of the root of the mean surface area; 0.001 to 64.
    pub millimetre: f32,
    /// Hull reach R in front of the surface, voxels, 0.5 to 7.5.
    pub front: f32,
    /// Hull reach behind the surface, voxels, 0.25 to `front`.
    pub behind: f32,
    /// λ of the global fit for one hull voxel, voxel², 1e-6 to 1000.
    pub global_ridge: f32,
    /// λ of the local fit, voxel², 1e-6 to 1000.
    pub local_ridge: f32,
    /// δ of the local fit for one voxel, voxel²: times q³; 1e-6 to 1000.
    pub voxel_ridge: f32,
}

/// The plane a class is symmetric about, n·p = d, in voxels; see [`mirror`](crate::mirror).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Symmetry {
    /// Unit normal n.
    pub normal: [f32; 3],
    /// Offset d, voxels.
    pub offset: f32,
    /// How far the shapes' mirror images lie from the shapes, root mean square, voxels.
    pub deviation: f32,
}

/// How far the training shapes lay from the pose they have in the model, root mean square: given in one frame, they
/// were drawn to their mean, so that no mode is spent on poses. A scan in that frame differs from the model's pose as
/// much ([`EXACT`](crate::pose_fit::EXACT)). All three are from [`Jitter::LEAST`] to [`Jitter::MOST`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Jitter {
    /// Turn about each axis, radians.
    pub turn: f32,
    /// Shift of the middle along each axis, voxels.
    pub shift: f32,
    /// Logarithm of the growth.
    pub growth: f32,
}

impl Jitter {
    /// Least value of each, in its unit: less is as good as none.
    pub const LEAST: f32 = 1e-6;
    /// Largest value of each, in its unit.
    pub const MOST: f32 = 1e4;

    /// Whether poses can be tied by this: positive numbers, none of them enormous.
    pub fn is_sound(&self) -> bool {
        [self.turn, self.shift, self.growth].iter().all(|x| (Self::LEAST..=Self::MOST).contains(x))
    }
}

impl Calibration {
    /// Largest of `noise`, `seam`, `posterior`, `residual` and of the two ways; the former are 0 at least.
    pub const MOST: f32 = 1e4;
    /// Shortest way, voxels.
    pub const SHORTEST: f32 = 1e-3;

    /// Whether errors can be computed from these constants.
    pub fn is_sound(&self) -> bool {
        let within = |x: f32, low: f32, high: f32| x.is_finite() && (low..=high).contains(&x);
        self.shares.iter().all(|&share| within(share, 0.0, 1.0))
            && [self.noise, self.seam, self.posterior, self.residual]
                .iter()
                .all(|&x| within(x, 0.0, Self::MOST))
            && [self.posterior_way, self.residual_way]
                .iter()
                .all(|&way| within(way, Self::SHORTEST, Self::MOST))
    }
}

/// Constants of the expected error of a completed surface, fitted by the trainer on shapes it held back.
///
/// The one-sigma error of a vertex at the way d (along the surface, to the nearest measured vertex), where the scan
/// leaves the deviation p within the span of the modes, is, all in voxels,
///
/// ```text
/// measured: √( (noise · misfit)² + hidden² )
/// inferred: √( hidden² + f² ( seam² + ((1 - exp(-d / posterior_way)) posterior p)² + ((1 - exp(-d / residual_way)) residual)² ) )
/// ```
///
/// with f the [`factor`] of the place (1 before version 4), misfit the root mean square distance of the measured surface
/// from the fitted one, and hidden what a scan that was stitched from several views is off without showing it (0 for one
/// view). Nothing of the fit depends on it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Calibration {
    /// Scans of held-back shapes it was fitted to.
    pub scans: u16,
    /// Shares of their measured and inferred vertices whose true error lies below the stated one, which was fitted
    /// to the scans of other shapes; 0 to 1.
    pub shares: [f32; 2],
    /// Error of a measured vertex, times the scan's misfit; a factor, 0 to [`Calibration::MOST`].
    pub noise: f32,
    /// Error of an inferred vertex next to measured ones, voxels, 0 to [`Calibration::MOST`].
    pub seam: f32,
    /// Factor of the deviation that the scan leaves, 0 to [`Calibration::MOST`].
    pub posterior: f32,
    /// Way on which that deviation is reached, voxels, [`Calibration::SHORTEST`] to [`Calibration::MOST`].
    pub posterior_way: f32,
    /// What the modes do not explain, far from the scan, voxels, 0 to [`Calibration::MOST`].
    pub residual: f32,
    /// Way on which it is reached, voxels, [`Calibration::SHORTEST`] to [`Calibration::MOST`].
    pub residual_way: f32,
}

/// Byte of a [`factor`] of 1.
pub const NO_FACTOR: u8 = 128;
/// Bytes that double a [`factor`].
pub const FACTOR_STEPS: u8 = 32;

/// How much farther off than elsewhere the inferred surface is in a brick, from its byte b in the file:
/// 2^((b - [`NO_FACTOR`]) / [`FACTOR_STEPS`]), 1/16 to 16. An ear is harder to predict than a cheek as far from the scan.
/// Between the middles of the bricks its logarithm is interpolated linearly ([`Calibration`]).
pub fn factor(byte: u8) -> f32 {
    libm::exp2f((f32::from(byte) - f32::from(NO_FACTOR)) / f32::from(FACTOR_STEPS))
}

/// What a model says about itself.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Header<'a> {
    /// Name of the shape class.
    pub class: &'a str,
    /// How it was made: program version and settings.
    pub made: &'a str,
    /// Training shapes.
    pub shapes: u32,
    /// Unit of `spacing` and `origin`.
    pub unit: Unit,
    /// Edge of a voxel, more than 0.
    pub spacing: f32,
    /// Centre of voxel (0, 0, 0) in the frame of the training shapes.
    pub origin: [f32; 3],
    /// Voxels along x, y, z.
    pub sides: [u16; 3],
    /// Edge of a brick, voxels: a multiple of both strides.
    pub brick: u8,
    /// Distance of far field samples, voxels.
    pub far_stride: u8,
    /// Stride of the weight grid the model was made for, voxels.
    pub stride: u8,
    /// Modes, K, 1 to 127.
    pub modes: u8,
    /// Stored bricks.
    pub bricks: u16,
    /// Stored voxels.
    pub voxels: u32,
    /// Share of the training shapes' variance that the modes explain, 0 to 1; only shown, and not checked.
    pub explained: f32,
    /// Lengths and ridges of the fit.
    pub scales: Scales,
}
