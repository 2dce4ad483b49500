//! Completion: a scan and a model become one mesh.
//!
//! scan → pose → hull → global fit → local fit → surface, in this order, each step in its own module.

pub mod clean;
pub mod clutter;
pub mod dense;
pub mod depth_rows;
pub mod diffusion;
pub mod extrapolate;
pub mod level;
pub mod merge;
pub mod noise;
pub mod picture;
pub mod pieces;
pub mod start;
pub mod unfold;
pub mod unsettled;
pub mod verdict;
pub mod zero_level;

use crate::distance::Surface;
use crate::fit::{Fit, fit};
use crate::mesh::{Mesh, Point};
use crate::points::{OrientedPoints, thin};
use crate::register::{self, Placed, joint};
use crate::sentence::sentence;
use crate::surface::fair;
use crate::uncertainty::cues::{Cue, cues};
use crate::uncertainty::hidden;
use crate::uncertainty::posterior::Posterior;
use crate::uncertainty::spread::spread;
use crate::uncertainty::{Expected, Share, shares};
use crate::unit;
use clean::Cleaned;
use clutter::{APART, Clutter};
use dense::Dense;
use lacuna::completion::Settings;
use lacuna::corners::Weights;
use lacuna::cube::Cube;
use lacuna::{Arithmetic, Model, Reach, Schedule, Standing};
use merge::{Limits, MEASURED, Merged};
use noise::Noise;
pub use start::{Hint, Start, start};
use verdict::{Grade, Verdict};

/// What a user can choose.
#[derive(Clone, Copy, Debug)]
pub struct Options<'a> {
    /// A pose that is known roughly, or exactly; searched for without a hint if not given.
    pub hint: Hint,
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
        Self { hint: Hint::None, seed: 1, schedule: Schedule::of(model), finer: 2, keep_noise: false }
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
    #[error("the fit was refused: {}", sentence(.0))]
    Fit(lacuna::Error),
    /// The device that was to fit.
    #[error(transparent)]
    Device(#[from] crate::device::Error),
    /// No surface.
    #[error("{0}")]
    NoSurface(&'static str),
}

/// Farthest motion of the fitted surface onto the scan, class millimetres.
const MOTION: f64 = 4.0;
/// Largest step at the seam, class millimetres.
const STEP: f64 = 0.25;
/// How far from the scan its own distances are looked up, voxels.
const OWN_REACH: f64 = 2.0;
/// Rounds that the fitted surface is made fair before it is moved onto the scan.
const FAIRING: usize = 15;

/// Completes a scan in the arithmetic `A`.
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
    let settings = Settings { reach: Reach::of(model), rounds: start.rounds(model), schedule };
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
    begin: impl FnOnce(&Mesh) -> Result<Start, Error> + Send,
    fit: impl FnOnce(&Start) -> Result<Fit, Error>,
) -> Result<Completion, Error> {
    let all = scan.elements();
    let cleaned = clean::clean(scan, options.widest(model));
    let noise = cleaned.noise;
    let (measured, start) = rayon::join(|| scan_surface(&cleaned.scan, model), || begin(&cleaned.scan));
    let (scan, measured, start) = with_pieces(model, cleaned, (measured?, start?))?;
    let specks = all - scan.elements();
    let fit = fit(&start)?;
    let fitted = Fitted::new(model, &start, &fit);
    let placed = fitted.placed;
    let agreement = fitted.agreement(model, start.thinned.points.points.len());
    let (global, local) = (fitted.global.surface(&placed, 1), fitted.local.surface(&placed, 1));
    let drawn = fitted.drawn_to(model, &measured.surface);
    let whole = fair(&drawn.surface(&placed, options.finer), FAIRING);
    if whole.triangles.is_empty() {
        return Err(Error::NoSurface(
            "the fitted distances have no zero level: the scan does not match the model",
        ));
    }
    let unit = class_millimetre(model, &placed);
    let limits = Limits { motion: MOTION * unit, sideways: measured.sideways, step: STEP * unit };
    let merged = merge::merge(&whole, &measured.surface, &limits);
    let clutter = Clutter::of(&scan, &merged.mesh, APART * unit);
    let cues = fitted.cues(model, &merged);
    let expected = Expected::new(&cues, model, placed.pose.scale);
    let expected_shares = shares(&expected.errors, &|v| merged.labels[v] == MEASURED);
    let [_, inferred] = expected_shares;
    let vague = inferred.filter(|_| expected.calibrated).map(|inferred| inferred.median);
    let verdict = judge(model, &start, (&fitted, &fit), &merged, (agreement, vague));
    Ok(Completion {
        scan,
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

/// The scan with those of its small pieces that belong to the shape, and what is made of it.
fn with_pieces(
    model: &Model<'_>,
    cleaned: Cleaned,
    (measured, mut start): (Measured, Start),
) -> Result<(Mesh, Measured, Start), Error> {
    let pieces = pieces::belonging(model, &cleaned, &start.known);
    let mut scan = cleaned.scan;
    if pieces.points.is_empty() {
        return Ok((scan, measured, start));
    }
    scan.append(&pieces);
    let measured = scan_surface(&scan, model)?;
    // The points of a depth image are not those of its mesh, and have all pieces.
    if start.depth.is_none() {
        start.thinned = start::thinned(model, &scan, &start.known);
    }
    Ok((scan, measured, start))
}

/// What the core's fit says about the scan's points.
struct Fitted<'m> {
    /// Where the scan lies.
    placed: Placed,
    /// The points that the core did not leave out, centred.
    points: OrientedPoints,
    /// Weights of the shape that was found with the pose; those of the global fit where the pose was held.
    shape: Vec<f32>,
    global: Dense,
    local: Dense,
    /// What the points leave undecided; none where none of them lies on the model.
    posterior: Option<Posterior<'m>>,
}

impl<'m> Fitted<'m> {
    fn new(model: &'m Model<'m>, start: &Start, fit: &Fit) -> Self {
        let placed = Placed { centre: start.thinned.rough.centre, pose: fit.outcome.pose };
        let points = without_clutter(model, start, fit);
        let held = start.is_held(model);
        let shape =
            if held { fit.global.iter().map(|&weight| weight as f32).collect() } else { fit.shape.clone() };
        let posterior = Posterior::new(model, &points, &placed.pose, &shape, !held);
        let [global, local] =
            [&fit.global_distances, &fit.local_distances].map(|distances| Dense::new(model, distances));
        Self { placed, points, shape, global, local, posterior }
    }

    /// The pose of the centred points.
    fn centred(&self) -> Placed {
        Placed { centre: Point::origin(), ..self.placed }
    }

    /// The local fit's distances: without what did not settle, with the volume to be expected where nobody looked, and the
    /// scan's own beyond what the model stores.
    fn drawn_to(&self, model: &Model<'_>, scan: &Surface) -> Dense {
        let (mut drawn, centred) = (self.local.clone(), self.centred());
        let voxels: Vec<Point> = self.points.points.iter().map(|p| centred.to_model(p)).collect();
        let near = OWN_REACH / f64::from(self.placed.pose.scale);
        // A voxel hears of the nodes around it, and they reach as far again.
        let reach = 2 * usize::from(model.header().stride);
        let own = |i: usize| self.global.measured(i, scan, &self.placed, near);
        let measured = diffusion::diffuse(&mut drawn, &self.global, &voxels, reach, own);
        if let Some(posterior) = &self.posterior {
            let deviations = level::deviations(&drawn, posterior);
            level::level(&mut drawn, &deviations, &measured);
        }
        drawn.extend(model, scan, &self.placed, &voxels);
        drawn
    }

    /// What is known at each vertex of the completed mesh about its error.
    fn cues(&self, model: &Model<'_>, merged: &Merged) -> Vec<Cue> {
        let Some(posterior) = &self.posterior else { return vec![] };
        let hidden = hidden::error(&self.points.normals) * model.header().scales.millimetre;
        cues(posterior, &self.placed, merged, hidden)
    }

    /// How the points, of `all` in the scan, lie on the surface of the local fit.
    fn agreement(&self, model: &Model<'_>, all: usize) -> Agreement {
        let (reach, centred) = (2.0 * f64::from(model.header().scales.millimetre), self.centred());
        let (mut near, mut inliers, mut squares) = (0usize, 0usize, 0.0);
        for point in &self.points.points {
            if let Some((d, gradient)) = self.local.at(&centred.to_model(point)) {
                near += 1;
                let r = d / gradient.norm().max(0.3);
                if r.abs() <= reach {
                    inliers += 1;
                    squares += r * r;
                }
            }
        }
        Agreement {
            inliers: inliers as f64 / near.max(1) as f64,
            rms: (squares / inliers.max(1) as f64).sqrt(),
            outside: (self.points.points.len() - near) as f64 / all.max(1) as f64,
        }
    }

    /// Share of the points of a start that lie on the surface of `shape`, and how exactly these do; none without any.
    fn explained(&self, model: &Model<'_>, start: &Start) -> (f64, Option<f64>) {
        let packed = start.packed();
        let Ok(cloud) = packed.cloud() else { return (0.0, None) };
        let (inliers, agreement) =
            joint::agreement(model, cloud, &self.placed.pose, &Weights::new(&self.shape));
        (inliers, (inliers > 0.0).then(|| agreement / inliers))
    }
}

/// The scan for closest point queries.
struct Measured {
    surface: Surface,
    sideways: Option<f64>,
}

/// Edge of a cloud's cubes where its points are close together, and where they are far apart, voxels.
const SURFEL: [f64; 2] = [0.3, 1.0];
/// Cubes are large enough when at most this share of the points is left.
const LEFT: f64 = 0.7;

/// A mesh as it is; a cloud as one small triangle a point, about as large as points are apart.
fn scan_surface(scan: &Mesh, model: &Model<'_>) -> Result<Measured, Error> {
    if !scan.triangles.is_empty() {
        let surface = Surface::new(scan).ok_or(Error::NoSurface("the scan's triangles have no area"))?;
        return Ok(Measured { surface, sideways: None });
    }
    let [mut cell, widest] = SURFEL.map(|voxels| voxels * f64::from(model.header().spacing));
    let mut points = thin(scan, cell);
    while cell < widest && points.points.len() as f64 > LEFT * scan.points.len() as f64 {
        cell *= 1.25;
        points = thin(scan, cell);
    }
    let surface = Surface::new(&surfels(&points, cell));
    let surface = surface.ok_or(Error::NoSurface("the scan has no oriented points"))?;
    Ok(Measured { surface, sideways: Some(1.5 * cell) })
}

fn surfels(points: &OrientedPoints, size: f64) -> Mesh {
    let mut mesh = Mesh::default();
    for (point, normal) in points.points.iter().zip(&points.normals) {
        let first = mesh.points.len() as u32;
        let across = nalgebra::Vector3::ith(normal.iamin(), 1.0).cross(normal).normalize() * size;
        let along = normal.cross(&across);
        mesh.points.extend([
            point + across,
            point - across * 0.5 + along * 0.8,
            point - across * 0.5 - along * 0.8,
        ]);
        mesh.triangles.push([first, first + 1, first + 2]);
    }
    mesh
}

/// The points that the core did not leave out.
fn without_clutter(model: &Model<'_>, start: &Start, fit: &Fit) -> OrientedPoints {
    if start.is_held(model) {
        return start.thinned.points.clone();
    }
    let packed = start.packed();
    let cloud = packed.cloud();
    let (pose, shape) = (&fit.outcome.pose, Weights::new(&fit.shape));
    let mut cube = Cube::new(model, &shape);
    let kept = |&i: &usize| {
        let Ok(Some((p, n))) = cloud.map(|cloud| cloud.point(i)) else { return false };
        Standing::of(&mut cube, pose.apply(p), pose.rotate(n)) != Standing::Clutter
    };
    let kept: Vec<usize> = (0..start.thinned.points.points.len()).filter(kept).collect();
    start.thinned.points.chosen(&kept)
}

/// One class millimetre in the scan's unit.
fn class_millimetre(model: &Model<'_>, placed: &Placed) -> f64 {
    f64::from(model.header().scales.millimetre) / f64::from(placed.pose.scale)
}

/// How the points lie on the fitted surface.
struct Agreement {
    /// Share of the points near the model, clutter aside, that are within two class millimetres.
    inliers: f64,
    /// Their root mean square distance, voxels.
    rms: f64,
    /// Share of all points, clutter among them, that lie where the model stores nothing.
    outside: f64,
}

fn judge(
    model: &Model<'_>,
    start: &Start,
    (fitted, fit): (&Fitted<'_>, &Fit),
    merged: &Merged,
    (agreement, expected): (Agreement, Option<f64>),
) -> Verdict {
    let (mut inferred, mut total) = (0.0, 0.0);
    for (t, corners) in merged.mesh.triangles.iter().enumerate() {
        let area = merged.mesh.area_of(t);
        total += area;
        inferred +=
            area * corners.iter().filter(|&&v| merged.labels[v as usize] != MEASURED).count() as f64 / 3.0;
    }
    let used = 1.0 - start.thinned.elsewhere - start.thinned.clutter;
    let squares: f64 = fit.global.iter().map(|w| w * w).sum();
    let (inliers, exactness) = fitted.explained(model, start);
    let placed = &fitted.placed;
    Verdict {
        grade: Grade::Good,
        reasons: Vec::new(),
        inlier_share: agreement.inliers,
        outside_share: start.thinned.elsewhere + used * agreement.outside,
        seen_rms: agreement.rms / f64::from(placed.pose.scale),
        inferred_share: inferred / f64::max(total, f64::MIN_POSITIVE),
        inferred_area: inferred,
        weight_norm: (squares / fit.global.len().max(1) as f64).sqrt(),
        scale: placed.size(model),
        pose_inliers: [used * inliers, start.known.runner_up],
        exactness,
        spread: fitted.posterior.as_ref().and_then(spread),
        expected,
    }
    .judged(class_millimetre(model, placed), unit::symbol(model.header().unit))
}
