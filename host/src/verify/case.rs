//! What is verified: a model, a scan, and for the first rung the volumes the model was trained on.

use super::{Error, decode};
use crate::distance::Surface;
use crate::mesh::{Mesh, Point};
use crate::points::{OrientedPoints, thin};
use crate::reference::hull::{Oriented, hull};
use crate::reference::{self, Grid, Hull};
use crate::synth::scanner::{self, Kind, Settings as Scanner};
use crate::synth::{Head, scan};
use crate::train::{Settings, train};
use crate::volume::{Lattice, sample};
use lacuna::format::PER_VOXEL;
use lacuna::pose_fit::Round;
use lacuna::{Model, Pose, Reach};
use rayon::prelude::*;

/// One model and one scan.
#[derive(Clone, Debug)]
pub struct Case {
    /// What it is called in reports.
    pub name: String,
    /// The model file.
    pub model: Vec<u8>,
    /// The scan.
    pub points: OrientedPoints,
    /// From the scan's frame to the model's voxels; rough where there are rounds to refine it.
    pub pose: Pose,
    /// How the pose is refined; none takes it as it is.
    pub rounds: &'static [Round],
    /// Training volumes on the model's grid, voxels, 0 where nothing is stored; without them there is no rung 1.
    pub volumes: Option<Vec<Vec<f64>>>,
}

/// A class of synthetic heads and one more head to be scanned.
#[derive(Clone, Copy, Debug)]
pub struct Class {
    /// What the case is called.
    pub name: &'static str,
    /// Heads to train on.
    pub shapes: u64,
    /// Edge of a voxel.
    pub spacing_mm: f64,
    /// Voxels between nodes.
    pub stride: u8,
    /// Where the scanner stands.
    pub kind: Kind,
    /// Seed of heads and scan.
    pub seed: u64,
    /// Whether the model has the class's plane of symmetry, and the fit the mirror prior.
    pub symmetric: bool,
}

impl Class {
    /// Eight heads at 8 mm, seven modes, a node every second voxel, a scan from the front.
    pub const SMALL: Self = Self {
        name: "small",
        shapes: 8,
        spacing_mm: 8.0,
        stride: 2,
        kind: Kind::Front,
        seed: 42,
        symmetric: false,
    };
}

/// The classes that are trained on the spot, small enough for the dense reference.
pub const CLASSES: [Class; 4] = [
    Class::SMALL,
    Class { name: "side", shapes: 6, spacing_mm: 9.0, stride: 3, kind: Kind::Side, seed: 7, ..Class::SMALL },
    Class {
        name: "mirror",
        shapes: 6,
        spacing_mm: 9.0,
        stride: 3,
        kind: Kind::Side,
        seed: 7,
        symmetric: true,
    },
    Class {
        name: "stitched",
        shapes: 7,
        spacing_mm: 10.0,
        stride: 1,
        kind: Kind::Stitched,
        seed: 11,
        ..Class::SMALL
    },
];

impl Case {
    /// The case for [`Class::SMALL`].
    ///
    /// # Errors
    /// None that is known; the class is fixed.
    pub fn small() -> Result<Self, Error> {
        Self::synthetic(&Class::SMALL)
    }

    /// Trains a class and scans the next head in its true pose.
    ///
    /// # Errors
    /// A class that cannot be trained: one head, or a spacing that makes too large a grid.
    pub fn synthetic(class: &Class) -> Result<Self, Error> {
        let heads: Vec<Mesh> =
            (0..class.shapes).into_par_iter().map(|i| Head::sample(class.seed, i).mesh()).collect();
        let settings = Settings {
            spacing: Some(class.spacing_mm),
            stride: Some(class.stride),
            symmetric: class.symmetric,
            ..Settings::default()
        };
        let file = train(&heads, &settings, &|_, _| ())?;
        let model = Model::from_bytes(&file)?;
        let truth = Head::sample(class.seed, class.shapes).mesh();
        // Views that lie exactly beside each other: the input of the golden digests, the same in every release.
        let scanner = Scanner { registration_mm: 0.0, ..Scanner::small() };
        let scan = scan(&truth, class.kind, &scanner, class.seed);
        let pose = true_pose(&model, &scan);
        let points = thin(&scan.mesh, 0.5 * class.spacing_mm);
        let volumes = Some(volumes(&model, &heads));
        Ok(Self { name: class.name.into(), points, pose, rounds: &[], volumes, model: file })
    }

    /// The reference's hull of the scan.
    pub(super) fn reference_hull(&self, grid: Grid, reach: Reach) -> Hull {
        let voxels = |units: u16| f64::from(units) / f64::from(PER_VOXEL);
        let reach = reference::Reach {
            front: voxels(reach.front),
            behind: voxels(reach.behind),
            lateral: voxels(reach.lateral),
        };
        let rotation = nalgebra::Matrix3::from_fn(|i, j| f64::from(self.pose.rotation[i][j]));
        let shift = nalgebra::Vector3::from(self.pose.translation).cast::<f64>();
        let scale = f64::from(self.pose.scale);
        let placed = |(p, n): (&Point, &nalgebra::Vector3<f64>)| Oriented {
            point: (rotation * p.coords * scale + shift).into(),
            normal: (rotation * n).into(),
        };
        let points: Vec<Oriented> = self.points.points.iter().zip(&self.points.normals).map(placed).collect();
        hull(grid, &points, &reach)
    }
}

/// From a synthetic scan's frame to the model's voxels: what a perfect registration finds.
fn true_pose(model: &Model<'_>, scan: &scanner::Scan) -> Pose {
    let (to_scan, header) = (scan.model_to_scan, model.header());
    let turned = to_scan.fixed_view::<3, 3>(0, 0).into_owned();
    let scale = libm::cbrt(turned.determinant());
    let back = (turned / scale).transpose();
    let spacing = f64::from(header.spacing);
    let origin = nalgebra::Vector3::from(header.origin).cast::<f64>();
    let shift = (back * to_scan.fixed_view::<3, 1>(0, 3) / -scale - origin) / spacing;
    Pose {
        rotation: std::array::from_fn(|i| std::array::from_fn(|j| back[(i, j)] as f32)),
        scale: (1.0 / (scale * spacing)) as f32,
        translation: shift.map(|c| c as f32).into(),
    }
}

/// Signed distances of the training shapes at the model's stored voxels, in voxels, as dense volumes.
fn volumes(model: &Model<'_>, shapes: &[Mesh]) -> Vec<Vec<f64>> {
    let header = model.header();
    let grid = decode::grid(model);
    let lattice = Lattice {
        origin: Point::from(header.origin.map(f64::from)),
        spacing: f64::from(header.spacing),
        sides: grid.sides,
    };
    let mut places: Vec<u32> = decode::places(model).into_iter().map(|place| place as u32).collect();
    places.sort_unstable();
    let dense = |surface: Surface| {
        let mut volume = vec![0.0; grid.len()];
        for (&place, &mm) in places.iter().zip(&sample(&surface, &lattice, &places).distances) {
            volume[place as usize] = f64::from(mm) / lattice.spacing;
        }
        volume
    };
    shapes.par_iter().filter_map(Surface::new).map(dense).collect()
}
