//! What the device knows of the scan: its announcement, how many points have arrived, how far the fit is.

use super::intake::{Intake, Room};
use super::message::{Begin, Counters, Info, Reply, Request, State, Status, VERSION};
use super::refusal::Refusal;
use crate::arithmetic::Fixed;
use crate::completion::{Completion, Stage};

/// A scan's state on the device.
#[derive(Debug)]
pub(super) struct Desk<'d> {
    info: Info<'d>,
    /// Pixels of a depth image that the device keeps.
    kept: u32,
    scan: Option<Intake>,
    state: State,
    counters: Counters,
}

impl<'d> Desk<'d> {
    /// No scan; the device keeps `kept` pixels of a depth image.
    pub fn new(info: Info<'d>, kept: usize) -> Self {
        let kept = u32::try_from(kept).unwrap_or(u32::MAX);
        Self { info, kept, scan: None, state: State::Idle, counters: Counters::default() }
    }

    /// Points that are there.
    pub fn points(&self) -> usize {
        self.scan.map_or(0, |scan| scan.points())
    }

    /// Answers what needs neither points nor results.
    pub fn reply(&mut self, request: &Request<'_>) -> Reply<'d> {
        match request {
            Request::Hello { .. } => Reply::Hello { version: VERSION },
            Request::Info => Reply::Info(self.info),
            Request::Begin(begin) => self.begin(Intake::of_points(begin, self.info.max_points)),
            Request::BeginDepth(begin) => {
                self.begin(Intake::of_pixels(begin, self.info.max_points, self.kept))
            }
            Request::Status => self.status(),
            Request::Counters => Reply::Counters(self.counters),
            Request::Cancel => {
                (self.scan, self.state) = (None, State::Idle);
                self.status()
            }
            Request::Points { .. } | Request::DepthRows { .. } | Request::Fit => {
                Reply::Refused(Refusal::NoScan)
            }
            Request::Outcome | Request::Weights { .. } | Request::Distances { .. } => {
                Reply::Refused(Refusal::NoResult)
            }
        }
    }

    /// How far the scan has come.
    pub fn status(&self) -> Reply<'d> {
        let (scan, announced) = self.scan.map_or((0, 0), |scan| scan.announced());
        let received = self.scan.map_or(0, |scan| scan.received());
        Reply::Status(Status { state: self.state, scan, received, announced })
    }

    fn begin(&mut self, scan: Result<Intake, Refusal>) -> Reply<'d> {
        match scan {
            Ok(scan) => {
                (self.scan, self.state) = (Some(scan), State::Receiving);
                self.status()
            }
            Err(refusal) => Reply::Refused(refusal),
        }
    }

    /// Takes a batch of points or pixels.
    pub fn take(&mut self, request: &Request<'_>, room: &mut Room<'_>) -> Reply<'d> {
        let scan = self.scan.as_mut().ok_or(Refusal::NoScan);
        let open = scan.and_then(|scan| match self.state {
            State::Receiving => Ok(scan),
            _ => Err(Refusal::Busy),
        });
        let taken = open.and_then(|scan| scan.take(request, room));
        taken.map_or_else(Reply::Refused, |()| self.status())
    }

    /// The scan to fit, when all of it is there.
    pub fn ready(&self) -> Result<Begin, Refusal> {
        self.scan.as_ref().ok_or(Refusal::NoScan)?.ready()
    }

    /// The fit begins.
    pub fn start(&mut self) {
        self.counters = Counters::default();
        self.state = State::Fitting { stage: Stage::Pose, done: 0, total: 0 };
    }

    /// Whether the scan is being fitted or has been.
    pub const fn has_job(&self) -> bool {
        self.is_fitting() || self.is_done()
    }

    /// Whether there is work.
    pub const fn is_fitting(&self) -> bool {
        matches!(self.state, State::Fitting { .. })
    }

    /// Whether there are results.
    pub const fn is_done(&self) -> bool {
        matches!(self.state, State::Done)
    }

    /// Does a piece of the work, if there is any, and counts it.
    pub fn step(&mut self, job: &mut Completion<'_, Fixed>, mut counter: impl FnMut() -> u64) {
        if !self.is_fitting() {
            return;
        }
        let before = counter();
        let step = job.step();
        let work = counter().wrapping_sub(before);
        let Some((stage, progress)) = step else {
            self.state = job.outcome().map_or_else(State::Failed, |_| State::Done);
            return;
        };
        match stage {
            Stage::Pose => self.counters.pose.add(work),
            Stage::Hull => self.counters.hull.add(work),
            Stage::Global => self.counters.global.add(work),
            Stage::Local | Stage::Done => self.counters.local.add(work),
        }
        self.state = State::Fitting { stage, done: progress.done, total: progress.total };
    }

    /// Distances were computed.
    pub const fn count_distances(&mut self, work: u64) {
        self.counters.distances.add(work);
    }
}
