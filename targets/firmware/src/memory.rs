//! All memory of a completion, in statics: `size` shows at build time whether it fits.

use lacuna::arithmetic::Fixed;
use lacuna::cloud::{CAPACITY, Packed};
use lacuna::columns::{Column, PATCH};
use lacuna::corner_rows::{FixedRow, Row};
use lacuna::fixed::Factor;
use lacuna::{Memory, PoseBuffers, Workspace};
use static_cell::ConstStaticCell;

/// Sizes that the build has asked the model for.
mod sizes {
    include!(concat!(env!("OUT_DIR"), "/sizes.rs"));
}

/// Pixels of a depth image that are kept: two rows of 1280, or four of 640.
const ROWS: usize = 2560;

type Cell<T, const N: usize> = ConstStaticCell<[T; N]>;

static POINT_BUFFER: Cell<Packed, CAPACITY> = Cell::new([[0; 6]; CAPACITY]);
static ROW_BUFFER: Cell<u16, ROWS> = Cell::new([0; ROWS]);
static TARGETS: Cell<i16, { sizes::TARGETS }> = Cell::new([0; sizes::TARGETS]);
static NORMAL: Cell<f64, { sizes::NORMAL }> = Cell::new([0.0; sizes::NORMAL]);
static BLOCK: Cell<i32, { sizes::BLOCK }> = Cell::new([0; sizes::BLOCK]);
static GLOBAL: Cell<f64, { sizes::GLOBAL }> = Cell::new([0.0; sizes::GLOBAL]);
static POSE_NORMAL: Cell<f64, { sizes::POSE_NORMAL }> = Cell::new([0.0; sizes::POSE_NORMAL]);
static POSE_CHUNK: Cell<f32, { sizes::POSE_CHUNK }> = Cell::new([0.0; sizes::POSE_CHUNK]);
static POSE_COLUMNS: Cell<Column, { sizes::POSE_COLUMNS }> = Cell::new([[0; PATCH]; sizes::POSE_COLUMNS]);
static POSE_WEIGHTS: Cell<f32, { sizes::POSE_WEIGHTS }> = Cell::new([0.0; sizes::POSE_WEIGHTS]);
static NODE_WEIGHTS: Cell<i16, { sizes::NODE_WEIGHTS }> = Cell::new([0; sizes::NODE_WEIGHTS]);
static PREVIOUS: Cell<i16, { sizes::PREVIOUS }> = Cell::new([0; sizes::PREVIOUS]);
static RESIDUALS: Cell<i16, { sizes::RESIDUALS }> = Cell::new([0; sizes::RESIDUALS]);
static HULL_ROWS: Cell<u8, { sizes::HULL_ROWS }> = Cell::new([0; sizes::HULL_ROWS]);
static GRADIENT: Cell<i32, { sizes::GRADIENT }> = Cell::new([0; sizes::GRADIENT]);
static DENSE: Cell<i32, { sizes::DENSE }> = Cell::new([0; sizes::DENSE]);
static RECIPROCALS: Cell<Factor, { sizes::RECIPROCALS }> = Cell::new([Factor::ZERO; sizes::RECIPROCALS]);
static NODES: Cell<u32, { sizes::NODES }> = Cell::new([0; sizes::NODES]);
static CELL: Cell<FixedRow, { sizes::CELL }> = Cell::new([<FixedRow as Row<Fixed>>::EMPTY; sizes::CELL]);

/// Memory for a scan on its way in.
pub struct Scan {
    /// Its points.
    pub points: &'static mut [Packed],
    /// The last rows of a depth image.
    pub rows: &'static mut [u16],
}

/// Hands out the scan's memory and the completion's; once.
pub fn take() -> Option<(Scan, Memory<'static, Fixed>)> {
    let pose = PoseBuffers {
        normal: POSE_NORMAL.try_take()?,
        chunk: POSE_CHUNK.try_take()?,
        columns: POSE_COLUMNS.try_take()?,
        weights: POSE_WEIGHTS.try_take()?,
    };
    let workspace = Workspace {
        node_weights: NODE_WEIGHTS.try_take()?,
        previous: PREVIOUS.try_take()?,
        residuals: RESIDUALS.try_take()?,
        hull_rows: HULL_ROWS.try_take()?,
        gradient: GRADIENT.try_take()?,
        dense: DENSE.try_take()?,
        reciprocals: RECIPROCALS.try_take()?,
        nodes: NODES.try_take()?,
        cell: CELL.try_take()?,
    };
    let memory = Memory {
        pose,
        targets: TARGETS.try_take()?,
        normal: NORMAL.try_take()?,
        block: BLOCK.try_take()?,
        global: GLOBAL.try_take()?,
        workspace,
    };
    Some((Scan { points: POINT_BUFFER.try_take()?, rows: ROW_BUFFER.try_take()? }, memory))
}
