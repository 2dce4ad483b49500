//! Training: meshes of one shape class become a model file.

pub mod align;
pub mod calibration;
pub mod deform;
pub mod distance;
pub mod generalised;
pub mod grid;
pub mod held_out;
pub mod jitter;
pub mod leave_one_out;
pub mod line_of_sight;
pub mod model_file;
pub mod pca;
pub mod prepared;
pub mod propagate;
pub mod symmetry;
pub mod views;
pub mod volume;

use crate::mesh::{Mesh, Point, Vector};
use distance::Surface;
use grid::Budget;
use lacuna::format::{Header, Jitter, Scales, Unit};
use model_file::Draft;
use prepared::Prepared;
use rayon::prelude::*;
use volume::{Lattice, Volume};

/// Far field samples per brick edge are two: a brick of six voxels has one every three.
const FAR_PER_BRICK: usize = 2;
/// Largest share of training shapes that may see a node of the far field across their border. It lets the surface
/// go on beyond the stored voxels for those who reach farther than most, at no cost in the model's size.
const FAR_BORDER_SHARE: f64 = 0.95;
/// Stored voxels on either side of the mean surface, at least.
const LEAST_VOXELS: f64 = 1.8;
/// Edge of a voxel in class millimetres, if the longest side allows it.
const USUAL_SPACING: f64 = 3.3;
/// Voxels along the longest side, at least and at most.
const SIDE_VOXELS: [f64; 2] = [60.0, 90.0];

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
    /// Most modes to keep.
    pub modes: usize,
    /// Stride of the weight grid, voxels; from the spacing if not given.
    pub stride: Option<u8>,
    /// Unit of the meshes.
    pub unit: Unit,
    /// Band behind and in front of the mean surface where shapes do not vary, class millimetres.
    pub band: [f64; 2],
    /// Standard deviations of the shapes' distances by which the band is wider at each voxel.
    pub spread: f64,
    /// How distances are measured.
    pub distances: Distances,
    /// Largest share of training shapes that may see a voxel across their border.
    pub border_share: f64,
    /// Whether the class is symmetric about a plane, to be found.
    pub symmetric: bool,
    /// How far the shapes lay from the pose they were drawn to, in their unit, if they were.
    pub jitter: Option<Jitter>,
    /// Bytes of memory that the volumes may take.
    pub memory: u64,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            class: "shape".into(),
            spacing: None,
            modes: 127,
            stride: None,
            unit: Unit::Millimetre,
            band: [1.8, 2.0],
            spread: 2.6,
            distances: Distances::Exact,
            border_share: 0.75,
            symmetric: false,
            jitter: None,
            memory: u64::MAX,
        }
    }
}

/// Why training is refused.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// Fewer than two shapes.
    #[error("a model needs at least 2 training shapes, {0} given: add meshes")]
    TooFew(usize),
    /// A mesh without triangles.
    #[error("training shape {0} has no triangles with an area: a model is trained on meshes, not on points")]
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
        "the shapes are not symmetric: their best mirror images lie {deviation:.3} off in the root mean square, at \
         most {limit:.3} are allowed; train without --symmetric"
    )]
    NotSymmetric {
        /// Root mean square distance of the mirror images, in the shapes' unit.
        deviation: f64,
        /// Largest one allowed.
        limit: f64,
    },
    /// Too many bricks or bytes.
    #[error("the model would have {0} bricks, at most 65534 can be stored: choose a larger --spacing")]
    TooLarge(usize),
}

/// One "class millimetre": all lengths of the method are stated for faces, whose surface is about
/// 280 mm × 280 mm; other classes scale them with the root of their surface area.
pub fn class_millimetre(shapes: &[Mesh]) -> f64 {
    let mean = shapes.iter().map(area).sum::<f64>() / shapes.len().max(1) as f64;
    mean.sqrt() / 280.0
}

fn area(mesh: &Mesh) -> f64 {
    let double = |t: usize| {
        let [a, b, c] = mesh.corners(t);
        (b - a).cross(&(c - a)).norm()
    };
    (0..mesh.triangles.len()).map(double).sum::<f64>() / 2.0
}

/// Trains a model on aligned shapes: the model file.
///
/// # Errors
/// Shapes that cannot make a model; see [`Error`].
pub fn train(
    shapes: &[Mesh],
    settings: &Settings,
    progress: &(dyn Fn(u64, u64) + Sync),
) -> Result<Vec<u8>, Error> {
    let all: Vec<usize> = (0..shapes.len()).collect();
    Prepared::new(shapes, settings, 0.0, progress)?.model(&all)
}

/// The grid and what is known of the shapes on it coarsely.
struct Plan {
    surfaces: Vec<Surface>,
    lattice: Lattice,
    millimetre: f64,
    brick: usize,
    stride: u8,
    /// Distances at the far nodes.
    coarse: Vec<Moments>,
    /// Band behind and in front, and how it widens.
    band: Band,
    border_share: f64,
    distances: Distances,
    symmetry: Option<symmetry::Plane>,
}

impl Plan {
    /// Distances of one shape at some places of a lattice.
    fn measure(&self, surface: &Surface, shape: &Mesh, lattice: &Lattice, places: &[u32]) -> Volume {
        match self.distances {
            Distances::Exact => volume::sample(surface, lattice, places),
            Distances::Sight => line_of_sight::sample(shape, lattice, places, 10.0 * self.millimetre),
        }
    }

    fn new(shapes: &[Mesh], settings: &Settings) -> Result<Self, Error> {
        let mut surfaces = Vec::with_capacity(shapes.len());
        for (number, shape) in shapes.iter().enumerate() {
            surfaces.push(Surface::new(shape).ok_or(Error::NoSurface(number))?);
        }
        let millimetre = class_millimetre(shapes);
        let (low, high) = bounds(shapes);
        grid::check(shapes, settings)?;
        let (spacing, stride, brick) = grid::voxel(shapes, settings);
        let [behind, front] = settings.band.map(|b| b * millimetre);
        let band = Band { behind, front, spread: settings.spread, least: LEAST_VOXELS * spacing };

        let margin = behind.max(front) + 12.0 * millimetre + 3.0 * spacing;
        let sides = grid::sides((high - low).add_scalar(2.0 * margin).into(), spacing, brick)?;
        let lattice = Lattice { origin: low - Vector::repeat(margin), spacing, sides };
        let all: Vec<&Surface> = surfaces.iter().collect();
        let nodes = lattice.coarse(brick / FAR_PER_BRICK);
        Budget::new(shapes, settings).check_nodes(nodes.len())?;
        let coarse = coarse(&all, &nodes);
        let border_share = settings.border_share;
        let distances = settings.distances;
        let symmetry = settings.symmetric.then(|| symmetry::find(shapes, &surfaces)).transpose()?;
        Ok(Self {
            surfaces,
            lattice,
            millimetre,
            brick,
            stride,
            coarse,
            band,
            border_share,
            distances,
            symmetry,
        })
    }

    /// Voxels that may lie in the band, judged by the mean distance at the nodes around them; `margin` standard
    /// deviations more than the band of all shapes needs, for the bands of some of them.
    fn candidates(&self, margin: f64) -> Vec<u32> {
        let far = self.brick / FAR_PER_BRICK;
        let nodes = self.lattice.coarse(far);
        let slack = nodes.spacing * 3f64.sqrt();
        let band = Band { spread: self.band.spread + margin, ..self.band };
        let near = |voxel: [usize; 3]| {
            band.holds(&self.coarse[nodes.index(voxel.map(|v| (v + far / 2) / far))], slack)
        };
        (0..self.lattice.len()).filter(|&i| near(self.lattice.voxel(i))).map(|i| i as u32).collect()
    }

    /// Candidates (by number) inside the band and on the support.
    fn band(&self, volumes: &[&Volume]) -> Vec<usize> {
        let stored = |&i: &usize| {
            let moments = Moments::of(volumes, i);
            self.band.holds(&moments, 0.0) && moments.border <= self.border_share
        };
        let candidates = volumes.first().map_or(0, |v| v.distances.len());
        (0..candidates).into_par_iter().filter(stored).collect()
    }

    fn encode(
        &self,
        settings: &Settings,
        voxels: &[u32],
        pca: pca::Pca,
        surfaces: &[&Surface],
    ) -> Result<Vec<u8>, Error> {
        let crop = self.crop(voxels);
        let h = self.lattice.spacing;
        let moved: Vec<u32> = voxels.iter().map(|&place| crop.moved(&self.lattice, place)).collect();
        let far = self.brick / FAR_PER_BRICK;
        let nodes = crop.lattice.coarse(far);
        // The crop is not a multiple of the far stride away: sample the far field on its own nodes.
        let far_values = coarse(surfaces, &nodes)
            .into_iter()
            .map(|at| (at.border <= FAR_BORDER_SHARE.max(self.border_share)).then_some((at.mean / h) as f32))
            .collect();
        let u = (self.millimetre / h) as f32;
        let made = format!(
            "lacuna {}; spacing {h}; band -{:.3} to {:.3} and {} deviations; {} distances",
            env!("CARGO_PKG_VERSION"),
            self.band.behind,
            self.band.front,
            self.band.spread,
            if self.distances == Distances::Exact { "exact" } else { "line of sight" }
        );
        let header = Header {
            class: &settings.class,
            made: &made,
            shapes: surfaces.len() as u32,
            unit: settings.unit,
            spacing: h as f32,
            origin: crop.lattice.origin.coords.map(|c| c as f32).into(),
            sides: crop.lattice.sides.map(|side| side as u16),
            brick: self.brick as u8,
            far_stride: far as u8,
            stride: self.stride,
            modes: pca.modes.len() as u8,
            bricks: 0,
            voxels: 0,
            explained: pca.explained as f32,
            scales: Scales {
                millimetre: u,
                front: (6.5 * u).clamp(1.0, 7.5),
                behind: (3.2 * u).max(0.8).min((6.5 * u).clamp(1.0, 7.5)),
                global_ridge: 0.0025 * u * u,
                local_ridge: 10.0 * u * u,
                voxel_ridge: 0.02 * u * u,
            },
        };
        let cells: usize = crop.lattice.sides.iter().map(|side| side / self.brick).product();
        if cells >= usize::from(lacuna::format::ABSENT) {
            return Err(Error::TooLarge(cells));
        }
        let mut order: Vec<usize> = (0..moved.len()).collect();
        order.sort_by_key(|&i| moved[i]);
        Ok(model_file::encode(&Draft {
            header,
            symmetry: self.symmetry.map(|plane| plane.in_voxels(&crop.lattice)),
            jitter: settings.jitter.map(|jitter| Jitter { shift: jitter.shift / h as f32, ..jitter }),
            lattice: crop.lattice,
            voxels: order.iter().map(|&i| moved[i]).collect(),
            mean: order.iter().map(|&i| pca.mean[i]).collect(),
            modes: pca.modes.iter().map(|mode| order.iter().map(|&i| mode[i]).collect()).collect(),
            far: far_values,
        }))
    }

    /// The smallest grid of whole bricks around the stored voxels.
    fn crop(&self, voxels: &[u32]) -> Crop {
        let (mut low, mut high) = ([usize::MAX; 3], [0; 3]);
        for &place in voxels {
            for (axis, v) in self.lattice.voxel(place as usize).into_iter().enumerate() {
                low[axis] = low[axis].min(v);
                high[axis] = high[axis].max(v);
            }
        }
        let sides =
            std::array::from_fn(|axis| (high[axis] + 1 - low[axis]).div_ceil(self.brick) * self.brick);
        Crop {
            low,
            lattice: Lattice { origin: self.lattice.point(low), spacing: self.lattice.spacing, sides },
        }
    }
}

struct Crop {
    low: [usize; 3],
    lattice: Lattice,
}

impl Crop {
    fn moved(&self, from: &Lattice, place: u32) -> u32 {
        let voxel = from.voxel(place as usize);
        self.lattice.index(std::array::from_fn(|axis| voxel[axis] - self.low[axis])) as u32
    }
}

/// Which voxels are stored: those where the surface of a plausible shape, or the hull around it, may be.
#[derive(Clone, Copy)]
struct Band {
    behind: f64,
    front: f64,
    spread: f64,
    /// At least this far on both sides: marching cubes needs whole cells around the surface.
    least: f64,
}

impl Band {
    fn holds(&self, at: &Moments, slack: f64) -> bool {
        let wider = self.spread * at.deviation;
        let reach = |base: f64| (base + wider).max(self.least) + slack;
        at.mean >= -reach(self.behind) && at.mean <= reach(self.front)
    }
}

/// The shapes' distances at one place.
struct Moments {
    mean: f64,
    deviation: f64,
    /// Share of the shapes seen across their border.
    border: f64,
}

impl Moments {
    fn of(volumes: &[&Volume], i: usize) -> Self {
        let m = volumes.len() as f64;
        let values = || volumes.iter().map(|v| f64::from(v.distances[i]));
        let mean = values().sum::<f64>() / m;
        let squares = values().map(|d| (d - mean) * (d - mean)).sum::<f64>();
        let border = volumes.iter().filter(|v| v.border[i]).count() as f64 / m;
        Self { mean, deviation: (squares / (m - 1.0).max(1.0)).sqrt(), border }
    }
}

/// The shapes' distances at every point of a lattice.
fn coarse(surfaces: &[&Surface], nodes: &Lattice) -> Vec<Moments> {
    let places: Vec<u32> = (0..nodes.len() as u32).collect();
    let volumes: Vec<Volume> = surfaces.par_iter().map(|s| volume::sample(s, nodes, &places)).collect();
    let volumes: Vec<&Volume> = volumes.iter().collect();
    (0..nodes.len()).map(|i| Moments::of(&volumes, i)).collect()
}

/// Voxel edge for a class: finer for slender shapes, within bounds.
fn usual_spacing(millimetre: f64, size: f64) -> f64 {
    (USUAL_SPACING * millimetre).clamp(size / SIDE_VOXELS[1], size / SIDE_VOXELS[0])
}

/// Bounds of all shapes.
fn bounds(shapes: &[Mesh]) -> (Point, Point) {
    let start = (Point::from(Vector::repeat(f64::MAX)), Point::from(Vector::repeat(f64::MIN)));
    shapes.iter().filter_map(Mesh::bounds).fold(start, |(l, h), (low, high)| (l.inf(&low), h.sup(&high)))
}
