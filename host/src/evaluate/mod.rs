//! Figure 2 of the paper: how well each model approximates complete shapes, by the number of training shapes.
//!
//! For every number of training shapes some draws are made; every draw trains the correspondence model (where the
//! meshes share their connectivity) and the volumetric model, and every target is approximated by each of them.
//! Distances of the training shapes are measured once.

mod approximate;
mod digest;
mod draw;
mod method;
mod plot;
mod state;
mod summary;
mod whole;

pub use approximate::{Approximation, PoseMode, Target};
pub use draw::{draw, draws};
pub use method::{Fields, Fitter, Method, Smooth, Solver};
pub use plot::figure;
pub use state::State;
pub use summary::{Quartiles, Row, Summary, missed};

use crate::correspondence::{Correspondence, correspond};
use crate::io;
use crate::mesh::Mesh;
pub use crate::score::{Score, score};
use crate::sentence::sentence;
use crate::train;
use crate::train::prepared::Prepared;
use approximate::{Models, Names};
use digest::digest;
pub use digest::digest_of as mesh_digest;
use lacuna::Model;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use whole::Whole;

/// What each model reached on one target.
pub type Scores = BTreeMap<Approximation, Score>;

/// One result: a draw and a target.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// Training shapes.
    pub count: usize,
    /// Number of the draw.
    pub draw: usize,
    /// Name of the target.
    pub target: String,
    /// Digest of its vertices.
    pub digest: u32,
    /// Distances from the approximations to the target.
    pub scores: Scores,
}

/// What is evaluated.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Numbers of training shapes.
    pub counts: Vec<usize>,
    /// Draws for each of them.
    pub draws: usize,
    /// Seed of the draws.
    pub seed: u64,
    /// How targets come to the model.
    pub pose: PoseMode,
    /// How shapes are fitted.
    pub method: Method,
    /// Also the models the local one is compared with: eq. (9), correspondences, the grid's floor.
    pub baselines: bool,
    /// Whether the surfaces are written too ([`State::surfaces`]).
    pub surfaces: bool,
    /// How models are trained.
    pub train: train::Settings,
}

/// Why an evaluation stops.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// More shapes asked for than there are.
    #[error("{asked} training shapes were asked for and {given} are there: lower --counts")]
    TooMany {
        /// The largest count.
        asked: usize,
        /// Training shapes.
        given: usize,
    },
    /// A target without area.
    #[error("target {0} has no triangles with an area: targets are complete meshes")]
    NoSurface(String),
    /// Training.
    #[error(transparent)]
    Train(#[from] train::Error),
    /// A model the core refuses.
    #[error("{}", sentence("the trained model", .0))]
    Model(lacuna::Error),
    /// A target that cannot be registered.
    #[error("target {0}: {1}; is it of the same class, and near the training shapes (--pose search)?")]
    Register(String, crate::register::Error),
    /// A target that cannot be fitted.
    #[error("target {0}: the fit was refused: {text}", text = sentence("the model", .1))]
    Fit(String, lacuna::Error),
    /// Nothing to score.
    #[error(
        "target {0}: the {1} approximation has no surface near the target: is it of the same class and pose?"
    )]
    NoResult(String, Approximation),
    /// A file.
    #[error(transparent)]
    File(#[from] io::Error),
}

impl Error {
    /// Whether it is one target's own, and the others can still be approximated.
    fn of_one_target(&self) -> bool {
        matches!(self, Self::Register(..) | Self::Fit(..) | Self::NoResult(..))
    }
}

/// What an evaluation found.
#[derive(Debug, Default)]
pub struct Outcome {
    /// Every result, in the order they were found.
    pub records: Vec<Record>,
    /// Why targets could not be approximated, by target, each with its first reason.
    pub failed: BTreeMap<String, Error>,
    /// The folder of the surfaces, where they were asked for.
    pub surfaces: Option<PathBuf>,
}

/// Results as they come.
struct Progress<'a> {
    state: State,
    failed: BTreeMap<String, Error>,
    done: u64,
    heard: &'a (dyn Fn(u64) + Sync),
}

impl Progress<'_> {
    /// Keeps a result, or why a target has none. Any other error ends the evaluation.
    fn keep(&mut self, target: &str, result: Result<Record, Error>) -> Result<(), Error> {
        match result {
            // It is there already where only its surfaces were missing.
            Ok(record) if self.state.holds(record.count, record.draw, &record.target, record.digest) => {}
            Ok(record) => self.state.add(record)?,
            Err(error) if error.of_one_target() => {
                self.failed.entry(target.into()).or_insert(error);
            }
            Err(error) => return Err(error),
        }
        self.done += 1;
        (self.heard)(self.done);
        Ok(())
    }
}

/// Training shapes, in one pose, and targets.
pub struct Evaluation {
    shapes: Vec<Mesh>,
    targets: Vec<Target>,
    /// Measured shapes by the stride the models are made with.
    prepared: BTreeMap<Option<u8>, Prepared>,
}

/// A draw and the targets it has not been applied to.
struct Job {
    count: usize,
    draw: usize,
    targets: Vec<usize>,
}

impl Evaluation {
    /// Shapes and targets in one frame, roughly.
    pub fn new(shapes: Vec<Mesh>, targets: Vec<Target>) -> Self {
        Self { shapes, targets, prepared: BTreeMap::new() }
    }

    /// Opens what is known for the settings already, in `folder`.
    ///
    /// # Errors
    /// More training shapes asked for than there are, or a folder that cannot be written.
    pub fn open(&self, settings: &Settings, folder: &Path) -> Result<State, Error> {
        enough(&settings.counts, self.shapes.len())?;
        Ok(State::open(folder, self.key(settings)?)?)
    }

    /// A digest of the program, the shapes and all settings a result depends on.
    fn key(&self, settings: &Settings) -> Result<u32, Error> {
        // All fields are named, so that a new one has to be thought of here. Counts and draws are told by each record,
        // surfaces are written beside it.
        let Settings { counts: _, draws: _, seed, pose, method, baselines, surfaces: _, train } = settings;
        let program = digest::of_program()?;
        let chosen = format!("{program} {seed} {pose:?} {method:?} {baselines} {:?}", chosen(train));
        let shapes = self.shapes.iter().map(|shape| mesh_digest(shape).to_le_bytes().to_vec());
        Ok(digest(std::iter::once(chosen.into_bytes()).chain(shapes)))
    }

    /// Why there is no correspondence model, or not in every draw: the first training shape whose vertices do not
    /// correspond to those of the first one, counted from zero.
    pub fn without_correspondence(&self) -> Option<usize> {
        self.shapes.iter().position(|shape| !correspond(&self.shapes[0], shape))
    }

    /// The targets that a correspondence model cannot approximate, because it has other vertices.
    pub fn not_corresponding(&self) -> impl Iterator<Item = &str> {
        let first = self.shapes.first();
        let other = move |target: &&Target| first.is_some_and(|first| !correspond(first, &target.mesh));
        self.targets.iter().filter(other).map(|target| target.name.as_str())
    }

    /// Does what is not in `state` yet, or has no surfaces though they are asked for, adds it there, and returns all results
    /// for the settings. A target that cannot be approximated does not end it. `progress` hears of steps done and steps in
    /// all.
    ///
    /// # Errors
    /// See [`Error`].
    pub fn run(
        &mut self,
        settings: &Settings,
        state: State,
        progress: &(dyn Fn(u64, u64) + Sync),
    ) -> Result<Outcome, Error> {
        let surfaces = settings.surfaces.then(|| state.surfaces()).transpose()?;
        let jobs = self.jobs(settings, &state, surfaces.as_deref());
        let results: usize = jobs.iter().map(|job| job.targets.len()).sum();
        let measured = self.shapes.len() as u64;
        let total = measured + results as u64;
        let heard = |done| progress(measured + done, total);
        let found = Mutex::new(Progress { state, failed: BTreeMap::new(), done: 0, heard: &heard });
        if results > 0 {
            self.prepare(settings, &|done, _| progress(done, total))?;
            for job in &jobs {
                self.work(settings, job, surfaces.as_deref(), &found)?;
            }
        }
        let found = found.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
        let wanted = |r: &&Record| self.wants(settings, r);
        let records = found.state.records().iter().filter(wanted).cloned().collect();
        Ok(Outcome { records, failed: found.failed, surfaces })
    }

    fn wants(&self, settings: &Settings, record: &Record) -> bool {
        settings.counts.contains(&record.count)
            && record.draw < draws(self.shapes.len(), record.count, settings.draws)
            && self.targets.iter().any(|t| t.name == record.target && t.digest == record.digest)
    }

    fn jobs(&self, settings: &Settings, state: &State, surfaces: Option<&Path>) -> Vec<Job> {
        let mut jobs = Vec::new();
        for &count in &settings.counts {
            for draw in 0..draws(self.shapes.len(), count, settings.draws) {
                let missing = |&t: &usize| {
                    let target = &self.targets[t];
                    let drawn = surfaces.is_none_or(|folder| {
                        let names = Names { folder, count, draw, target: &target.name };
                        names.are_complete()
                    });
                    !(drawn && state.holds(count, draw, &target.name, target.digest))
                };
                let targets = (0..self.targets.len()).filter(missing).collect();
                jobs.push(Job { count, draw, targets });
            }
        }
        jobs.retain(|job| !job.targets.is_empty());
        jobs
    }

    /// Measures the shapes for models of the method's stride, once.
    fn prepare(&mut self, settings: &Settings, progress: &(dyn Fn(u64, u64) + Sync)) -> Result<(), Error> {
        let stride = settings.method.model_stride();
        if !self.prepared.contains_key(&stride) {
            let settings = train::Settings { stride, ..settings.train.clone() };
            let prepared = Prepared::new(&self.shapes, &settings, MARGIN, progress)?;
            self.prepared.insert(stride, prepared);
        }
        Ok(())
    }

    fn work(
        &self,
        settings: &Settings,
        job: &Job,
        surfaces: Option<&Path>,
        found: &Mutex<Progress<'_>>,
    ) -> Result<(), Error> {
        let prepared = &self.prepared[&settings.method.model_stride()];
        let members = draw(self.shapes.len(), job.count, job.draw, settings.seed);
        let bytes = prepared.model(&members)?;
        let model = Model::from_bytes(&bytes).map_err(Error::Model)?;
        let budget = train::grid::Budget::new(&self.shapes, &settings.train);
        if settings.baselines {
            budget.check_whole(model.grid().sides(), members.len())?;
        }
        if !settings.method.is_the_cores() {
            budget.check_reference(model.grid().sides(), model.modes(), job.targets.len())?;
        }
        let shapes: Vec<&Mesh> = members.iter().map(|&m| &self.shapes[m]).collect();
        let models = Models {
            prepared,
            whole: settings.baselines.then(|| Whole::train(prepared, &members, &model)),
            correspondence: if settings.baselines { Correspondence::train(&shapes).ok() } else { None },
            model: &model,
            fitter: Fitter::new(&model, settings.method),
        };
        job.targets.par_iter().try_for_each(|&t| {
            let target = &self.targets[t];
            let names = |folder| Names { folder, count: job.count, draw: job.draw, target: &target.name };
            let result = models.scores(target, settings, surfaces.map(names)).map(|scores| Record {
                count: job.count,
                draw: job.draw,
                target: target.name.clone(),
                digest: target.digest,
                scores,
            });
            found.lock().unwrap_or_else(std::sync::PoisonError::into_inner).keep(&target.name, result)
        })
    }
}

/// The settings of the training that its result depends on. All fields are named, so that a new one has to be thought of
/// here. A class's name is not a number, and memory only refuses.
fn chosen(settings: &train::Settings) -> impl std::fmt::Debug {
    let train::Settings {
        class: _,
        spacing,
        modes,
        stride,
        unit,
        distances,
        symmetric,
        apart,
        memory: _,
        limits,
    } = settings;
    (spacing, modes, stride, unit, distances, symmetric, apart, limits)
}

/// Refuses numbers of training shapes above that of those `given`.
///
/// # Errors
/// [`Error::TooMany`].
pub fn enough(counts: &[usize], given: usize) -> Result<(), Error> {
    match counts.iter().max() {
        Some(&asked) if asked > given => Err(Error::TooMany { asked, given }),
        _ => Ok(()),
    }
}

/// Standard deviations by which bands of some shapes may lie outside that of all.
const MARGIN: f64 = 3.0;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synth::Head;

    #[test]
    fn meshes_whose_vertices_do_not_correspond_are_named() {
        let [head, other] = [0, 1].map(|number| Head::sample(1, number).mesh());
        let mut cut = head.clone();
        cut.triangles.pop();
        let targets =
            [("same", &head), ("cut", &cut)].map(|(name, mesh)| Target::new(name, mesh.clone()).unwrap());
        let evaluation = |shapes: [&Mesh; 3]| Evaluation::new(shapes.map(Mesh::clone).into(), vec![]);
        assert_eq!(evaluation([&head, &head, &head]).without_correspondence(), None);
        assert_eq!(evaluation([&head, &head, &other]).without_correspondence(), Some(2));
        let evaluation = Evaluation::new(vec![head.clone(); 2], targets.into());
        assert_eq!(evaluation.not_corresponding().collect::<Vec<_>>(), ["cut"]);
    }
}
