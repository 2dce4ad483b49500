//! Class millimetres, the unit of the method's lengths.

use crate::mesh::Mesh;

/// Root of the surface of a shape, class millimetres.
pub const SIDE: f64 = 280.0;

/// One class millimetre, in the shapes' unit: all lengths of the method are stated for faces, whose surface is about
/// 280 mm × 280 mm; other classes scale them with the root of their surface area.
pub fn millimetre(shapes: &[Mesh]) -> f64 {
    let mean = shapes.iter().map(Mesh::area).sum::<f64>() / shapes.len().max(1) as f64;
    mean.sqrt() / SIDE
}
