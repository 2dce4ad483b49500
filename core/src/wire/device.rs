//! The device's end: completes scans that come over a line, in lent memory.
//!
//! [`serve`] is all a firmware calls. Between two bounded pieces of a fit it looks at the line, so that status
//! and cancel are answered while it works.

use super::desk::Desk;
use super::frame::MAX_MESSAGE;
use super::intake::Room;
use super::line::{Line, LineBuffers, Patience};
use super::message::{Begin, Identity, Info, Iterations, MAX_DATA, Reply, Request, VERSION};
use super::refusal::Refusal;
use super::results::Results;
use crate::arithmetic::Fixed;
use crate::brick::MAX_BRICK_VOXELS;
use crate::cloud::{Cloud, Packed};
use crate::completion::Completion;
use crate::error::Error;
use crate::memory::Memory;
use crate::model::Model;
use crate::sizes::Sizes;

pub use super::line::{Ended, MOST_FAILURES, Port};

/// Most bytes of names on the line.
const NAME: usize = 64;

/// What a firmware lends.
#[derive(Debug)]
pub struct Device<'a> {
    /// The machine's name; its first 64 bytes are told to the host.
    pub machine: &'a str,
    /// The model file.
    pub model: &'a [u8],
    /// Room for a scan: as many points as the device accepts.
    pub points: &'a mut [Packed],
    /// Room for the last rows of a depth image, [`Frame::required`](crate::depth::Frame::required) pixels; a device
    /// without any takes points only.
    pub rows: &'a mut [u16],
    /// Memory of the completion; see [`Sizes::required`](crate::Sizes::required).
    pub memory: Memory<'a, Fixed>,
}

/// Memory of the protocol, for a `static`: 5,148 bytes on a 32-bit processor.
#[derive(Debug)]
pub struct Buffers {
    line: LineBuffers,
    /// Bytes of a reply's data.
    data: [u8; MAX_DATA],
    /// Distances of a brick.
    brick: [i16; MAX_BRICK_VOXELS],
}

impl Device<'_> {
    /// Bytes lent to points, rows, completion and protocol.
    fn bytes(&self) -> usize {
        let scan = size_of_val(&*self.points).saturating_add(size_of_val(&*self.rows));
        scan.saturating_add(self.memory.bytes()).saturating_add(size_of::<Buffers>())
    }
}

impl Buffers {
    /// Empty buffers.
    pub const fn new() -> Self {
        Self { line: LineBuffers::new(), data: [0; MAX_DATA], brick: [0; MAX_BRICK_VOXELS] }
    }
}

impl Default for Buffers {
    fn default() -> Self {
        Self::new()
    }
}

/// Answers the line until it ends or fails. Calling it again is a reset: session and scan are forgotten.
///
/// A model that is refused is told to the host, with the reason, and so is memory that is too small for it. `counter` is
/// what the machine has executed so far, which the host is told stage by stage: instructions, cycles or ticks, across the
/// whole u64; `|| 0` on a machine that does not count.
pub fn serve<P: Port>(
    port: &mut P,
    mut device: Device<'_>,
    counter: impl FnMut() -> u64,
    buffers: &mut Buffers,
) -> Ended<P::Error> {
    let Buffers { line, data, brick } = buffers;
    let mut line = Line::new(port, line);
    let model = Model::from_bytes(device.model).and_then(|model| {
        let schedule = Iterations::Varying.schedule(&model);
        Sizes::required(&model, &schedule)?.check(&device.memory)?;
        Ok(model)
    });
    let info = info(&device, &model);
    let ended = match &model {
        Ok(model) => {
            let desk = Desk::new(info, device.rows.len());
            work(&mut line, desk, model, &mut device, counter, (data, brick))
        }
        Err(error) => decline(&mut line, &info, *error),
    };
    match ended {
        Ok(never) => match never {},
        Err(ended) => ended,
    }
}

/// What an endless loop returns.
enum Never {}

/// Answers everything but hello and info with the reason why the model is refused.
fn decline<P: Port>(line: &mut Line<'_, P>, info: &Info<'_>, error: Error) -> Result<Never, Ended<P::Error>> {
    loop {
        let reply = match line.receive(Patience::Wait)? {
            None => continue,
            Some(Request::Hello { .. }) => Reply::Hello { version: VERSION },
            Some(Request::Info) => Reply::Info(*info),
            Some(_) => Reply::Refused(Refusal::Core(error)),
        };
        line.answer(&reply)?;
    }
}

/// Receives a scan, fits it, answers questions about the results; again and again.
fn work<P: Port>(
    line: &mut Line<'_, P>,
    mut desk: Desk<'_>,
    model: &Model<'_>,
    device: &mut Device<'_>,
    mut counter: impl FnMut() -> u64,
    (data, brick): (&mut [u8; MAX_DATA], &mut [i16; MAX_BRICK_VOXELS]),
) -> Result<Never, Ended<P::Error>> {
    loop {
        let room = Room { points: &mut *device.points, rows: &mut *device.rows };
        let begin = receive(line, &mut desk, room)?;
        let points = device.points.get(..desk.points()).unwrap_or(&[]);
        match job(model, points, &begin, device.memory.reborrow()) {
            Ok(job) => fit(line, &mut desk, Results::new(model, job, data, brick), &mut counter)?,
            Err(error) => line.answer(&Reply::Refused(Refusal::Core(error)))?,
        }
    }
}

/// Takes points or pixels until a fit is asked for, whose answer is then owed.
fn receive<P: Port>(
    line: &mut Line<'_, P>,
    desk: &mut Desk<'_>,
    mut room: Room<'_>,
) -> Result<Begin, Ended<P::Error>> {
    loop {
        let reply = match line.receive(Patience::Wait)? {
            None => continue,
            Some(request @ (Request::Points { .. } | Request::DepthRows { .. })) => {
                desk.take(&request, &mut room)
            }
            Some(Request::Fit) => match desk.ready() {
                Ok(begin) => return Ok(begin),
                Err(refusal) => Reply::Refused(refusal),
            },
            Some(request) => desk.reply(&request),
        };
        line.answer(&reply)?;
    }
}

fn job<'b>(
    model: &'b Model<'b>,
    points: &'b [Packed],
    begin: &Begin,
    memory: Memory<'b, Fixed>,
) -> Result<Completion<'b, Fixed>, Error> {
    let cloud = Cloud::new(points, begin.step)?;
    Completion::new(model, cloud, begin.pose, begin.settings(model), memory)
}

/// Runs a job and answers from its results until its scan is given up, or it fails: then `Fit` begins another one.
fn fit<P: Port>(
    line: &mut Line<'_, P>,
    desk: &mut Desk<'_>,
    mut results: Results<'_>,
    counter: &mut impl FnMut() -> u64,
) -> Result<(), Ended<P::Error>> {
    desk.start();
    line.answer(&desk.status())?;
    loop {
        desk.step(&mut results.job, &mut *counter);
        if !desk.has_job() {
            return Ok(());
        }
        let patience = if desk.is_fitting() { Patience::Glance } else { Patience::Wait };
        let Some(request) = line.receive(patience)? else { continue };
        let reply = match request {
            Request::Points { .. } | Request::DepthRows { .. } => Reply::Refused(Refusal::Busy),
            Request::Fit => desk.status(),
            Request::Outcome if desk.is_done() => results.outcome(),
            Request::Weights { of, first } if desk.is_done() => results.weights(of, first),
            Request::Distances { first } if desk.is_done() => {
                let before = counter();
                let reply = results.distances(first);
                desk.count_distances(counter().wrapping_sub(before));
                reply
            }
            request => desk.reply(&request),
        };
        line.answer(&reply)?;
    }
}

fn info<'i>(device: &Device<'i>, model: &Result<Model<'i>, Error>) -> Info<'i> {
    let [points, ram] = [device.points.len(), device.bytes()].map(|n| u32::try_from(n).unwrap_or(u32::MAX));
    Info {
        machine: start_of(device.machine),
        core: env!("CARGO_PKG_VERSION"),
        max_points: points,
        ram,
        flash: u32::try_from(device.model.len()).unwrap_or(u32::MAX),
        max_message: MAX_MESSAGE as u16,
        model: model.as_ref().map(identity).map_err(|&error| error),
    }
}

fn identity<'i>(model: &Model<'i>) -> Identity<'i> {
    let header = model.header();
    Identity {
        class: start_of(header.class),
        checksum: model.checksum(),
        modes: header.modes,
        spacing: header.spacing,
        unit: header.unit,
        voxels: header.voxels,
    }
}

/// As many whole characters as fit into [`NAME`] bytes.
fn start_of(name: &str) -> &str {
    let end = (0..=NAME).rev().find(|&end| name.is_char_boundary(end)).unwrap_or(0);
    name.get(..end).unwrap_or("")
}
