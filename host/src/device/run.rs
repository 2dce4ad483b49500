//! A scan's way through a device: begin, points, fit, results.
//!
//! What is done next follows from the status the device reports, never from what was sent before: after an
//! interruption of either end the same rules lead on from where the device is.

use super::{Client, Error, Link, Scan};
use lacuna::Model;
use lacuna::completion::{Outcome, Stage};
use lacuna::wire::Refusal;
use lacuna::wire::distances::unpack;
use lacuna::wire::message::{Counters, Reply, Request, State, Status, Vector};
use std::time::Instant;

/// Sessions lost before giving up.
const RESUMPTIONS: u32 = 16;

/// How far a scan has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Progress {
    /// Points or pixels sent, of all.
    Sending(u32, u32),
    /// Pieces of a stage done, of all.
    Fitting(Stage, u32, u32),
    /// Distances fetched, of all.
    Fetching(u32, u32),
}

/// What a device returns.
#[derive(Clone, Debug)]
pub struct Results {
    /// Pose, counts, digests.
    pub outcome: Outcome,
    /// Weights of the pose fit, standard deviations.
    pub shape: Vec<f32>,
    /// Global weights, standard deviations.
    pub global: Vec<f64>,
    /// Distances of the local fit, one a stored voxel, 1/256 voxel.
    pub distances: Vec<i16>,
    /// What the stages cost.
    pub counters: Counters,
}

/// Completes a scan on the device, whose model must be `model`.
///
/// # Errors
/// The device refuses the scan, or is lost.
pub fn run<L: Link>(
    client: &mut Client<L>,
    model: &Model<'_>,
    scan: &Scan,
    watch: &mut dyn FnMut(Progress),
) -> Result<Results, Error> {
    for _ in 0..RESUMPTIONS {
        match attempt(client, model, scan, watch) {
            Err(error) if error.is_lost_session() => client.hello()?,
            ended => return ended,
        }
    }
    Err(Error::Unsteady(RESUMPTIONS))
}

/// One session's part.
fn attempt<L: Link>(
    client: &mut Client<L>,
    model: &Model<'_>,
    scan: &Scan,
    watch: &mut dyn FnMut(Progress),
) -> Result<Results, Error> {
    let mut status = client.status(&Request::Status)?;
    let mut last = (status, Instant::now());
    loop {
        if status != last.0 {
            last = (status, Instant::now());
        } else if last.1.elapsed() > client.timing.standstill {
            return Err(Error::Standstill(client.timing.standstill));
        }
        status = match status.state {
            _ if (status.scan, status.announced) != scan.announced() => {
                client.status(&scan.announcement())?
            }
            State::Idle => client.status(&scan.announcement())?,
            State::Receiving if status.received < status.announced => {
                watch(Progress::Sending(status.received, status.announced));
                send(client, scan, &status)?
            }
            State::Receiving => client.status(&Request::Fit)?,
            State::Fitting { stage, done, total } => {
                watch(Progress::Fitting(stage, done, total));
                std::thread::sleep(client.timing.pause);
                client.status(&Request::Status)?
            }
            State::Failed(error) => return Err(Error::Refused(Refusal::Core(error))),
            State::Done => return fetch(client, model, watch),
        };
    }
}

/// Sends the next points or pixels.
fn send<L: Link>(client: &mut Client<L>, scan: &Scan, status: &Status) -> Result<Status, Error> {
    let first = status.received;
    if let Some(depth) = &scan.depth {
        let (row, column, pixels) = depth.pixels_after(first, scan.batch);
        return client.status(&Request::DepthRows { row, column, pixels: &pixels });
    }
    client.status(&Request::Points { first, batch: &scan.points_after(first) })
}

fn fetch<L: Link>(
    client: &mut Client<L>,
    model: &Model<'_>,
    watch: &mut dyn FnMut(Progress),
) -> Result<Results, Error> {
    let Reply::Outcome(outcome) = client.ask(&Request::Outcome)? else { return Err(Error::Unexpected) };
    let shape =
        weights(client, model, Vector::Shape)?.as_chunks().0.iter().map(|b| f32::from_le_bytes(*b)).collect();
    let global = weights(client, model, Vector::Global)?
        .as_chunks()
        .0
        .iter()
        .map(|b| f64::from_le_bytes(*b))
        .collect();
    let distances = distances(client, model, watch)?;
    let Reply::Counters(counters) = client.ask(&Request::Counters)? else { return Err(Error::Unexpected) };
    Ok(Results { outcome, shape, global, distances, counters })
}

/// All bytes of a weight vector.
fn weights<L: Link>(client: &mut Client<L>, model: &Model<'_>, of: Vector) -> Result<Vec<u8>, Error> {
    let size = match of {
        Vector::Shape => 4,
        Vector::Global => 8,
    };
    let most = size * model.modes();
    let mut all: Vec<u8> = vec![];
    loop {
        let first = (all.len() / size) as u32;
        match client.ask(&Request::Weights { of, first })? {
            Reply::Data { bytes: [], .. } => return Ok(all),
            Reply::Data { first: from, bytes } if from == first && all.len() + bytes.len() <= most => {
                all.extend(bytes);
            }
            _ => return Err(Error::Unexpected),
        }
    }
}

fn distances<L: Link>(
    client: &mut Client<L>,
    model: &Model<'_>,
    watch: &mut dyn FnMut(Progress),
) -> Result<Vec<i16>, Error> {
    let mut distances = vec![0; model.voxels()];
    let mut next = 0;
    while next < distances.len() {
        watch(Progress::Fetching(next as u32, distances.len() as u32));
        let first = next as u32;
        let Reply::Data { first: from, bytes } = client.ask(&Request::Distances { first })? else {
            return Err(Error::Unexpected);
        };
        let read = unpack(model, next, bytes, &mut distances).filter(|&read| read > 0 && from == first);
        next += read.ok_or(Error::Distances)?;
    }
    Ok(distances)
}
