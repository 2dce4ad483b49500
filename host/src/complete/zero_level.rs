//! The zero level of fitted distances, a surface in the scan's frame.

use super::dense::Dense;
use crate::mesh::{Mesh, Point};
use crate::raster;
use crate::register::Placed;
use crate::surface::{Volume, close_holes, largest_component, marching_cubes, open_rim, trim_rim};
use rayon::prelude::*;

/// Strips at the rim narrower than twice this are cut off, voxels.
const NARROW: f64 = 1.5;
/// The same on the model's own grid.
const COARSE_NARROW: f64 = 0.8;

/// Bytes of memory that extracting a surface takes for a voxel of the finer grid, with the mesh. (The built-in model: 16 twice
/// as fine, 10 four times as fine; the finer the grid, the less the mesh is of it.)
const BYTES_A_VOXEL: u64 = 16;

/// Bytes of memory that extracting the zero level `factor` times as fine as a model's grid may take.
pub fn memory(sides: [u16; 3], factor: usize) -> u64 {
    let fine = |side: u16| u64::from(side).saturating_mul(factor as u64);
    sides.into_iter().map(fine).fold(BYTES_A_VOXEL, u64::saturating_mul)
}

/// The zero level in the scan's frame: largest piece without holes, rim trimmed, on a grid `factor` times as fine.
pub fn surface(field: &Dense, placed: &Placed, factor: usize) -> Mesh {
    let fine = finer(field, factor.max(1));
    let volume = Volume { dims: fine.sides, values: &fine.values };
    let mesh = marching_cubes(&volume, &Point::origin(), 1.0 / factor.max(1) as f64);
    let whole = close_holes(&largest_component(&mesh));
    let narrow = if factor > 1 { NARROW } else { COARSE_NARROW };
    let mut mesh = close_holes(&trim_rim(&close_holes(&open_rim(&whole, narrow)), factor.max(1)));
    mesh.points.par_iter_mut().for_each(|p| *p = placed.to_scan(p));
    mesh
}

/// Interpolation to a finer grid by cubics along one axis after the other. Piecewise linear distances would scallop
/// the edges of thin parts, with the voxels' period.
fn finer(field: &Dense, factor: usize) -> Dense {
    let mut field = field.clone();
    if factor > 1 {
        (0..3).for_each(|axis| field = finer_along(&field, axis, factor));
    }
    field
}

fn finer_along(field: &Dense, axis: usize, factor: usize) -> Dense {
    let mut sides = field.sides;
    sides[axis] = (sides[axis] - 1) * factor + 1;
    let step = raster::strides(field.sides)[axis];
    let last = field.sides[axis] - 1;
    let value = |i: usize| {
        let mut voxel = raster::voxel(sides, i);
        let (low, part) = (voxel[axis] / factor, voxel[axis] % factor);
        voxel[axis] = low;
        let at = raster::index(field.sides, voxel);
        if part == 0 {
            return field.values[at];
        }
        let before = if low > 0 { field.values[at - step] } else { f32::NAN };
        let behind = if low + 1 < last { field.values[at + 2 * step] } else { f32::NAN };
        cubic([before, field.values[at], field.values[at + step], behind], part as f32 / factor as f32)
    };
    let values = (0..raster::len(sides)).into_par_iter().map(value).collect();
    Dense { sides, values }
}

/// Between the second and the third of four values in a row (Catmull and Rom 1974); an unknown outer one is taken to
/// go on straight.
fn cubic([before, a, b, behind]: [f32; 4], t: f32) -> f32 {
    let before = if before.is_nan() { 2.0 * a - b } else { before };
    let behind = if behind.is_nan() { 2.0 * b - a } else { behind };
    let bend = 2.0 * before - 5.0 * a + 4.0 * b - behind;
    let twist = 3.0 * (a - b) + behind - before;
    a + 0.5 * t * (b - before + t * (bend + t * twist))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_surface_twice_as_fine_may_take_eight_times_the_memory() {
        assert_eq!(memory([60, 72, 54], 1), 16 * 60 * 72 * 54);
        assert_eq!(memory([60, 72, 54], 2), 8 * memory([60, 72, 54], 1));
        assert_eq!(memory([u16::MAX; 3], usize::MAX), u64::MAX);
    }

    #[test]
    fn a_finer_grid_interpolates_and_keeps_the_known_voxels() {
        let values = (0..27).map(|i| if i == 26 { f32::NAN } else { (i % 3) as f32 }).collect();
        let fine = finer(&Dense { sides: [3; 3], values }, 2);
        assert_eq!(fine.sides, [5; 3]);
        assert_eq!(&fine.values[..5], [0.0, 0.5, 1.0, 1.5, 2.0]);
        assert_eq!(fine.values[4 * 25 + 4 * 5 + 2], 1.0);
        assert!(fine.values[4 * 25 + 4 * 5 + 3].is_nan());
    }

    #[test]
    fn between_voxels_a_bent_distance_stays_bent() {
        let square = |x: f32| (x - 2.2) * (x - 2.2);
        let values = (0..5 * 5 * 5).map(|i| square((i / 5 % 5) as f32)).collect();
        let fine = finer(&Dense { sides: [5; 3], values }, 4);
        let along = |y: usize| fine.values[y * 17];
        // Inside; in the outermost cells the row is taken to go on straight.
        (4..=12).for_each(|y| assert!((along(y) - square(y as f32 / 4.0)).abs() < 1e-5, "{y}"));
        assert!((1..4).all(|y| along(y) < along(y - 1)) && (13..=16).all(|y| along(y) > along(y - 1)));
    }
}
