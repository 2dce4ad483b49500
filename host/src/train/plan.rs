//! The grid of a model, what is known of the shapes on it, and the file that comes of it.

use super::band::{Band, Moments, coarse};
use super::grid::{self, Budget};
use super::model_file::{self, Draft};
use super::{Distances, Error, Settings, bounds, line_of_sight, pca, symmetry};
use crate::class;
use crate::distance::Surface;
use crate::mesh::{Mesh, Vector};
use crate::unit::digits;
use crate::volume::{self, Lattice, Volume};
use lacuna::Reach;
use lacuna::format::{Header, PER_VOXEL, Scales, Unit};
use lacuna::model::Extras;
use rayon::prelude::*;

/// Far field samples per brick edge are two: a brick of six voxels has one every three.
const FAR_PER_BRICK: usize = 2;
/// Largest share of training shapes that may see a node of the far field across their border. It lets the surface
/// go on beyond the stored voxels for those who reach farther than most, at no cost in the model's size.
const FAR_BORDER_SHARE: f64 = 0.95;
/// The same of a stored voxel.
const BORDER_SHARE: f64 = 0.75;
/// Band behind and in front of the mean surface where shapes do not vary, class millimetres.
const BAND: [f64; 2] = [1.8, 2.0];
/// Standard deviations of the shapes' distances by which the band is wider at each voxel.
const SPREAD: f64 = 2.6;
/// Stored voxels on either side of the mean surface, at least.
const LEAST_VOXELS: f64 = 1.8;

/// Reach of lines of sight, where distances are measured along these, class millimetres: the paper's hull of 20 mm diameter.
const SIGHT: f64 = 10.0;
/// Room around the shapes beyond the band, class millimetres and voxels.
const MARGIN: f64 = 12.0;
const MARGIN_VOXELS: f64 = 3.0;
/// Hull reach R in front of the surface, class millimetres; 10 in the paper.
const FRONT: f32 = 6.5;
/// The same within the limits of the core, voxels.
const FRONT_VOXELS: [f32; 2] = [1.0, Reach::MOST_FRONT as f32 / PER_VOXEL];
/// λ of the global fit for a hull voxel, class millimetres squared. A sixteenth to four times as much changes the missing
/// part of six single views by 0.11 mm rms at most (90 shapes; a sixteenth, 30 shapes: 0.04).
const GLOBAL_RIDGE: f32 = 0.0025;
/// λ of the local fit and its δ for a voxel, class millimetres squared.
const LOCAL_RIDGE: f32 = 10.0;
const VOXEL_RIDGE: f32 = 0.02;
/// Hull reach behind the surface, class millimetres, and least, voxels. Farther in, the distance behind one side of a thin
/// part (an ear) is already that of the other one: twice as much makes ears of stitched scans 0.2 mm thicker, and the rms of
/// what is missing of them 1.8 instead of 1.6 mm.
const BEHIND: [f32; 2] = [1.65, 0.5];
/// The same with a node at every voxel: nothing but the hull holds a voxel then, and the surface's cells need all of theirs.
/// Complete faces are 0.14 mm off, and 0.34 with half as much.
const BEHIND_EVERY_VOXEL: [f32; 2] = [3.2, 0.8];

/// The grid and what is known of the shapes on it coarsely.
pub(super) struct Plan {
    pub surfaces: Vec<Surface>,
    pub lattice: Lattice,
    millimetre: f64,
    brick: usize,
    stride: u8,
    /// Distances at the far nodes.
    coarse: Vec<Moments>,
    /// Band behind and in front, and how it widens.
    band: Band,
    pub distances: Distances,
    symmetry: Option<symmetry::Plane>,
}

impl Plan {
    /// Distances of one shape at some places of a lattice.
    pub fn measure(&self, surface: &Surface, shape: &Mesh, lattice: &Lattice, places: &[u32]) -> Volume {
        match self.distances {
            Distances::Exact => volume::sample(surface, lattice, places),
            Distances::Sight => line_of_sight::sample(shape, lattice, places, SIGHT * self.millimetre),
        }
    }

    /// Grid, far nodes and symmetry for these shapes.
    pub fn new(shapes: &[Mesh], settings: &Settings) -> Result<Self, Error> {
        let mut surfaces = Vec::with_capacity(shapes.len());
        for (number, shape) in shapes.iter().enumerate() {
            surfaces.push(Surface::new(shape).ok_or(Error::NoSurface(number))?);
        }
        let millimetre = class::millimetre(shapes);
        let (low, high) = bounds(shapes);
        grid::check(shapes, settings)?;
        let (spacing, stride, brick) = grid::voxel(shapes, settings);
        let [behind, front] = BAND.map(|b| b * millimetre);
        let band = Band { behind, front, spread: SPREAD, least: LEAST_VOXELS * spacing };

        let margin = behind.max(front) + MARGIN * millimetre + MARGIN_VOXELS * spacing;
        let sides = grid::sides((high - low).add_scalar(2.0 * margin).into(), spacing, brick)?;
        let lattice = Lattice { origin: low - Vector::repeat(margin), spacing, sides };
        let all: Vec<&Surface> = surfaces.iter().collect();
        let nodes = lattice.coarse(brick / FAR_PER_BRICK);
        Budget::new(shapes, settings).check_nodes(nodes.len())?;
        let coarse = coarse(&all, &nodes);
        let distances = settings.distances;
        let symmetry = settings.symmetric.then(|| symmetry::find(shapes, &surfaces)).transpose()?;
        Ok(Self { surfaces, lattice, millimetre, brick, stride, coarse, band, distances, symmetry })
    }

    /// Voxels between the nodes of the weight field.
    pub const fn stride(&self) -> u8 {
        self.stride
    }

    /// Voxels that may lie in the band, judged by the mean distance at the nodes around them; `margin` standard
    /// deviations more than the band of all shapes needs, for the bands of some of them.
    pub fn candidates(&self, margin: f64) -> Vec<u32> {
        let far = self.far_stride();
        let nodes = self.lattice.coarse(far);
        let slack = nodes.spacing * 3f64.sqrt();
        let band = Band { spread: self.band.spread + margin, ..self.band };
        let near = |voxel: [usize; 3]| {
            band.holds(&self.coarse[nodes.index(voxel.map(|v| (v + far / 2) / far))], slack)
        };
        (0..self.lattice.len()).filter(|&i| near(self.lattice.voxel(i))).map(|i| i as u32).collect()
    }

    /// Candidates (by number) inside the band and on the support.
    pub fn band(&self, volumes: &[&Volume]) -> Vec<usize> {
        let stored = |&i: &usize| {
            let moments = Moments::of(volumes, i);
            self.band.holds(&moments, 0.0) && moments.border <= BORDER_SHARE
        };
        let candidates = volumes.first().map_or(0, |v| v.distances.len());
        (0..candidates).into_par_iter().filter(stored).collect()
    }

    /// The model file of a basis at some voxels of the lattice.
    ///
    /// # Errors
    /// More than a file can hold.
    pub fn encode(
        &self,
        settings: &Settings,
        voxels: &[u32],
        pca: pca::Pca,
        surfaces: &[&Surface],
    ) -> Result<Vec<u8>, Error> {
        let crop = self.crop(voxels);
        let h = self.lattice.spacing;
        let moved: Vec<u32> = voxels.iter().map(|&place| crop.moved(&self.lattice, place)).collect();
        let nodes = crop.lattice.coarse(self.far_stride());
        // The crop is not a multiple of the far stride away: sample the far field on its own nodes.
        let far_values = coarse(surfaces, &nodes)
            .into_iter()
            .map(|at| (at.border <= FAR_BORDER_SHARE).then_some((at.mean / h) as f32))
            .collect();
        let made = self.made();
        let header = Header {
            class: &settings.class,
            made: &made,
            shapes: surfaces.len() as u32,
            unit: settings.unit,
            modes: pca.modes.len() as u8,
            explained: pca.explained as f32,
            ..self.header(&crop.lattice)
        };
        let mut order: Vec<usize> = (0..moved.len()).collect();
        order.sort_by_key(|&i| moved[i]);
        model_file::encode(&Draft {
            header,
            extras: Extras {
                symmetry: self.symmetry.map(|plane| plane.in_voxels(&crop.lattice)),
                jitter: settings.apart.map(|apart| apart.in_voxels(h as f32)),
                ..Extras::default()
            },
            lattice: crop.lattice,
            voxels: order.iter().map(|&i| moved[i]).collect(),
            mean: order.iter().map(|&i| pca.mean[i]).collect(),
            modes: pca.modes.iter().map(|mode| order.iter().map(|&i| mode[i]).collect()).collect(),
            far: far_values,
        })
    }

    /// The header of a model on a part of the grid, as far as the plan knows it.
    fn header(&self, lattice: &Lattice) -> Header<'static> {
        Header {
            class: "",
            made: "",
            shapes: 0,
            unit: Unit::Millimetre,
            spacing: lattice.spacing as f32,
            origin: lattice.origin.coords.map(|c| c as f32).into(),
            sides: lattice.sides.map(|side| side as u16),
            brick: self.brick as u8,
            far_stride: self.far_stride() as u8,
            stride: self.stride,
            modes: 0,
            bricks: 0,
            voxels: 0,
            explained: 0.0,
            scales: self.scales(),
        }
    }

    /// Voxels between the nodes of the far field.
    const fn far_stride(&self) -> usize {
        self.brick / FAR_PER_BRICK
    }

    /// How a model of this plan was made.
    fn made(&self) -> String {
        format!(
            "lacuna {}; spacing {}; band -{} to {} and {} deviations; {} distances",
            env!("CARGO_PKG_VERSION"),
            self.lattice.spacing,
            digits(self.band.behind, 3),
            digits(self.band.front, 3),
            self.band.spread,
            if self.distances == Distances::Exact { "exact" } else { "line of sight" }
        )
    }

    /// What is a length in class millimetres, in voxels; the ridges are squares of such.
    fn scales(&self) -> Scales {
        let u = (self.millimetre / self.lattice.spacing) as f32;
        let [least, most] = FRONT_VOXELS;
        let front = (FRONT * u).clamp(least, most);
        Scales {
            millimetre: u,
            front,
            behind: self.behind(u).min(front),
            global_ridge: GLOBAL_RIDGE * u * u,
            local_ridge: LOCAL_RIDGE * u * u,
            voxel_ridge: VOXEL_RIDGE * u * u,
        }
    }

    /// How far behind the surface the hull reaches, voxels, for class millimetres of `u`.
    fn behind(&self, u: f32) -> f32 {
        let [reach, least] = if self.stride == 1 { BEHIND_EVERY_VOXEL } else { BEHIND };
        (reach * u).max(least)
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
