//! What is known at a vertex about how far it may be off.

/// What is known at a vertex; lengths in voxels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cue {
    /// Whether it was moved onto the scan.
    pub measured: bool,
    /// Deviation that the scan leaves, as far as the modes go.
    pub posterior: f32,
    /// Way along the surface to the nearest measured vertex, or straight to the scan where there is none.
    pub away: f32,
    /// How far the vertex was moved from the fitted surface.
    pub height: f32,
    /// What the scan is off without showing it.
    pub hidden: f32,
    /// How much farther off than elsewhere the inferred surface is there.
    pub factor: f32,
}
