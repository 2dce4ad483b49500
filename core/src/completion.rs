//! A whole completion as one job: pose → hull → global fit → local fit, step by step in lent memory.
//!
//! This is the one home of the pipeline: the host's `complete` and a device both run it, so they compute the
//! same bits from the same packed points and the same rough pose.

use crate::arithmetic::Arithmetic;
use crate::cloud::Cloud;
use crate::corners::Weights;
use crate::digest::digest;
use crate::distance_cache::DistanceCache;
use crate::error::Error;
use crate::global_fit::GlobalFit;
use crate::hull::{Hull, HullBuilder, Reach};
use crate::local_fit::LocalFit;
use crate::memory::Memory;
use crate::model::Model;
use crate::pose::Pose;
use crate::pose_fit::{Agreement, PoseFit, Round};
use crate::progress::Progress;
use crate::schedule::Schedule;
use crate::sizes::Sizes;
use crate::standing::Standing;
use crate::workspace::Workspace;

/// Points the pose is estimated from; of more, every so many.
pub const POSE_POINTS: usize = 1600;
/// Most points on the shape for a voxel of the hull, and points of the scan for one on the shape: see [`Outcome::doubt`].
const SPARSEST: u64 = 32;
const FEWEST_ON_IT: u64 = 4;
/// Points claimed in one step.
const CHUNK: usize = 64;

/// What the next step belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Stage {
    /// Pose and shape estimated together.
    Pose,
    /// Points claim voxels.
    Hull,
    /// One weight vector.
    Global,
    /// A field of weights.
    Local,
    /// Nothing: the job is over.
    Done,
}

/// How a completion is run. How far its points reach is the model's: [`Reach::of`].
#[derive(Clone, Copy, Debug)]
pub struct Settings<'b> {
    /// Iterations of the pose; none takes the pose as it is, and every point for part of the shape.
    pub rounds: &'b [Round],
    /// Iterations of the local fit.
    pub schedule: Schedule<'b>,
}

/// What a completion found, as far as it has come. Whatever the scan was, a fit comes to an end; whether its result can be
/// used, [`Outcome::doubt`] tells.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Outcome {
    /// From the scan to voxels.
    pub pose: Pose,
    /// How the points lay on the model in the last iteration of the pose.
    pub agreement: Agreement,
    /// Points that lie on the surface fitted with the pose and face its way; on the mean's where the pose was held.
    pub inliers: u32,
    /// Points left out because they lie far from it: hair, collar, table.
    pub clutter: u32,
    /// Voxels in the hull.
    pub hull_voxels: u32,
    /// What the stages computed.
    pub digests: Digests,
}

/// What speaks against a result.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Doubt {
    /// The points are in far fewer voxels than they should be: a scan in another unit, or all of it in one place.
    Size,
    /// Few of the points lie on the fitted shape and face its way: a wrong pose, normals that look inward, another
    /// kind of object, or a scene with little of the class in it.
    Pose,
}

impl Outcome {
    /// What speaks against the result for a scan of so many `points`, at least an eighth of a voxel apart, if anything
    /// does. There must be a voxel in the hull for at most 32 points on the shape (the example scan: 2; taken in
    /// centimetres instead of millimetres: 72), and a quarter of the points must be on it (the example: 0.87, half a head
    /// with shoulders 0.26: below a quarter the host wants somebody to look, too).
    pub const fn doubt(&self, points: usize) -> Option<Doubt> {
        if (self.hull_voxels as u64) * SPARSEST < self.inliers as u64 {
            return Some(Doubt::Size);
        }
        if (self.inliers as u64) * FEWEST_ON_IT < points as u64 { Some(Doubt::Pose) } else { None }
    }
}

/// CRC-32 of each stage's result; 0 for a stage that has not ended.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Digests {
    /// Pose and its weights.
    pub pose: u32,
    /// Hull targets.
    pub hull: u32,
    /// Global weights, 1/2048 standard deviation.
    pub global: u32,
    /// Node weights, 1/2048 standard deviation.
    pub local: u32,
}

/// The stage under way, with the memory it was lent.
#[derive(Debug)]
// No heap to keep the largest one in.
#[allow(clippy::large_enum_variant)]
enum Work<'b, A: Arithmetic> {
    Pose(PoseFit<'b, 'b>),
    Hull(HullBuilder<'b, 'b, A::Residual>, usize),
    Global(GlobalFit<'b, 'b>),
    Local(LocalFit<'b, 'b, A>),
    Done(LocalFit<'b, 'b, A>),
    Stopped(Error),
}

/// A completion under way.
#[derive(Debug)]
pub struct Completion<'b, A: Arithmetic> {
    model: &'b Model<'b>,
    cloud: Cloud<'b>,
    settings: Settings<'b>,
    targets: &'b mut [i16],
    normal: &'b mut [f64],
    block: &'b mut [i32],
    global: &'b mut [f64],
    workspace: Workspace<'b, A>,
    /// Weights of the pose fit, standard deviations.
    shape: &'b [f32],
    weights: &'b [f64],
    hull: Hull<'b>,
    work: Work<'b, A>,
    outcome: Outcome,
}

impl<'b, A: Arithmetic> Completion<'b, A> {
    /// Prepares the completion of `cloud` from a rough `pose`, which the application or the host has searched for: the
    /// example scan finds its way from 15 voxels, 45 degrees or a quarter of its size off, along and about any axis.
    /// [`Pose::in_frame_of`] makes a pose from millimetres.
    ///
    /// `memory` is used until the completion is dropped; lend it by [`Memory::reborrow`] to use it again.
    ///
    /// # Errors
    /// What the stages refuse: too few points, a pose that is none, options out of range, a buffer too small.
    pub fn new(
        model: &'b Model<'b>,
        cloud: Cloud<'b>,
        pose: Pose,
        settings: Settings<'b>,
        memory: Memory<'b, A>,
    ) -> Result<Self, Error> {
        Sizes::required(model, &settings.schedule)?.check(&memory)?;
        let fit = PoseFit::new(model, cloud, POSE_POINTS, pose, settings.rounds, memory.pose)?;
        let outcome = Outcome {
            pose,
            agreement: Agreement::default(),
            inliers: 0,
            clutter: 0,
            hull_voxels: 0,
            digests: Digests::default(),
        };
        let Memory { targets, normal, block, global, workspace, .. } = memory;
        let hull = Hull { targets: &[], count: 0, weight: 0 };
        let (shape, weights): (&[f32], &[f64]) = (&[], &[]);
        let work = Work::Pose(fit);
        Ok(Self {
            model,
            cloud,
            settings,
            targets,
            normal,
            block,
            global,
            workspace,
            shape,
            weights,
            hull,
            work,
            outcome,
        })
    }

    /// A bounded piece of work, with the stage it belonged to. `None` when the job is over. The longest one updates all
    /// weights: on a Cortex-M7 5.7 million instructions for a model of 29 modes and 3,184 nodes, where
    /// [`Completion::new`] takes 4.6 million and [`Model::from_bytes`] before it 5.4 (the table of `targets/README.md`, which
    /// a test keeps to what is measured). The deepest one takes 18 KiB of stack.
    pub fn step(&mut self) -> Option<(Stage, Progress)> {
        loop {
            let stage = self.stage();
            let progress = match &mut self.work {
                Work::Pose(fit) => fit.step(),
                Work::Hull(..) => self.claim(),
                Work::Global(fit) => fit.step(),
                Work::Local(fit) => fit.step(),
                Work::Done(_) | Work::Stopped(_) => None,
            };
            if let Some(progress) = progress {
                return Some((stage, progress));
            }
            if !self.advance() {
                return None;
            }
        }
    }

    /// Runs all steps.
    pub fn run(&mut self) {
        while self.step().is_some() {}
    }

    /// The stage of the next step.
    pub const fn stage(&self) -> Stage {
        match self.work {
            Work::Pose(_) => Stage::Pose,
            Work::Hull(..) => Stage::Hull,
            Work::Global(_) => Stage::Global,
            Work::Local(_) => Stage::Local,
            Work::Done(_) | Work::Stopped(_) => Stage::Done,
        }
    }

    /// What was found so far.
    ///
    /// # Errors
    /// The scan does not touch the model.
    pub const fn outcome(&self) -> Result<Outcome, Error> {
        match self.work {
            Work::Stopped(error) => Err(error),
            _ => Ok(self.outcome),
        }
    }

    /// Weights of the pose fit, standard deviations; zero where the pose was held.
    pub const fn shape(&self) -> &[f32] {
        self.shape
    }

    /// Global weights, standard deviations.
    pub const fn global(&self) -> &[f64] {
        self.weights
    }

    /// The hull.
    pub const fn hull(&self) -> Hull<'b> {
        self.hull
    }

    /// The local fit, once it has begun.
    pub const fn local(&mut self) -> Option<&mut LocalFit<'b, 'b, A>> {
        match &mut self.work {
            Work::Local(fit) | Work::Done(fit) => Some(fit),
            _ => None,
        }
    }

    /// Lets a chunk of points claim their voxels.
    fn claim(&mut self) -> Option<Progress> {
        let Work::Hull(builder, next) = &mut self.work else { return None };
        if *next >= self.cloud.len() {
            return None;
        }
        let (pose, known) = (self.outcome.pose, !self.settings.rounds.is_empty());
        let symmetry = self.model.symmetry();
        let shape = Weights::new(self.shape);
        let mut surface = DistanceCache::new(self.model, &shape, self.workspace.gradient);
        for index in *next..(*next + CHUNK).min(self.cloud.len()) {
            let Some((point, normal)) = self.cloud.point(index) else { continue };
            let (point, normal) = (pose.apply(point), pose.rotate(normal));
            let place = Standing::of(self.model, point, normal, |at| surface.sample(at));
            self.outcome.inliers += u32::from(place == Standing::Inlier);
            if known && place.is_left_out() {
                self.outcome.clutter += 1;
            } else {
                builder.add(point, normal);
                if let Some(symmetry) = symmetry {
                    builder.add_mirrored(symmetry.reflect(point), symmetry.turn(normal));
                }
            }
        }
        *next += CHUNK;
        let chunks = self.cloud.len().div_ceil(CHUNK);
        Some(Progress { done: (*next / CHUNK) as u32, total: chunks as u32 })
    }

    /// Hands the finished stage's result and memory to the next one; false at the end.
    fn advance(&mut self) -> bool {
        match core::mem::replace(&mut self.work, Work::Stopped(Error::EmptyHull)) {
            Work::Pose(fit) => self.begin_hull(fit),
            Work::Hull(builder, _) => self.begin_global(builder),
            Work::Global(fit) => self.begin_local(fit),
            Work::Local(fit) => {
                let weights = fit.weights().iter().map(|&w| A::stored(w).to_le_bytes());
                self.outcome.digests.local = digest(weights);
                self.work = Work::Done(fit);
            }
            over => {
                self.work = over;
                return false;
            }
        }
        true
    }

    fn begin_hull(&mut self, fit: PoseFit<'b, 'b>) {
        let (pose, agreement, shape) = fit.finish();
        (self.outcome.pose, self.outcome.agreement, self.shape) = (pose, agreement, shape);
        let numbers = pose.rotation.as_flattened().iter().chain(&pose.translation).chain([&pose.scale]);
        let halves = numbers.chain(shape).flat_map(|v| {
            let [a, b, c, d] = v.to_bits().to_le_bytes();
            [[a, b], [c, d]]
        });
        self.outcome.digests.pose = digest(halves);
        self.workspace.gradient.fill(A::ZERO);
        let (targets, keys) =
            (core::mem::take(&mut self.targets), core::mem::take(&mut self.workspace.residuals));
        self.work = match HullBuilder::new(self.model, Reach::of(self.model), targets, keys) {
            Ok(builder) => Work::Hull(builder, 0),
            Err(error) => Work::Stopped(error),
        };
    }

    fn begin_global(&mut self, builder: HullBuilder<'b, 'b, A::Residual>) {
        (self.hull, self.workspace.residuals) = builder.finish();
        self.outcome.hull_voxels = self.hull.count;
        self.outcome.digests.hull = self.hull.digest();
        let normal = core::mem::take(&mut self.normal);
        let (block, global) = (core::mem::take(&mut self.block), core::mem::take(&mut self.global));
        self.work = match GlobalFit::new(self.model, self.hull, normal, block, global) {
            Ok(fit) => Work::Global(fit),
            Err(error) => Work::Stopped(error),
        };
    }

    fn begin_local(&mut self, fit: GlobalFit<'b, 'b>) {
        self.weights = fit.finish();
        self.outcome.digests.global = digest(self.weights.iter().map(|&w| fixed(w)));
        let workspace = core::mem::take(&mut self.workspace);
        let (hull, schedule) = (self.hull, self.settings.schedule);
        self.work = match LocalFit::new(self.model, hull, self.weights, schedule, workspace) {
            Ok(fit) => Work::Local(fit),
            Err(error) => Work::Stopped(error),
        };
    }
}

/// Bytes of a weight as the fixed-point fit keeps it.
fn fixed(sigma: f64) -> [u8; 2] {
    crate::arithmetic::Fixed::weight(sigma).to_le_bytes()
}
