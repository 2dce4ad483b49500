//! What a scan is registered to: signed distances and directions on a coarse grid, and oriented points of the
//! surface, in voxels.

use crate::class::SIDE;
use crate::distance::Surface;
use crate::fit;
use crate::mesh::{Point, Vector};
use crate::points::{OrientedPoints, thin};
use crate::raster::{self, slope};
use crate::surface::{Volume, marching_cubes};
use crate::volume::{Lattice, sample};
use lacuna::{Model, sample::far};

/// Distances and points of the shape that is looked for.
pub struct Field {
    sides: [usize; 3],
    /// Edge of a cell, voxels.
    edge: f32,
    cells: Vec<Cell>,
    /// Points on the surface, voxels.
    pub samples: OrientedPoints,
    /// Longest side of the surface's bounds, voxels.
    pub size: f64,
    /// One class millimetre, voxels.
    pub millimetre: f64,
}

/// Signed distance at a cell's centre in voxels, NaN where unknown, and the unit direction in which it grows.
#[derive(Clone, Copy)]
struct Cell {
    distance: f32,
    normal: [f32; 3],
}

/// Voxels from cell to cell in a model's grid: 6.6 mm of a face.
const STRIDE: usize = 2;
/// Class millimetres between the surface's points.
pub const SAMPLE: f64 = 13.0;

impl Field {
    /// The mean shape of a model: its stored voxels, and its far field around them.
    pub fn of_model(model: &Model<'_>) -> Self {
        let fine = fit::dense(model, &fit::means(model));
        let dims = model.grid().sides().map(usize::from);
        let sides = dims.map(|side| side.div_ceil(STRIDE));
        let values = (0..raster::len(sides)).map(|i| {
            let voxel = raster::voxel(sides, i).map(|v| v * STRIDE);
            let near = fine[raster::index(dims, voxel)];
            let around = || far(model, voxel.map(|v| v as f32)).map_or(f32::NAN, |(distance, _)| distance);
            if near.is_nan() { around() } else { near }
        });
        let (samples, size) = on_surface(dims, &fine, f64::from(model.header().scales.millimetre));
        let cells = cells(sides, &values.collect::<Vec<_>>());
        let millimetre = f64::from(model.header().scales.millimetre);
        Self { sides, edge: STRIDE as f32, cells, samples, size, millimetre }
    }

    /// A mesh of the given area, and the transform from its frame to voxels: (scale, translation).
    pub fn of_surface(surface: &Surface, low: Point, high: Point, area: f64) -> (Self, f64, Vector) {
        let spacing = (high - low).max() / 48.0;
        let margin = 4.0 * spacing;
        let sides = (high - low).map(|length| ((length + 2.0 * margin) / spacing).ceil() as usize + 1).into();
        let lattice = Lattice { origin: low - Vector::repeat(margin), spacing, sides };
        let places: Vec<u32> = (0..lattice.len() as u32).collect();
        let volume = sample(surface, &lattice, &places);
        let known = |(&d, &border): (&f32, &bool)| if border { f32::NAN } else { d / spacing as f32 };
        let values: Vec<f32> = volume.distances.iter().zip(&volume.border).map(known).collect();
        let millimetre = area.sqrt() / SIDE / spacing;
        let (samples, size) = on_surface(sides, &values, millimetre);
        let field = Self { sides, edge: 1.0, cells: cells(sides, &values), samples, size, millimetre };
        (field, 1.0 / spacing, -lattice.origin.coords / spacing)
    }

    /// Distances at the nodes of a lattice, in its spacings, NaN where unknown; the class millimetre in spacings.
    pub fn of_values(sides: [usize; 3], values: &[f32], millimetre: f64) -> Self {
        let (samples, size) = on_surface(sides, values, millimetre);
        Self { sides, edge: 1.0, cells: cells(sides, values), samples, size, millimetre }
    }

    /// Distance and unit direction of the surface at `p`, to first order from the nearest cell; `None` where unknown.
    #[inline]
    pub fn at(&self, p: [f32; 3]) -> Option<(f32, [f32; 3])> {
        let [x, y, z] = p.map(|c| c / self.edge);
        let [width, height, depth] = self.sides;
        let near = |x: f32, side: usize| (x > -0.5 && x < side as f32 - 0.5).then_some((x + 0.5) as usize);
        let (i, j, k) = (near(x, width)?, near(y, height)?, near(z, depth)?);
        let Cell { distance, normal: [a, b, c] } = self.cells[raster::index(self.sides, [i, j, k])];
        if distance.is_nan() {
            return None;
        }
        let beyond = a * (x - i as f32) + b * (y - j as f32) + c * (z - k as f32);
        Some((distance + self.edge * beyond, [a, b, c]))
    }
}

/// Points of the zero level, and its longest side.
fn on_surface(sides: [usize; 3], values: &[f32], millimetre: f64) -> (OrientedPoints, f64) {
    let mesh = marching_cubes(&Volume { dims: sides, values }, &Point::origin(), 1.0);
    let size = mesh.bounds().map_or(1.0, |(low, high)| (high - low).max());
    (thin(&mesh, SAMPLE * millimetre), size)
}

fn cells(sides: [usize; 3], values: &[f32]) -> Vec<Cell> {
    let strides = raster::strides(sides);
    let cell = |(index, &distance): (usize, &f32)| {
        let at = raster::voxel(sides, index);
        let along = |axis: usize| {
            let before = if at[axis] > 0 { values[index - strides[axis]] } else { f32::NAN };
            let after = if at[axis] + 1 < sides[axis] { values[index + strides[axis]] } else { f32::NAN };
            slope(before, distance, after)
        };
        let [x, y, z] = [along(0), along(1), along(2)];
        let length = (x * x + y * y + z * z).sqrt();
        if distance.is_nan() || length.is_nan() || length < 1e-6 {
            return Cell { distance: f32::NAN, normal: [0.0; 3] };
        }
        Cell { distance, normal: [x / length, y / length, z / length] }
    };
    values.iter().enumerate().map(cell).collect()
}
