//! Completion: a scan and a model become one mesh.
//!
//! scan → pose → hull → global fit → local fit → surface, in this order, each step in its own module.

pub mod behind;
pub mod clean;
pub mod clutter;
pub mod cues;
pub mod dense;
pub mod depth_rows;
pub mod diffusion;
pub mod diverged;
pub mod explained;
pub mod extrapolate;
pub mod fitted;
pub mod layers;
pub mod level;
pub mod measured;
pub mod merge;
mod neighbourhoods;
pub mod noise;
pub mod outgrowth;
pub mod picture;
pub mod pieces;
mod places;
pub mod prepared;
pub mod start;
pub mod support;
pub mod unfold;
pub mod verdict;
pub mod viewable;
pub mod zero_level;

use crate::fit::{Fit, fit};
use crate::mesh::Mesh;
use crate::register::{self, Placed};
use crate::sentence::sentence;
use crate::surface::fair;
use crate::uncertainty::spread::spread;
use crate::uncertainty::{Cue, Expected, Share, shares};
use crate::unit;
use clutter::{APART, Clutter};
use fitted::Fitted;
use lacuna::completion::Settings;
use lacuna::{Arithmetic, Model, Schedule};
use measured::{Measured, scan_surface};
use merge::{Limits, MEASURED, Merged};
use noise::Noise;
use outgrowth::Outgrowth;
pub use prepared::prepare;
use prepared::{Prepared, prepare_by};
pub use start::{GivenPose, Start, start};
use support::Support;
use verdict::{Evidence, Verdict, weight_norm};

/// What a user can choose.
#[derive(Clone, Copy, Debug)]
pub struct Options<'a> {
    /// A pose that is known roughly, or exactly; it is searched for if none is given.
    pub pose: GivenPose,
    /// Seed of the search.
    pub seed: u64,
    /// Iterations of the local fit.
    pub schedule: Schedule<'a>,
    /// How much finer than the model's grid the surface is extracted.
    pub finer: usize,
    /// Whether the scan's points stay where they are, with their noise.
    pub keep_noise: bool,
}

impl Options<'static> {
    /// What `lacuna complete` takes unless it is told otherwise.
    pub const fn of(model: &Model<'_>) -> Self {
        Self { pose: GivenPose::None, seed: 1, schedule: Schedule::of(model), finer: 2, keep_noise: false }
    }
}

impl Options<'_> {
    /// How far points hear of each other when noise is taken out, in the scan's unit.
    fn widest(&self, model: &Model<'_>) -> f64 {
        if self.keep_noise { 0.0 } else { noise::widest(model) }
    }
}

/// A completed scan. All meshes are in the scan's frame.
pub struct Completion {
    /// The scan as it was used: without specks, and with less noise.
    pub scan: Mesh,
    /// Its surface.
    pub measured: Measured,
    /// Triangles (of a cloud, points) left out of it as specks.
    pub specks: usize,
    /// Its noise, where that was taken out.
    pub noise: Option<Noise>,
    /// Where the scan lies in the model.
    pub placed: Placed,
    /// Surface of the global fit.
    pub global: Mesh,
    /// Surface of the local fit.
    pub local: Mesh,
    /// Scan and local fit in one mesh.
    pub merged: Merged,
    /// What is known at each vertex of it about its error; empty where no point of the scan lies on the model.
    pub cues: Vec<Cue>,
    /// Its expected errors; empty as they are.
    pub expected: Expected,
    /// What they are where it was measured and where it was inferred.
    pub expected_shares: [Option<Share>; 2],
    /// What of the scan is not in that mesh.
    pub clutter: Clutter,
    /// Results of the core.
    pub fit: Fit,
    /// Judgement.
    pub verdict: Verdict,
}

/// Why a scan cannot be completed.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The pose.
    #[error(transparent)]
    Register(#[from] register::Error),
    /// The fit.
    #[error("the fit was refused: {}", sentence("the model", .0))]
    Fit(lacuna::Error),
    /// Whatever was to fit elsewhere: a device.
    #[error(transparent)]
    Elsewhere(Box<dyn std::error::Error + Send + Sync>),
    /// No surface.
    #[error("{0}")]
    NoSurface(&'static str),
}

/// Farthest motion of the fitted surface onto the scan, class millimetres.
const MOTION: f64 = 4.0;
/// Largest step at the seam, class millimetres.
const STEP: f64 = 0.25;
/// Rounds that the fitted surface is made fair before it is moved onto the scan.
const FAIRING: usize = 15;

/// Completes a scan in the arithmetic `A`. If it is rejected, [`alternatives::advice`](crate::check::alternatives::advice)
/// tells in some more searches what would make it fit.
///
/// # Errors
/// A scan that does not fit the model, or leaves no surface.
pub fn complete<A: Arithmetic>(
    model: &Model<'_>,
    scan: &Mesh,
    options: &Options<'_>,
) -> Result<Completion, Error> {
    let begin = |scan: &Mesh| start(model, scan, options);
    complete_by(model, scan, options, begin, |start| fit_here::<A>(model, start, options.schedule))
}

/// Fits a scan on this machine.
///
/// # Errors
/// A scan that does not touch the model, or a schedule that does not go with it.
pub fn fit_here<A: Arithmetic>(
    model: &Model<'_>,
    start: &Start,
    schedule: Schedule<'_>,
) -> Result<Fit, Error> {
    let settings = Settings { rounds: start.rounds(model), schedule };
    fit::<A>(model, &start.packed(), &start.thinned.rough.pose, settings).map_err(Error::Fit)
}

/// Completes a scan from what `begin` makes of it without its small pieces, with a fit made by `fit`, here or on a device.
///
/// # Errors
/// As for [`complete`], and those of `begin` and `fit`.
pub fn complete_by(
    model: &Model<'_>,
    scan: &Mesh,
    options: &Options<'_>,
    begin: impl FnOnce(&Mesh) -> Result<Start, Error>,
    fit: impl FnOnce(&Start) -> Result<Fit, Error> + Send,
) -> Result<Completion, Error> {
    let given = scan;
    let Prepared { scan, specks, noise, start } = prepare_by(model, scan, options, begin)?;
    let looked = || (scan_surface(&scan, model), layers::apart(given, noise::widest(model)));
    let ((measured, layers), fitted) = rayon::join(looked, || fitted(model, &start, fit));
    let (measured, (fit, fitted, [global, local])) = (measured?, fitted?);
    let placed = fitted.placed;
    let support = Support::of([&global, &local]);
    let drawn = fitted.drawn_to(model, &measured.surface, &support);
    let whole = fair(&zero_level::surface(&drawn, &placed, options.finer), FAIRING);
    if whole.triangles.is_empty() {
        return Err(Error::NoSurface(
            "the fitted distances have no zero level: the scan does not match the model",
        ));
    }
    let unit = placed.class_millimetre(model);
    let limits = Limits { motion: MOTION * unit, sideways: measured.sideways, step: STEP * unit };
    let merged = merge::merge(&whole, &measured.surface, &limits);
    let clutter = Clutter::of(&scan, &merged.mesh, APART * unit);
    let cues = fitted.cues(model, &scan, (layers, measured.sideways), &merged);
    let left = noise.map_or(0.0, |noise| noise.after as f32);
    let expected = Expected::new(&cues, model, placed.pose.scale, left);
    let expected_shares = shares(&expected.errors, &|v| merged.labels[v] == MEASURED);
    let [_, inferred] = expected_shares;
    let vague = inferred.filter(|_| expected.calibrated).map(|inferred| inferred.median);
    let verdict = judge(model, &start, &fitted, &fit, (&merged, &support), vague, layers);
    Ok(Completion {
        scan,
        measured,
        specks,
        noise,
        placed,
        global,
        local,
        merged,
        cues,
        expected,
        expected_shares,
        clutter,
        fit,
        verdict,
    })
}

/// The fit of a start, what it says, and the surfaces of the global and the local fit.
fn fitted<'m>(
    model: &'m Model<'m>,
    start: &Start,
    fit: impl FnOnce(&Start) -> Result<Fit, Error>,
) -> Result<(Fit, Fitted<'m>, [Mesh; 2]), Error> {
    let fit = fit(start)?;
    let fitted = Fitted::new(model, start, &fit);
    let surfaces =
        [&fitted.global, &fitted.local].map(|distances| zero_level::surface(distances, &fitted.placed, 1));
    Ok((fit, fitted, surfaces))
}

/// The verdict on a completion whose inferred surface is `expected` to be so far off, and whose views are so far apart.
fn judge(
    model: &Model<'_>,
    start: &Start,
    fitted: &Fitted<'_>,
    fit: &Fit,
    (merged, support): (&Merged, &Support),
    expected: Option<f64>,
    layers: Option<f64>,
) -> Verdict {
    let agreement = fitted.agreement(model, start.thinned.points.points.len());
    let inferred = merged.inferred_area();
    let used = 1.0 - start.thinned.elsewhere - start.thinned.clutter;
    let (inliers, exactness) = fitted.explained(model, start);
    let pose = used * inliers;
    let placed = &fitted.placed;
    let millimetre = placed.class_millimetre(model);
    Evidence {
        inlier_share: agreement.inliers,
        outside_share: start.thinned.elsewhere + used * agreement.outside,
        seen_rms: agreement.rms / f64::from(placed.pose.scale),
        inferred_share: inferred / f64::max(merged.mesh.area(), f64::MIN_POSITIVE),
        inferred_area: inferred,
        viewable_share: viewable::share(&merged.mesh),
        weight_norm: weight_norm(fit.global.iter().copied()),
        scale: placed.size(model),
        pose_inliers: [pose, start.known.rival() * pose],
        exactness,
        spread: fitted.posterior.as_ref().and_then(spread),
        expected,
        layers,
        outgrowth: Outgrowth::of(merged, &fitted.global, placed, millimetre, model.header().shapes),
        invented: Outgrowth::invented(merged, support, millimetre),
    }
    .judged(millimetre, unit::symbol(model.header().unit))
}
