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
use crate::uncertainty::spread::{Spread, spread};
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
    let settings = Settings { reach: Reach::of(model), rounds: start.hint.rounds(model), schedule };
    fit::<A>(model, &start.packed(), &start.rough.pose, settings).map_err(Error::Fit)
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
    let placed = Placed { centre: start.rough.centre, pose: fit.outcome.pose };
    let points = without_clutter(model, &start, &fit);
    let centred = Placed { centre: Point::origin(), ..placed };
    let field = Dense::new(model, &fit.local_distances);
    let agreement = agreement(&field, (&points, start.points.points.len()), &centred, model);
    let global_field = Dense::new(model, &fit.global_distances);
    let (global, local) = (global_field.surface(&placed, 1), field.surface(&placed, 1));
    let voxels: Vec<Point> = points.points.iter().map(|p| centred.to_model(p)).collect();
    // A given pose was not estimated, and no weights with it.
    let posed = !start.hint.rounds(model).is_empty();
    let global_weights = || fit.global.iter().map(|&weight| weight as f32).collect();
    let weights = if posed { fit.shape.clone() } else { global_weights() };
    let posterior = Posterior::new(model, &points, &placed.pose, &weights, posed);
    let fields = (field, &global_field);
    let drawn = drawn_to_scan(model, fields, posterior.as_ref(), (&measured.surface, &placed), &voxels);

    let fitted = fair(&drawn.surface(&placed, options.finer), FAIRING);
    if fitted.triangles.is_empty() {
        return Err(Error::NoSurface(
            "the fitted distances have no zero level: the scan does not match the model",
        ));
    }
    let unit = class_millimetre(model, &placed);
    let limits = Limits { motion: MOTION * unit, sideways: measured.sideways, step: STEP * unit };
    let merged = merge::merge(&fitted, &measured.surface, &limits);
    let clutter = Clutter::of(&scan, &merged.mesh, APART * unit);
    let hidden = hidden::error(&points.normals) * model.header().scales.millimetre;
    let cues_of = |posterior: &Posterior<'_>| cues(posterior, &placed, &merged, hidden);
    let cues = posterior.as_ref().map(cues_of).unwrap_or_default();
    let expected = Expected::new(&cues, model, placed.pose.scale);
    let determined = posterior.as_ref().and_then(spread);
    let expected_shares = shares(&expected.errors, &|v| merged.labels[v] == MEASURED);
    let [_, inferred] = expected_shares;
    let vague = inferred.filter(|_| expected.calibrated).map(|inferred| inferred.median);
    let verdict = judge(model, &start, &placed, &fit, &merged, (agreement, determined, vague));
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
    let pieces = pieces::belonging(model, &cleaned, &start.rough);
    let mut scan = cleaned.scan;
    if pieces.points.is_empty() {
        return Ok((scan, measured, start));
    }
    scan.append(&pieces);
    let measured = scan_surface(&scan, model)?;
    // The points of a depth image are not those of its mesh, and have all pieces.
    if start.depth.is_none() {
        start.thin(model, &scan);
    }
    Ok((scan, measured, start))
}

/// The local fit's distances: without what did not settle, with the volume to be expected where nobody looked, and the
/// scan's own beyond what the model stores; `voxels` are the scan's points.
fn drawn_to_scan(
    model: &Model<'_>,
    (mut local, global): (Dense, &Dense),
    posterior: Option<&Posterior<'_>>,
    (scan, placed): (&Surface, &Placed),
    voxels: &[Point],
) -> Dense {
    let near = OWN_REACH / f64::from(placed.pose.scale);
    // A voxel hears of the nodes around it, and they reach as far again.
    let reach = 2 * usize::from(model.header().stride);
    let own = |i: usize| global.measured(i, scan, placed, near);
    let measured = diffusion::diffuse(&mut local, global, voxels, reach, own);
    if let Some(posterior) = posterior {
        let deviations = level::deviations(&local, posterior);
        level::level(&mut local, &deviations, &measured);
    }
    local.extend(model, scan, placed, voxels);
    local
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
    if start.hint.rounds(model).is_empty() {
        return start.points.clone();
    }
    let packed = start.packed();
    let cloud = packed.cloud();
    let (pose, shape) = (&fit.outcome.pose, Weights::new(&fit.shape));
    let mut cube = Cube::new(model, &shape);
    let kept = |&i: &usize| {
        let Ok(Some((p, n))) = cloud.map(|cloud| cloud.point(i)) else { return false };
        Standing::of(&mut cube, pose.apply(p), pose.rotate(n)) != Standing::Clutter
    };
    let kept: Vec<usize> = (0..start.points.points.len()).filter(kept).collect();
    start.points.chosen(&kept)
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

/// How the points of the hull, of `all` in the scan, lie on the fitted surface.
fn agreement(
    field: &Dense,
    (points, all): (&OrientedPoints, usize),
    placed: &Placed,
    model: &Model<'_>,
) -> Agreement {
    let reach = 2.0 * f64::from(model.header().scales.millimetre);
    let (mut near, mut inliers, mut squares) = (0usize, 0usize, 0.0);
    for point in &points.points {
        if let Some((d, gradient)) = field.at(&placed.to_model(point)) {
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
        outside: (points.points.len() - near) as f64 / all.max(1) as f64,
    }
}

/// How exactly the inliers lie on the surface fitted with the pose; none where the pose was given, and no surface with it.
fn exactness(model: &Model<'_>, start: &Start, fit: &Fit) -> Option<f64> {
    if start.hint.rounds(model).is_empty() {
        return None;
    }
    let packed = start.packed();
    let (inliers, agreement) =
        joint::agreement(model, packed.cloud().ok()?, &fit.outcome.pose, &Weights::new(&fit.shape));
    (inliers > 0.0).then(|| agreement / inliers)
}

fn judge(
    model: &Model<'_>,
    start: &Start,
    placed: &Placed,
    fit: &Fit,
    merged: &Merged,
    (agreement, spread, expected): (Agreement, Option<Spread>, Option<f64>),
) -> Verdict {
    let (mut inferred, mut total) = (0.0, 0.0);
    for (t, corners) in merged.mesh.triangles.iter().enumerate() {
        let area = merged.mesh.area_of(t);
        total += area;
        inferred +=
            area * corners.iter().filter(|&&v| merged.labels[v as usize] != MEASURED).count() as f64 / 3.0;
    }
    let used = 1.0 - start.elsewhere - start.clutter;
    let squares: f64 = fit.global.iter().map(|w| w * w).sum();
    Verdict {
        grade: Grade::Good,
        reasons: Vec::new(),
        inlier_share: agreement.inliers,
        outside_share: start.elsewhere + used * agreement.outside,
        seen_rms: agreement.rms / f64::from(placed.pose.scale),
        inferred_share: inferred / f64::max(total, f64::MIN_POSITIVE),
        inferred_area: inferred,
        weight_norm: (squares / fit.global.len().max(1) as f64).sqrt(),
        scale: placed.size(model),
        pose_inliers: [
            used * f64::from(fit.outcome.inliers) / start.points.points.len().max(1) as f64,
            start.runner_up,
        ],
        exactness: exactness(model, start, fit),
        spread,
        expected,
    }
    .judged(class_millimetre(model, placed), unit::symbol(model.header().unit))
}
