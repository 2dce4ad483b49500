//! How a shape is fitted: Lacuna's way, the paper's, and every single step between the two.
//!
//! Lacuna's own way runs the fixed-point core. Whatever departs from it runs the double precision reference on
//! the numbers of the same model file and the same hull.

use crate::fit::{dense, fit as core_fit};
use crate::points::OrientedPoints;
use crate::reference::{Hull, Model as Reference, global, local, paper};
use crate::train::grid::usual_stride;
use crate::verify::{decode, settings};
use lacuna::{Error, Fixed, Model, Pass, Pose, Schedule, completion, schedule};
use serde::Serialize;

/// How the global weights are found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Solver {
    /// Regularised least squares in the hull, at once.
    #[default]
    Direct,
    /// The iteration of eqs. (11)-(13).
    FixedPoint,
}

/// What the local fit smooths.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Smooth {
    /// The update, normalised by the curvature: the field can reach fine detail.
    #[default]
    Update,
    /// The field of weights, one weight vector a voxel, as printed.
    Field,
}

/// One way to fit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Method {
    /// The global fit.
    pub solver: Solver,
    /// The local fit.
    pub smooth: Smooth,
    /// Radius of the hyper-ellipse of eq. (3), standard deviations; without it single weights end at 16.
    pub radius: Option<f64>,
    /// Voxels between the nodes of the weight field; the class's own if not given. With a smoothed field it is 1.
    pub stride: Option<u8>,
    /// Side of the last smoothing kernel, class millimetres.
    pub kernel: Option<f64>,
}

/// Side of the first kernel, class millimetres (section 3.3).
const FIRST_KERNEL: f64 = 65.0;
/// Side of the last kernel for complete shapes, class millimetres.
const LAST_KERNEL: f64 = 2.5;
/// Iterations of the printed scheme: as many as of Lacuna's with momentum, so that the comparison is about the scheme.
const ITERATIONS: usize = 24;
/// Rounds of the fixed point at most, and the change of a weight at which it has arrived.
const ROUNDS: (usize, f64) = (500, 1e-4);

impl Method {
    /// The paper's scheme for complete shapes.
    pub const PAPER: Self = Self {
        solver: Solver::FixedPoint,
        smooth: Smooth::Field,
        radius: Some(3.0),
        stride: Some(1),
        kernel: Some(LAST_KERNEL),
    };

    /// Lacuna's way, each single departure from it, and the paper's: the rows of the ablation.
    pub fn ablation() -> Vec<(&'static str, Self)> {
        let ours = Self::default();
        vec![
            ("lacuna", ours),
            ("--solver fixed-point", Self { solver: Solver::FixedPoint, ..ours }),
            ("--radius 3", Self { radius: Some(3.0), ..ours }),
            ("--stride 1", Self { stride: Some(1), ..ours }),
            ("--smooth field", Self { smooth: Smooth::Field, ..ours }),
            ("--smooth field --kernel 16.5", Self { smooth: Smooth::Field, kernel: Some(16.5), ..ours }),
            ("--method paper", Self::PAPER),
            ("--method paper --kernel 16.5", Self { kernel: Some(16.5), ..Self::PAPER }),
            ("--method paper --radius 16", Self { radius: Some(16.0), ..Self::PAPER }),
        ]
    }

    /// The stride a model has to be made with; a smoothed field has a weight vector at every voxel.
    pub fn model_stride(&self) -> Option<u8> {
        if self.smooth == Smooth::Field { Some(1) } else { self.stride }
    }

    /// Whether the core can do it.
    pub fn is_the_cores(&self) -> bool {
        self.solver == Solver::Direct && self.smooth == Smooth::Update && self.radius.is_none()
    }
}

/// Fitted distances over the model's grid, voxels, x fastest, NaN where nothing is stored.
pub struct Fields {
    /// Of the global fit.
    pub global: Vec<f32>,
    /// Of the local fit.
    pub local: Vec<f32>,
}

/// A model, ready to be fitted by a method.
pub struct Fitter<'a> {
    model: &'a Model<'a>,
    method: Method,
    /// The numbers of its file, where the method is not the core's.
    file: Option<Reference>,
}

impl<'a> Fitter<'a> {
    /// Takes what the method needs from the model.
    pub fn new(model: &'a Model<'a>, method: Method) -> Self {
        let file = (!method.is_the_cores()).then(|| decode::model(model));
        Self { model, method, file }
    }

    /// Fits the model to oriented points in a known pose.
    ///
    /// # Errors
    /// What the core refuses: a stride or kernel that does not go with the model, points that miss it.
    pub fn fit(&self, points: &OrientedPoints, pose: &Pose) -> Result<Fields, Error> {
        let (model, method) = (self.model, &self.method);
        let passes = passes(model, method);
        let points = points.packed();
        let settings_of = |schedule| completion::Settings { rounds: &[], schedule };
        let schedule = |passes| Schedule { stride: model.header().stride, momentum: 0, passes };
        let Some(file) = &self.file else {
            let fit = core_fit::<Fixed>(model, &points, pose, settings_of(schedule(&passes)))?;
            let [global, local] = [&fit.global_distances, &fit.local_distances].map(|d| dense(model, d));
            return Ok(Fields { global, local });
        };
        schedule(&passes).check(model)?;
        let start = core_fit::<Fixed>(model, &points, pose, settings_of(schedule(&[])))?;
        let hull = decode::hull(model, &start.targets);
        let weights = global_weights(file, model, &hull, method);
        let fitted = match method.smooth {
            Smooth::Update => {
                local::local(file, &hull, &weights, &settings(model, schedule(&passes))).distances(file)
            }
            Smooth::Field => {
                paper::distances(file, &paper::local(file, &hull, &weights, &printed(model, method)))
            }
        };
        Ok(Fields {
            global: stored(&file.mask, &file.synthesise(&weights)),
            local: stored(&file.mask, &fitted),
        })
    }
}

fn global_weights(file: &Reference, model: &Model<'_>, hull: &Hull, method: &Method) -> Vec<f64> {
    let weights = match method.solver {
        Solver::Direct => global::direct(file, hull, f64::from(model.header().scales.global_ridge)),
        Solver::FixedPoint => global::fixed_point(file, hull, ROUNDS.0, ROUNDS.1).sigmas,
    };
    let length = weights.iter().map(|v| v * v).sum::<f64>().sqrt();
    let shorter = method.radius.map_or(1.0, |radius| (radius / length).min(1.0));
    weights.iter().map(|v| v * shorter).collect()
}

/// The settings of the printed scheme; its step is the one that converges (see [`paper`]).
fn printed(model: &Model<'_>, method: &Method) -> paper::Settings {
    let scales = &model.header().scales;
    let millimetre = f64::from(scales.millimetre);
    let last = method.kernel.unwrap_or(LAST_KERNEL) * millimetre;
    paper::Settings {
        step: paper::Step::Normalised { step: 1.0, ridge: f64::from(scales.voxel_ridge) },
        radius: method.radius.unwrap_or(f64::INFINITY),
        kernels: paper::Settings::shrinking(FIRST_KERNEL * millimetre, last, 1.0, ITERATIONS),
    }
}

/// The core's passes: kernels keep their size in millimetres whatever the stride, and end at the last one asked
/// for.
fn passes(model: &Model<'_>, method: &Method) -> Vec<Pass<'static>> {
    let millimetre = model.header().scales.millimetre;
    let stride = f32::from(model.header().stride);
    let usual = f32::from(usual_stride(f64::from(millimetre)));
    let nodes = |voxels: f32| ((voxels / stride - 1.0) / 2.0).round().max(0.0) as u8;
    let least = method.kernel.map_or(0, |kernel| nodes(kernel as f32 * millimetre));
    let pass = |pass: &Pass<'static>| {
        let side = f32::from(2 * pass.radius + 1) * usual;
        let radius = if pass.radius == 0 { 0 } else { nodes(side) };
        Pass { radius: radius.max(least), ..*pass }
    };
    schedule::DEFAULT.iter().map(pass).collect()
}

fn stored(mask: &[bool], volume: &[f64]) -> Vec<f32> {
    volume.iter().zip(mask).map(|(&d, &stored)| if stored { d as f32 } else { f32::NAN }).collect()
}
