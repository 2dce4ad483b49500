//! What a model maker can choose.

use super::Limits;
use super::jitter::Apart;
use lacuna::format::Unit;

/// How the training shapes' distances are measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Distances {
    /// Exactly, to the closest triangle: for clean meshes.
    Exact,
    /// Along lines of sight, then propagated: for scans, and for meshes that fold or cut themselves.
    Sight,
}

/// What a model maker can choose.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Name of the shape class.
    pub class: String,
    /// Voxel edge in the unit of the meshes; from the class's size if not given.
    pub spacing: Option<f64>,
    /// Most modes to keep; as many as the shapes have if not given.
    pub modes: Option<usize>,
    /// Stride of the weight grid, voxels; from the spacing if not given.
    pub stride: Option<u8>,
    /// Unit of the meshes.
    pub unit: Unit,
    /// How distances are measured.
    pub distances: Distances,
    /// Whether the class is symmetric about a plane, to be found.
    pub symmetric: bool,
    /// How far the shapes lay from the pose they were drawn to, in their unit, if they were.
    pub apart: Option<Apart>,
    /// Bytes of memory that the volumes may take.
    pub memory: u64,
    /// What the model may take of a device: what is not given of spacing and modes is chosen by it.
    pub limits: Limits,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            class: "shape".into(),
            spacing: None,
            modes: None,
            stride: None,
            unit: Unit::Millimetre,
            distances: Distances::Exact,
            symmetric: false,
            apart: None,
            memory: u64::MAX,
            limits: Limits::default(),
        }
    }
}
