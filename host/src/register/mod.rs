//! Registration: where the scan lies in the model's frame, without a hint.
//!
//! Tables and walls are left out ([`planes`]). Coarse search over point pairs ([`search`]), then every candidate is refined by
//! the core's joint estimate of pose and shape ([`joint`]), and the one that explains most of the scan wins ([`rank`]). A search
//! whose winner does not convince draws more pairs. Among clutter, each of the best is refined again without what lies beside
//! the shape ([`trim`]), other sizes are tried ([`resize`]), and while what was found is not sure, other pairs are drawn. Of a
//! scene of several things, what lies beside the best is searched, too, and the likeliest thing wins ([`scene`]).

pub mod field;
pub mod joint;
pub mod pairs;
pub mod partners;
mod placed;
pub mod planes;
pub mod probe;
pub mod rank;
pub mod resize;
pub mod scene;
pub mod search;
pub mod trim;
pub mod umeyama;

use crate::mesh::{Mesh, Point, Vector};
use crate::points::{OrientedPoints, thin};
use crate::sentence::sentence;
use crate::size;
use crate::unit;
use field::Field;
use joint::refine;
use lacuna::format::Unit;
use lacuna::pose_fit::{Hint, Round};
use lacuna::{Model, sample};
pub use placed::Placed;
use planes::without_planes;
use rank::{Scored, among_clutter, hopeless, next_best, ranked, sure};
use scene::Scene;
use trim::settled;

/// Fewest points that a pose is found for.
pub const FEWEST_POINTS: usize = 60;

/// The outcome of a registration.
#[derive(Clone, Debug)]
pub struct Registration {
    /// Where the scan lies.
    pub placed: Placed,
    /// Weights of the shape found with it, standard deviations.
    pub shape: Vec<f32>,
    /// Share of the scan's points within three class millimetres of the fitted surface, facing its way.
    pub inliers: f64,
    /// How exactly they lie on it: the mean of (1 - (r / 3)²)², r their distances in class millimetres; 0 without any.
    pub exactness: f64,
    /// Share of the scan's points that are tables and walls, none of them inliers.
    pub planes: f64,
    /// Share of the scan's points that lie where the model stores nothing.
    pub outside: f64,
    /// What the best of the other poses that were tried explains as exactly, as such a share: `inliers` times the ratio of what
    /// both explain ([`rank`]), at most `inliers`; 0 without any.
    pub runner_up: f64,
}

impl Registration {
    /// Inliers as a share of the points that are no tables and walls.
    pub fn explained(&self) -> f64 {
        self.inliers / (1.0 - self.planes).max(f64::MIN_POSITIVE)
    }

    /// How the core goes on from this pose: as from a rough one, but among clutter, without which it was refined here.
    pub fn hint(&self) -> Hint {
        if among_clutter(self.explained(), self.exactness) { Hint::Settled } else { Hint::Rough }
    }
}

/// Why a scan cannot be registered.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// Too little surface.
    #[error(
        "the scan has only {0} points after thinning, at least {FEWEST_POINTS} are needed: is it a scan of this class, \
         in its unit?"
    )]
    TooFewPoints(usize),
    /// A table or a wall, and hardly more.
    #[error(
        "{:.0} % of the scan is flat, a table or a wall, and the other {points} points after thinning are too few, at \
         least {FEWEST_POINTS} are needed: is there a scan of this class in it?",
        100.0 * .planes
    )]
    OnlyPlanes {
        /// Share of the scan that planes are.
        planes: f64,
        /// What is left.
        points: usize,
    },
    /// A size that does not fit.
    #[error(
        "the scan is {scan:.4} {unit} long and the model {model:.4} {unit}: they differ by more than a factor of {limit}. {hint}"
    )]
    Size {
        /// Longest side of the scan.
        scan: f64,
        /// Longest side of the mean shape, in the model's unit.
        model: f64,
        /// The model's unit.
        unit: &'static str,
        /// Largest factor accepted.
        limit: f64,
        /// What may be the reason.
        hint: String,
    },
    /// Nothing matched.
    #[error(
        "the scan does not match the model anywhere: is it of the same class, or so noisy that it must be smoothed first?"
    )]
    NoMatch,
    /// The core refused.
    #[error("the pose could not be refined: {}", sentence("the model", .0))]
    Core(lacuna::Error),
}

impl From<lacuna::Error> for Error {
    fn from(error: lacuna::Error) -> Self {
        Self::Core(error)
    }
}

/// A scan without tables and walls, thinned: what its pose is found from.
struct Foreground {
    /// The whole scan, thinned.
    all: Vec<Point>,
    /// Of the other points.
    centre: Point,
    /// Thinned and centred, without its planes.
    points: OrientedPoints,
    /// Share of the scan that these points are.
    share: f64,
}

impl Foreground {
    fn new(scan: &Mesh, field: &Field, model: &Model<'_>, seed: u64) -> Self {
        let spacing = f64::from(model.header().spacing);
        let all = thin(scan, spacing);
        let whole = all.points.clone();
        let (centre, points) = centred(&without_planes(field, all, spacing, seed));
        let share = points.points.len() as f64 / whole.len().max(1) as f64;
        Self { all: whole, centre, points, share }
    }

    /// Refuses what is too little for a pose.
    fn check(&self) -> Result<(), Error> {
        let (points, planes) = (self.points.points.len(), 1.0 - self.share);
        match points {
            FEWEST_POINTS.. => Ok(()),
            _ if planes > 0.5 => Err(Error::OnlyPlanes { planes, points }),
            _ => Err(Error::TooFewPoints(points)),
        }
    }

    /// What was found, in terms of the whole scan.
    fn registration(&self, model: &Model<'_>, found: Scored, runner_up: f64) -> Registration {
        let exactness = found.exactness();
        let Scored { pose, inliers, shape, .. } = found;
        let placed = Placed { centre: self.centre, pose };
        let [inliers, runner_up] = [inliers, runner_up].map(|share| self.share * share);
        let stored = |p: &&Point| sample::far(model, placed.to_voxels(p)).is_some();
        let outside = 1.0 - self.all.iter().filter(stored).count() as f64 / self.all.len().max(1) as f64;
        let planes = 1.0 - self.share;
        Registration { placed, shape, inliers, exactness, planes, outside, runner_up }
    }
}

/// Points around their centre, neighbours in space next to each other, as the pose fit wants them.
pub fn centred(points: &OrientedPoints) -> (Point, OrientedPoints) {
    let mut points = points.along_curve();
    let sum = points.points.iter().fold(Vector::zeros(), |sum, p| sum + p.coords);
    let centre = Point::from(sum / points.points.len().max(1) as f64);
    for point in &mut points.points {
        *point = Point::from(*point - centre);
    }
    (centre, points)
}

/// Turns of a glance: one more than the first if that does not convince.
const GLANCE: u64 = 2;
/// Turns of a search, at most: some more, each with pairs of its own, while what was found is not sure.
const TURNS: u64 = 5;

/// Finds the pose of a scan.
///
/// # Errors
/// A scan that is too small, of another size, or unlike the model.
pub fn register(model: &Model<'_>, scan: &Mesh, seed: u64) -> Result<Registration, Error> {
    register_within(model, scan, seed, TURNS)
}

/// Finds the pose of a scan if it is easy to find.
///
/// # Errors
/// As for [`register`].
pub fn glance(model: &Model<'_>, scan: &Mesh, seed: u64) -> Result<Registration, Error> {
    register_within(model, scan, seed, GLANCE)
}

fn register_within(model: &Model<'_>, scan: &Mesh, seed: u64, turns: u64) -> Result<Registration, Error> {
    let field = Field::of_model(model);
    check_size(scan, &field, model, model.header().unit)?;
    let foreground = Foreground::new(scan, &field, model, seed);
    let points = &foreground.points;
    foreground.check()?;
    let scene = Scene { model, field: &field, points, seed };
    let search = scene.search(points);
    let [mut finals, mut rest] = scene.searched(points, &search, 0..GLANCE);
    for turn in GLANCE..turns {
        let done = |best| hopeless(best) || sure(&field, best, finals.iter().chain(&rest));
        if finals.first().is_some_and(done) {
            break;
        }
        let [more, others] = scene.searched(points, &search, turn..turn + 1);
        finals = ranked(finals.into_iter().chain(more).collect());
        rest.extend(others);
    }
    if turns > GLANCE {
        finals = scene.with_other_things(finals);
    }
    let Some((best, others)) = finals.split_first().filter(|(best, _)| !hopeless(best)) else {
        return Err(Error::NoMatch);
    };
    let runner_up = next_best(&field, best, others.iter().chain(&rest)).min(best.inliers);
    Ok(foreground.registration(model, best.clone(), runner_up))
}

/// Seed of the points tried as planes where nothing is searched for.
const SEED: u64 = 1;

/// Refines a pose that is known roughly.
///
/// # Errors
/// Too little surface, or a pose that is none.
pub fn refine_hint(model: &Model<'_>, scan: &Mesh, hint: &Placed) -> Result<Registration, Error> {
    let field = Field::of_model(model);
    let foreground = Foreground::new(scan, &field, model, SEED);
    let (points, rough) = (&foreground.points, hint.about(foreground.centre).pose);
    Ok(foreground.registration(model, settled(model, &field, points, rough)?, 0.0))
}

/// Iterations that draw the model as a whole to a shape.
const WHOLE: Round = Round {
    iterations: 8,
    points: usize::MAX,
    misfit: 2.5,
    growth: true,
    shape: true,
    own: false,
    tied: false,
};

/// Refines a pose that is known well for the model as a whole: the pose in which it approximates a complete shape best.
///
/// # Errors
/// As for [`refine_hint`].
pub fn refine_whole(model: &Model<'_>, shape: &Mesh, known: &Placed) -> Result<Registration, Error> {
    let all = thin(shape, f64::from(model.header().spacing));
    let (centre, points) = centred(&all);
    // Of a whole shape nothing is background.
    let whole = Foreground { all: all.points, centre, points, share: 1.0 };
    let found = refine(model, &whole.points, known.about(centre).pose, &[WHOLE])?;
    Ok(whole.registration(model, found, 0.0))
}

/// Refuses scans, in the model's unit, that cannot be of its size even without many stray points, and offers another unit
/// than the one they were `taken` to be in.
///
/// # Errors
/// [`Error::Size`].
pub fn check_size(scan: &Mesh, field: &Field, model: &Model<'_>, taken: Unit) -> Result<(), Error> {
    let model_size = field.size * f64::from(model.header().spacing);
    let size = size::of_mesh(scan);
    let Some(hint) = size::misfit(size, model_size, taken) else { return Ok(()) };
    // Points in the air are specks, and left out later.
    if size > model_size && size::misfit(size::of_most(scan), model_size, taken).is_none() {
        return Ok(());
    }
    let symbol = unit::symbol(model.header().unit);
    Err(Error::Size { scan: size, model: model_size, unit: symbol, limit: size::LIMIT, hint })
}
