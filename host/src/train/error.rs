//! Why training is refused.

use super::choice::Size;
use super::{Footprint, Limits};
use crate::sentence::sentence;

/// Why training is refused.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// Fewer than two shapes.
    #[error("a model needs at least 2 training shapes, {0} given: add meshes")]
    TooFew(usize),
    /// A shape without area.
    #[error("training shape {} has no triangles with an area: a model is trained on meshes, not on points", .0 + 1)]
    NoSurface(usize),
    /// All shapes are equal.
    #[error("the training shapes do not differ: a model needs shapes that vary")]
    NoVariation,
    /// A grid that is too large.
    #[error(
        "a voxel of {spacing} makes a grid of {voxels:.0} voxels a side, over 1024: choose a larger --spacing"
    )]
    TooFine {
        /// The voxel edge asked for.
        spacing: f64,
        /// Voxels along the longest side, without the margin.
        voxels: f64,
    },
    /// A grid whose voxels are longer than what the fit measures.
    #[error(
        "a voxel of {spacing} is too coarse for these shapes, at most {limit:.4} can be: choose a smaller --spacing"
    )]
    TooCoarse {
        /// The voxel edge asked for.
        spacing: f64,
        /// The longest one.
        limit: f64,
    },
    /// A voxel edge that single precision cannot hold.
    #[error("a voxel of {0:e} is no usable length: choose a --spacing in the unit of the meshes")]
    Spacing(f64),
    /// More memory than allowed.
    #[error(
        "meshes and volumes of {shapes} shapes may need {needed} bytes of memory, --max-memory allows {limit}: choose a \
         larger --spacing, use fewer shapes, or allow more"
    )]
    Memory {
        /// Bytes they may need.
        needed: u64,
        /// Bytes allowed.
        limit: u64,
        /// Number of shapes.
        shapes: u64,
    },
    /// Nothing common to the shapes.
    #[error(
        "the training shapes have no surface in common: are they of one class, and in one pose (--align)?"
    )]
    NoBand,
    /// No plane the shapes are symmetric about.
    #[error(
        "the shapes are not symmetric: their best mirror images lie {:.1} % of their size off in the root mean square, at most \
         {:.1} % are allowed; train without --symmetric", 100.0 * deviation, 100.0 * limit
    )]
    NotSymmetric {
        /// Root mean square distance of the mirror images, a share of the shapes' size.
        deviation: f64,
        /// Largest one allowed.
        limit: f64,
    },
    /// Nothing that is small enough for the device.
    #[error(
        "no model is small enough: with {} mode{} and voxels of {} it takes {}; allow more{}", size.modes,
        if size.modes == 1 { "" } else { "s" }, size.spacing, beside(smallest, limits), advice(fixed)
    )]
    TooLarge {
        /// What the smallest model takes.
        smallest: Footprint,
        /// Its voxels and modes.
        size: Size,
        /// What it may take.
        limits: Limits,
        /// The options that it could be made smaller without.
        fixed: Vec<&'static str>,
    },
    /// A model that was made and that the core refuses.
    #[error("{}", sentence("the model", .0))]
    Unusable(lacuna::Error),
    /// More bricks than a file can number.
    #[error("the model would store {0} bricks, at most 65534 can be: choose a larger --spacing")]
    TooManyBricks(usize),
    /// A file longer than its own length field can say.
    #[error("the model would be {0} bytes long, over 4 GiB: choose a larger --spacing or fewer --modes")]
    TooManyBytes(usize),
}

/// What a model takes of what it may take.
fn beside(taken: &Footprint, limits: &Limits) -> String {
    let flash = limits.flash.map(|limit| format!("{} bytes of flash (--flash {limit})", taken.flash));
    let ram = limits.ram.map(|limit| format!("{} bytes of RAM (--ram {limit})", taken.ram));
    flash.into_iter().chain(ram).collect::<Vec<_>>().join(" and ")
}

/// What can be done besides allowing more, where some options were asked for: with the spacing given, weight nodes farther apart
/// make the fit's memory smaller.
fn advice(fixed: &[&str]) -> String {
    let wider = if fixed.contains(&"--spacing") && !fixed.contains(&"--stride") {
        " ask for a wider --stride, or"
    } else {
        ""
    };
    match fixed.join(" and ").as_str() {
        "" | "--stride" => ", or cut the shapes to the part that matters".into(),
        options => format!(", or{wider} leave out {options}"),
    }
}
