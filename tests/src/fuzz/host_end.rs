//! The host's end of the wire against a device that answers anything: an error or results, in bounded time.

use super::device::{Raw, framed};
use super::source::Source;
use super::tiny::tiny;
use lacuna::Error;
use lacuna::completion::{Outcome, Stage};
use lacuna::wire::Refusal;
use lacuna::wire::frame::{Event, Header, Receiver};
use lacuna::wire::message::{Counters, Reply, Request, State, Status, VERSION};
use lacuna_host::device::{Client, Link, Timing, run as complete};
use std::collections::VecDeque;
use std::io;
use std::time::Duration;

/// Lets a client ask for what the device is and for a completion; the input answers.
pub fn run(bytes: &[u8]) {
    let timing = Timing {
        reply: Duration::from_secs(600),
        pause: Duration::ZERO,
        attempts: 2,
        standstill: Duration::from_secs(600),
    };
    let mut client = Client::new(Answers::new(bytes), timing);
    let _ = client.hello();
    let _ = client.info().map(|info| info.machine.len());
    let model = tiny().model();
    let mut fetched = 0;
    match complete(&mut client, &model, &tiny().scan, &mut |_| fetched += 1) {
        Ok(results) => {
            assert_eq!(results.distances.len(), model.voxels());
            assert!(fetched > 0, "nobody heard of the distances that came");
            let voxels = results.into_fit(&model, &tiny().scan.begin).map(|fit| fit.local_distances.len());
            assert!(voxels.is_ok_and(|voxels| voxels == model.voxels()));
        }
        Err(error) => assert!(error.to_string().len() > 10),
    }
}

/// A good conversation, refusals, noise.
pub fn seeds() -> Vec<Vec<u8>> {
    let voxels = tiny().model().voxels();
    let received = tiny().scan.points.len() as u16;
    let [low, high] = received.to_le_bytes();
    let weights = [6, 0, 4, 0, 0, 0, 0, 0, 0, 6, 16, 16, 0, 0, 0, 0, 0, 0];
    let distances: Vec<u8> = (0..voxels.div_ceil(240))
        .flat_map(|part| {
            let [a, b] = ((part * 240) as u16).to_le_bytes();
            [&[6, 240, a, b][..], &[1; 240]].concat()
        })
        .collect();
    let mut good =
        vec![2, 0, 3, 0, 4, 0, 0, 0, 4, 1, 0, 0, 4, 1, low, high, 4, 2, low, high, 4, 3, low, high];
    good.extend([5, 0]);
    good.extend(weights);
    good.extend(&distances);
    good.extend([8, 0]);
    vec![
        good,
        vec![2, 0, 7, 0, 7, 3, 7, 4, 7, 9, 2, 0, 7, 3, 2, 0],
        [&[0, 60][..], &[0; 30], &[9; 30], &[1, 9, 3, 1, 2, 3, 4, 5, 6, 7, 8]].concat(),
        vec![2, 0, 4, 4, low, high, 4, 1, 0, 0, 4, 2, low, high, 4, 4, low, high],
    ]
}

/// A device that answers from the input.
struct Answers<'a> {
    source: Source<'a>,
    receiver: Receiver,
    /// Header of the last request.
    asked: Header,
    coming: VecDeque<u8>,
}

impl<'a> Answers<'a> {
    fn new(bytes: &'a [u8]) -> Self {
        Self {
            source: Source(bytes),
            receiver: Receiver::new(),
            asked: Header::default(),
            coming: VecDeque::new(),
        }
    }

    fn answer(&mut self) -> Vec<u8> {
        let (kind, length) = (self.source.byte() % 9, self.source.byte());
        let begin = tiny().scan.begin;
        let reply = match kind {
            0 => return self.source.bytes(length.into()).to_vec(),
            1 => return framed(self.asked, &Raw(self.source.bytes(length.into()))),
            2 => Reply::Hello { version: VERSION.wrapping_add(length.into()) },
            4 => Reply::Status(Status {
                state: state(length),
                scan: if length & 16 == 0 { begin.scan } else { 0 },
                received: self.source.short().into(),
                announced: begin.points,
            }),
            5 => Reply::Outcome(outcome(length)),
            6 => {
                let first = self.source.short().into();
                Reply::Data { first, bytes: self.source.bytes(length.into()) }
            }
            7 => Reply::Refused(refusal(length)),
            8 => Reply::Counters(Counters::default()),
            _ => Reply::Info(info()),
        };
        framed(self.asked, &reply)
    }
}

fn state(number: u8) -> State {
    match number % 5 {
        0 => State::Idle,
        1 => State::Receiving,
        2 => State::Fitting { stage: Stage::Hull, done: number.into(), total: 3 },
        3 => State::Done,
        _ => State::Failed(Error::EmptyHull),
    }
}

fn refusal(number: u8) -> Refusal {
    let value = number.into();
    match number % 11 {
        0 => Refusal::Damaged,
        1 => Refusal::BadRequest,
        2 => Refusal::UnknownVersion { spoken: value as u16 },
        3 => Refusal::WrongSession { current: value },
        4 => Refusal::OutOfOrder { expected: value },
        5 => Refusal::Busy,
        6 => Refusal::OutOfRange { limit: value },
        7 => Refusal::PointsMissing { received: value, announced: 1 },
        8 => Refusal::NoResult,
        9 => Refusal::BrokenBatch,
        _ => Refusal::Core(Error::Pose),
    }
}

fn outcome(number: u8) -> Outcome {
    Outcome {
        pose: tiny().scan.begin.pose,
        agreement: Default::default(),
        inliers: number.into(),
        clutter: 0,
        hull_voxels: 0,
        digests: Default::default(),
    }
}

fn info() -> lacuna::wire::message::Info<'static> {
    lacuna::wire::message::Info {
        machine: "fuzz",
        core: "0",
        max_points: 0,
        ram: 0,
        flash: 0,
        max_message: 0,
        model: Err(Error::Damaged),
    }
}

impl Link for Answers<'_> {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        for &byte in bytes {
            if self.receiver.push(byte) == Event::Frame
                && let Some((header, Some(_))) = self.receiver.message::<Request<'_>>()
            {
                self.asked = header;
            }
        }
        Ok(())
    }

    fn receive(&mut self, bytes: &mut [u8], _: Duration) -> io::Result<usize> {
        while self.coming.is_empty() && !self.source.is_empty() {
            let answer = self.answer();
            self.coming.extend(answer);
        }
        let count = self.coming.len().min(bytes.len());
        bytes.iter_mut().zip(self.coming.drain(..count)).for_each(|(to, from)| *to = from);
        Ok(count)
    }
}
