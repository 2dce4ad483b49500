//! Where numbers differ, and why: one case through three rungs.
//!
//! 1. the [`reference`](crate::reference): the equations in `f64`, dense, on the unquantised training volumes;
//! 2. the core in [`Float`]: its own loops, its model file;
//! 3. the core in [`Fixed`]: what ships.
//!
//! Between 1 and 2 lie band, model and hull quantisation, between 2 and 3 rounding alone. A rung between the
//! first two, 1f, is the reference on the numbers of the model file and on the core's hull: whatever separates
//! it from 2 is the core's arithmetic, so this gap has to be next to nothing. The fixed-point digests name the
//! first stage that differs between builds.

mod case;
pub(crate) mod decode;
mod report;
#[cfg(test)]
mod tests;

pub use case::{CLASSES, Case, Class};
pub use report::{Comparison, Report, Rungs, Stage};

use crate::fit::{Digests, Fit, fit};
use crate::reference::{Hull, Model as Reference, Pass, Settings, global, local};
use crate::sentence::sentence;
use lacuna::{Fixed, Float, Model, Reach, Schedule, completion};
use report::Scale;

/// Why a case cannot be verified.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The core refuses the model, the scan or the schedule.
    #[error("the core refuses this case: {}", sentence("the model", .0))]
    Core(lacuna::Error),
    /// The synthetic class cannot be trained.
    #[error(transparent)]
    Train(#[from] crate::train::Error),
}

impl From<lacuna::Error> for Error {
    fn from(error: lacuna::Error) -> Self {
        Self::Core(error)
    }
}

/// What one rung makes of a case; lengths in voxels, dense, weights in standard deviations.
struct Results {
    hull: Hull,
    weights: Vec<f64>,
    global: Vec<f64>,
    local: Vec<f64>,
}

/// Runs a case through all rungs. Without training volumes rung 1 is left out, 1f stays. The reference has no mirror
/// prior: a model that has one runs through rungs 2 and 3 only.
///
/// # Errors
/// A case or a schedule that the core refuses.
pub fn verify(case: &Case, schedule: Schedule<'_>, golden: Option<Digests>) -> Result<Report, Error> {
    run(case, schedule, golden, true)
}

/// Runs a case through rungs 2 and 3 only: quick for models of any size.
///
/// # Errors
/// A case or a schedule that the core refuses.
pub fn verify_core(case: &Case, schedule: Schedule<'_>, golden: Option<Digests>) -> Result<Report, Error> {
    run(case, schedule, golden, false)
}

fn run(
    case: &Case,
    schedule: Schedule<'_>,
    golden: Option<Digests>,
    reference: bool,
) -> Result<Report, Error> {
    let model = Model::from_bytes(&case.model)?;
    let settings = completion::Settings { rounds: case.rounds, schedule };
    let points = case.points.packed();
    let float_fit = fit::<Float>(&model, &points, &case.pose, settings)?;
    let fixed_fit = fit::<Fixed>(&model, &points, &case.pose, settings)?;
    let (float, fixed) = (core_results(&model, &float_fit), core_results(&model, &fixed_fit));
    let scale = Scale::of(&model);
    let mut comparisons = vec![];
    if reference && model.symmetry().is_none() {
        let file = decode::model(&model);
        if let Some(volumes) = &case.volumes {
            let trained = decode::trained(volumes, &file);
            let hull = decode::stored(case.reference_hull(trained.grid, Reach::of(&model)), &trained.mask);
            let results = reference_results(&trained, &model, hull, schedule);
            comparisons.extend(scale.compare_all(Rungs::ReferenceFloat, &results, &float));
        }
        let results = reference_results(&file, &model, float.hull.clone(), schedule);
        comparisons.extend(scale.compare_all(Rungs::FileFloat, &results, &float));
    }
    comparisons.extend(scale.compare_all(Rungs::FloatFixed, &float, &fixed));
    Ok(Report {
        case: case.name.clone(),
        voxels: model.voxels(),
        modes: model.modes(),
        voxel_mm: scale.voxel_mm,
        hull_voxels: fixed_fit.outcome.hull_voxels,
        comparisons,
        digests: fixed_fit.digests,
        golden,
    })
}

fn core_results(model: &Model<'_>, fit: &Fit) -> Results {
    Results {
        hull: decode::hull(model, &fit.targets),
        weights: fit.global.clone(),
        global: decode::distances(model, &fit.global_distances),
        local: decode::distances(model, &fit.local_distances),
    }
}

fn reference_results(
    reference: &Reference,
    model: &Model<'_>,
    hull: Hull,
    schedule: Schedule<'_>,
) -> Results {
    let weights = global::direct(reference, &hull, f64::from(model.header().scales.global_ridge));
    let field = local::local(reference, &hull, &weights, &settings(model, schedule));
    let masked = |volume: Vec<f64>| decode::masked(volume, &reference.mask);
    Results {
        global: masked(reference.synthesise(&weights)),
        local: masked(field.distances(reference)),
        hull,
        weights,
    }
}

/// The reference's settings for a schedule of the core.
pub(crate) fn settings(model: &Model<'_>, schedule: Schedule<'_>) -> Settings {
    let scales = &model.header().scales;
    let pass = |pass: &lacuna::Pass<'_>| Pass {
        radius: usize::from(pass.radius),
        steps: pass.steps.iter().map(|&mu| f64::from(mu)).collect(),
        part: usize::from(pass.part).max(1),
    };
    Settings {
        stride: usize::from(schedule.stride),
        momentum: f64::from(schedule.momentum) / 256.0,
        ridge: f64::from(scales.local_ridge),
        voxel_ridge: f64::from(scales.voxel_ridge),
        passes: schedule.passes.iter().map(pass).collect(),
    }
}
