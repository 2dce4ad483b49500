//! All memory of a completion, borrowed.

use crate::arithmetic::Arithmetic;
use crate::error::Buffer;
use crate::pose_fit::PoseBuffers;
use crate::workspace::Workspace;

/// All memory of a completion, lent by the caller; by default, none. [`Sizes::required`](crate::Sizes::required) tells how
/// much.
#[derive(Debug)]
pub struct Memory<'b, A: Arithmetic> {
    /// The pose fit's.
    pub pose: PoseBuffers<'b>,
    /// Hull targets, one a stored voxel.
    pub targets: &'b mut [i16],
    /// Normal equations of the global fit.
    pub normal: &'b mut [f64],
    /// Its sums over a brick.
    pub block: &'b mut [i32],
    /// Global weights, one a mode.
    pub global: &'b mut [f64],
    /// The local fit's.
    pub workspace: Workspace<'b, A>,
}

/// What a buffer of a [`Memory`] is called, and how large it is.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Borrowed {
    pub name: Buffer,
    pub elements: usize,
    /// Bytes of an element.
    pub size: usize,
}

impl Borrowed {
    const fn new<T>(name: Buffer, buffer: &[T]) -> Self {
        Self { name, elements: buffer.len(), size: size_of::<T>() }
    }

    const fn bytes(&self) -> usize {
        // A slice has no more bytes than an isize can say.
        self.elements.saturating_mul(self.size)
    }
}

/// Buffers of a [`Memory`].
pub(crate) const BUFFERS: usize = 17;
/// Those of the pose fit, which come first.
pub(crate) const POSE_BUFFERS: usize = 4;

impl<A: Arithmetic> Memory<'_, A> {
    /// Bytes that are lent.
    pub fn bytes(&self) -> usize {
        self.buffers().iter().map(Borrowed::bytes).fold(0, usize::saturating_add)
    }

    /// All buffers, in the order of [`Sizes::named`](crate::Sizes::named).
    pub(crate) const fn buffers(&self) -> [Borrowed; BUFFERS] {
        let Self { pose, targets, normal, block, global, workspace: w } = self;
        [
            Borrowed::new(Buffer::PoseNormal, pose.normal),
            Borrowed::new(Buffer::PoseChunk, pose.chunk),
            Borrowed::new(Buffer::PoseColumns, pose.columns),
            Borrowed::new(Buffer::PoseWeights, pose.weights),
            Borrowed::new(Buffer::Targets, targets),
            Borrowed::new(Buffer::Normal, normal),
            Borrowed::new(Buffer::Block, block),
            Borrowed::new(Buffer::Global, global),
            Borrowed::new(Buffer::NodeWeights, w.node_weights),
            Borrowed::new(Buffer::Previous, w.previous),
            Borrowed::new(Buffer::Residuals, w.residuals),
            Borrowed::new(Buffer::HullRows, w.hull_rows),
            Borrowed::new(Buffer::Gradient, w.gradient),
            Borrowed::new(Buffer::Dense, w.dense),
            Borrowed::new(Buffer::Reciprocals, w.reciprocals),
            Borrowed::new(Buffer::Nodes, w.nodes),
            Borrowed::new(Buffer::Cell, w.cell),
        ]
    }

    /// The same memory, lent on for one completion.
    pub const fn reborrow(&mut self) -> Memory<'_, A> {
        Memory {
            pose: self.pose.reborrow(),
            targets: self.targets,
            normal: self.normal,
            block: self.block,
            global: self.global,
            workspace: self.workspace.reborrow(),
        }
    }
}

impl<A: Arithmetic> Default for Memory<'_, A> {
    fn default() -> Self {
        Self {
            pose: PoseBuffers::default(),
            targets: &mut [],
            normal: &mut [],
            block: &mut [],
            global: &mut [],
            workspace: Workspace::default(),
        }
    }
}
