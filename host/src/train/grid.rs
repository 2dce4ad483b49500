//! The grid training works on: its sides, and the memory its volumes need, known before any is taken.

use super::{Error, Settings, bounds};
use crate::class;
use crate::mesh::Mesh;

/// Edge of a voxel in class millimetres, if the longest side allows it.
const USUAL_SPACING: f64 = 3.3;
/// Voxels along the longest side, at least and at most.
const SIDE_VOXELS: [f64; 2] = [60.0, 90.0];

/// Longest edge of a voxel in class millimetres: the format holds ridges of the fit down to 1e-6 voxel², the least of
/// them at 50 class millimetres; held-back shapes are a little smaller than all.
const COARSEST: f64 = 45.0;
/// Largest number of voxels a side.
const MOST: f64 = lacuna::grid::MAX_SIDE as f64;
/// Bytes of a voxel that is measured, for each shape: distance and border, column, mode, mode in file order.
const PER_SHAPE: u64 = 5 + 4 + 4 + 4;
/// Bytes of a voxel that is measured, whatever the number of shapes.
const PER_VOXEL: u64 = 32;
/// Bytes of a far node: of a shape's distance and border, and of the moments.
const PER_NODE: [u64; 2] = [5, 32];
/// Bytes of a triangle and of a vertex of a mesh with its search tree. 30 faces of 15,624 triangles took 243 MB
/// before a voxel was measured; 255 MB are counted, with the volumes at 3.3 mm 362 MB.
const PER_TRIANGLE: u64 = 480;
const PER_VERTEX: u64 = 64;
/// Least share of a grid's brick cells that are stored, where there are so many cells that it matters: a closed surface in a
/// grid of 75 cells a side, two cells thick, which is less than a band is on so fine a grid. The exact number is known only
/// when all distances are measured.
const STORED: f64 = 0.15;
/// Bytes of a voxel of a whole volume, for each shape: distance, deviation from the mean, and component.
const PER_WHOLE: u64 = 8 + 8 + 8;
/// Bytes of a voxel of a mode, or of a weight, in double precision; fields of weights that a fit holds at a time: the
/// weights, those before, their gradient and the update.
const PER_REFERENCE: u64 = 8;
const FIELDS: u64 = 4;
/// Bytes of a voxel of the whole grid while a line of sight volume is made.
const PER_SIGHT: u64 = 24;

/// Voxels from node to node where a class millimetre is so many voxels: about ten class millimetres.
pub fn usual_stride(millimetre: f64) -> u8 {
    (10.0 * millimetre).round().clamp(1.0, 4.0) as u8
}

/// Voxel edge of a class, voxels from node to node, and voxels of a brick's edge.
pub(super) fn voxel(shapes: &[Mesh], settings: &Settings) -> (f64, u8, usize) {
    let millimetre = class::millimetre(shapes);
    let (low, high) = bounds(shapes);
    let spacing = settings.spacing.unwrap_or_else(|| usual_spacing(millimetre, (high - low).max()));
    let stride = settings.stride.unwrap_or_else(|| usual_stride(millimetre / spacing));
    (spacing, stride, if stride == 3 { 6 } else { 8 })
}

/// Voxels along each side for lengths in the unit of the spacing: whole bricks.
///
/// # Errors
/// More than the format knows.
pub(super) fn sides(lengths: [f64; 3], spacing: f64, brick: usize) -> Result<[usize; 3], Error> {
    let longest = lengths.into_iter().fold(0.0, f64::max) / spacing;
    let sides = lengths.map(|length| {
        let voxels = (length / spacing).min(2.0 * MOST).ceil() as usize + 1;
        voxels.div_ceil(brick) * brick
    });
    if longest.is_nan() || longest > MOST || sides.iter().any(|&side| side as f64 > MOST) {
        return Err(Error::TooFine { spacing, voxels: longest });
    }
    Ok(sides)
}

/// Whether a grid of the spacing asked for can be made at all, judged by the shapes as they are, before they
/// are aligned: too small or too large a spacing is refused at once.
///
/// # Errors
/// [`Error::TooFine`], [`Error::TooCoarse`], [`Error::TooManyBricks`], or [`Error::Memory`] where the meshes alone need
/// too much.
pub fn check(shapes: &[Mesh], settings: &Settings) -> Result<(), Error> {
    let Some((low, high)) = shapes.first().and_then(Mesh::bounds) else { return Ok(()) };
    Budget::new(shapes, settings).check_nodes(0)?;
    let (spacing, _, brick) = voxel(shapes, settings);
    if !(spacing as f32).is_normal() || !((1.0 / spacing) as f32).is_normal() {
        return Err(Error::Spacing(spacing));
    }
    let limit = coarsest(shapes);
    if spacing > limit {
        return Err(Error::TooCoarse { spacing, limit });
    }
    sides((high - low).into(), spacing, brick)?;
    let cells: f64 =
        (high - low).iter().map(|length| (length / spacing / brick as f64).floor().max(1.0)).product();
    let bricks = cells * STORED;
    if bricks >= f64::from(lacuna::format::ABSENT) {
        return Err(Error::TooManyBricks(bricks as usize));
    }
    Ok(())
}

/// The longest edge of a voxel that shapes' models can have.
pub(super) fn coarsest(shapes: &[Mesh]) -> f64 {
    COARSEST * class::millimetre(shapes)
}

/// The memory that volumes of some shapes may take.
pub struct Budget {
    shapes: u64,
    /// Bytes that meshes and their search trees take.
    held: u64,
    limit: u64,
}

impl Budget {
    /// What the settings allow for these shapes.
    pub fn new(shapes: &[Mesh], settings: &Settings) -> Self {
        let held =
            |mesh: &Mesh| mesh.triangles.len() as u64 * PER_TRIANGLE + mesh.points.len() as u64 * PER_VERTEX;
        Self { shapes: shapes.len() as u64, held: shapes.iter().map(held).sum(), limit: settings.memory }
    }

    /// Refuses more far nodes than there is memory for.
    pub(super) fn check_nodes(&self, nodes: usize) -> Result<(), Error> {
        let [each, all] = PER_NODE;
        self.check(nodes as u64, each * self.shapes + all, 0)
    }

    /// Refuses more measured voxels than there is memory for; `sight` is the number of voxels of the whole grid
    /// where distances are taken along lines of sight.
    pub(super) fn check_voxels(&self, measured: usize, sight: usize) -> Result<(), Error> {
        let threads = self.shapes.min(rayon::current_num_threads() as u64);
        let more = (sight as u64).saturating_mul(PER_SIGHT * threads);
        self.check(measured as u64, PER_SHAPE * self.shapes + PER_VOXEL, more)
    }

    /// Refuses whole volumes of some of the shapes, and their components, larger than there is memory for.
    ///
    /// # Errors
    /// [`Error::Memory`].
    pub fn check_whole(&self, sides: [u16; 3], members: usize) -> Result<(), Error> {
        let voxels = sides.iter().map(|&side| u64::from(side)).product();
        self.check(voxels, PER_WHOLE * members as u64, 0)
    }

    /// Refuses a model's modes as whole volumes in double precision, and as many fields of weights for each of the `fits` at a
    /// time, larger than there is memory for.
    ///
    /// # Errors
    /// [`Error::Memory`].
    pub fn check_reference(&self, sides: [u16; 3], modes: usize, fits: usize) -> Result<(), Error> {
        let voxels = sides.iter().map(|&side| u64::from(side)).product();
        let at_a_time = fits.min(rayon::current_num_threads()) as u64;
        self.check(voxels, PER_REFERENCE * (modes as u64 + 1) * (1 + FIELDS * at_a_time), 0)
    }

    fn check(&self, count: u64, each: u64, more: u64) -> Result<(), Error> {
        let needed = count.saturating_mul(each).saturating_add(more).saturating_add(self.held);
        let (limit, shapes) = (self.limit, self.shapes);
        if needed <= limit { Ok(()) } else { Err(Error::Memory { needed, limit, shapes }) }
    }
}

/// Voxel edge for a class: finer for slender shapes, within bounds.
fn usual_spacing(millimetre: f64, size: f64) -> f64 {
    (USUAL_SPACING * millimetre).clamp(size / SIDE_VOXELS[1], size / SIDE_VOXELS[0])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::shapes::ball;

    fn settings(spacing: f64) -> Settings {
        Settings { spacing: Some(spacing), ..Settings::default() }
    }

    #[test]
    fn spacings_that_make_no_grid_are_refused() {
        let shapes = [25.0, 27.0].map(|factor| {
            let mut mesh = ball(12, 4.0);
            mesh.points.iter_mut().for_each(|p| *p *= factor);
            mesh
        });
        assert!(check(&shapes, &settings(3.0)).is_ok());
        for tiny in [0.1, 1e-3, 1e-30] {
            assert!(matches!(check(&shapes, &settings(tiny)), Err(Error::TooFine { .. })), "{tiny}");
        }
        assert!(matches!(check(&shapes, &settings(0.25)), Err(Error::TooManyBricks(_))));
        for coarse in [100.0, 1e5] {
            assert!(matches!(check(&shapes, &settings(coarse)), Err(Error::TooCoarse { .. })), "{coarse}");
        }
        for odd in [1e-300, 1e300] {
            assert!(matches!(check(&shapes, &settings(odd)), Err(Error::Spacing(_))), "{odd}");
        }
    }

    #[test]
    fn memory_is_counted_for_every_shape() {
        let budget = |shapes, limit| Budget { shapes, held: 1000, limit };
        assert!(budget(10, 203_000).check_voxels(1000, 0).is_ok());
        assert!(budget(11, 203_000).check_voxels(1000, 0).is_err());
        assert!(
            budget(10, 83_000).check_nodes(1000).is_ok() && budget(10, 83_000).check_nodes(1001).is_err()
        );
        assert!(budget(10, u64::MAX - 1).check_voxels(usize::MAX, usize::MAX).is_err());
        let shapes = [ball(12, 4.0), ball(12, 4.5)];
        let small = Settings { memory: 1000, ..Settings::default() };
        assert!(matches!(check(&shapes, &small), Err(Error::Memory { shapes: 2, .. })));
    }
}
