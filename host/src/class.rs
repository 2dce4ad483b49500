//! Class millimetres, the unit of the method's lengths.

use crate::fit::means;
use crate::mesh::Mesh;
use lacuna::Model;
use lacuna::format::PER_VOXEL;

/// Root of the surface of a shape, class millimetres.
pub const SIDE: f64 = 280.0;

/// One class millimetre, in the shapes' unit: all lengths of the method are stated for faces, whose surface is about
/// 280 mm × 280 mm; other classes scale them with the root of their surface area.
pub fn millimetre(shapes: &[Mesh]) -> f64 {
    let mean = shapes.iter().map(Mesh::area).sum::<f64>() / shapes.len().max(1) as f64;
    mean.sqrt() / SIDE
}

/// Root of the area of a model's mean shape in terms of that of its training shapes: about 1. The area, in voxels, is about
/// the number of voxels within half a voxel of the surface.
pub fn mean_growth(model: &Model<'_>) -> f64 {
    let near =
        means(model).iter().filter(|distance| 2.0 * f32::from(distance.saturating_abs()) < PER_VOXEL).count();
    (near as f64).sqrt() / SIDE / f64::from(model.header().scales.millimetre)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mean_shape_is_about_as_large_as_the_shapes() {
        for bytes in [lacuna_fixtures::MODEL, lacuna_fixtures::VERSIONS[0].model] {
            let growth = mean_growth(&Model::from_bytes(bytes).expect("a model"));
            assert!((growth - 1.0).abs() < 0.05, "{growth}");
        }
    }
}
