//! What the device knows of the scan: its announcement, how many points have arrived, how far the fit is.

use super::message::{Begin, Counters, Info, Reply, Request, State, Status, VERSION};
use super::refusal::Refusal;
use crate::arithmetic::Fixed;
use crate::cloud::{Cloud, POINT_BYTES, Packed, from_bytes};
use crate::completion::{Completion, Stage};
use crate::error::Error;

/// A scan's state on the device.
#[derive(Debug)]
pub(super) struct Desk<'d> {
    info: Info<'d>,
    begin: Option<Begin>,
    received: u32,
    state: State,
    counters: Counters,
}

impl<'d> Desk<'d> {
    /// No scan.
    pub fn new(info: Info<'d>) -> Self {
        Self { info, begin: None, received: 0, state: State::Idle, counters: Counters::default() }
    }

    /// Points received.
    pub const fn received(&self) -> usize {
        self.received as usize
    }

    /// Answers what needs neither points nor results.
    pub fn reply(&mut self, request: &Request<'_>) -> Reply<'d> {
        match request {
            Request::Hello { .. } => Reply::Hello { version: VERSION },
            Request::Info => Reply::Info(self.info),
            Request::Begin(begin) => self.begin(begin),
            Request::Status => self.status(),
            Request::Counters => Reply::Counters(self.counters),
            Request::Cancel => {
                (self.begin, self.received, self.state) = (None, 0, State::Idle);
                self.status()
            }
            Request::DepthRows => Reply::Refused(Refusal::Unsupported),
            Request::Points { .. } | Request::Fit => Reply::Refused(Refusal::NoScan),
            Request::Outcome | Request::Weights { .. } | Request::Distances { .. } => {
                Reply::Refused(Refusal::NoResult)
            }
        }
    }

    /// How far the scan has come.
    pub fn status(&self) -> Reply<'d> {
        let (scan, announced) = self.begin.map_or((0, 0), |begin| (begin.scan, begin.points));
        Reply::Status(Status { state: self.state, scan, received: self.received, announced })
    }

    fn begin(&mut self, begin: &Begin) -> Reply<'d> {
        let limit = self.info.max_points;
        if begin.points > limit {
            return Reply::Refused(Refusal::TooManyPoints { limit });
        }
        if let Err(error) = Cloud::new(&[], begin.step) {
            return Reply::Refused(Refusal::Core(error));
        }
        if !begin.pose.is_valid() {
            return Reply::Refused(Refusal::Core(Error::Pose));
        }
        (self.begin, self.received, self.state) = (Some(*begin), 0, State::Receiving);
        self.status()
    }

    /// Takes a batch of points.
    pub fn take(&mut self, first: u32, batch: &[u8], memory: &mut [Packed]) -> Reply<'d> {
        let Some(begin) = self.begin else { return Reply::Refused(Refusal::NoScan) };
        let points = from_bytes(batch);
        let end = u32::try_from(points.len()).ok().and_then(|n| first.checked_add(n));
        if !batch.len().is_multiple_of(POINT_BYTES) {
            return Reply::Refused(Refusal::BadRequest);
        }
        if first != self.received {
            return Reply::Refused(Refusal::WrongPlace { received: self.received });
        }
        let Some(end) = end.filter(|&end| end <= begin.points) else {
            return Reply::Refused(Refusal::TooManyPoints { limit: begin.points });
        };
        let places = memory.get_mut(first as usize..).unwrap_or(&mut []);
        for (place, point) in places.iter_mut().zip(points) {
            *place = point;
        }
        self.received = end;
        self.status()
    }

    /// The scan to fit, when all of it is there.
    pub fn ready(&self) -> Result<Begin, Refusal> {
        let begin = self.begin.ok_or(Refusal::NoScan)?;
        if self.received == begin.points {
            return Ok(begin);
        }
        Err(Refusal::PointsMissing { received: self.received, announced: begin.points })
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
