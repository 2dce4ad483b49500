//! The device's end of the wire: any bytes and any messages, then a fresh scan, which must succeed.

use super::source::Source;
use super::tiny::{Tiny, tiny};
use crate::device_memory::DeviceMemory;
use embedded_io::{ErrorKind, ErrorType, Read, ReadReady, Write};
use lacuna::completion::Digests;
use lacuna::depth::{Camera, Frame};
use lacuna::wire::device::Ended;
use lacuna::wire::frame::{Event, Header, Receiver};
use lacuna::wire::message::{
    Begin, BeginDepth, Hint, Iterations, MAX_BATCH, Reply, Request, VERSION, Vector,
};
use serde::Serialize;
use serde::ser::SerializeTuple;
use std::cell::RefCell;
use std::collections::VecDeque;
use std::sync::OnceLock;

/// Sends the input's bytes and messages, then a scan; its digests must be those of a device that never heard
/// anything else.
pub fn run(bytes: &[u8]) {
    let expected = *clean();
    assert_eq!(digests_after(conversation(bytes)), expected);
}

/// Noise, a whole conversation, wrong fields, a fit under way.
pub fn seeds() -> Vec<Vec<u8>> {
    let batches: Vec<u8> = (0..6).flat_map(|batch| [3, 5, batch, 3, 13, 0]).collect();
    let results = [3, 7, 0, 3, 8, 0, 3, 9, 0, 3, 10, 1, 3, 10, 2, 3, 11, 0, 3, 12, 0];
    vec![
        [&[0, 40][..], &[0, 9, 1, 0, 255], &[7; 35]].concat(),
        [&[3, 0, 1, 3, 2, 0][..], &batches, &[3, 6, 0], &results].concat(),
        [&[3, 0, 1, 3, 3, 40][..], &batches, &[3, 6, 0, 3, 7, 0, 3, 14, 0], &results].concat(),
        [&[3, 0, 1, 1, 3, 2, 5, 1, 2, 1, 9, 1, 2, 3, 4, 5, 6, 7, 8, 9][..], &batches].concat(),
    ]
}

/// What a fresh device computes.
fn clean() -> &'static Option<Digests> {
    static CLEAN: OnceLock<Option<Digests>> = OnceLock::new();
    CLEAN.get_or_init(|| {
        let digests = digests_after(vec![]);
        assert!(digests.is_some(), "a fresh device completes the scan");
        digests
    })
}

/// Digests of the scan that follows some bytes.
fn digests_after(rubbish: Vec<u8>) -> Option<Digests> {
    thread_local! {
        static MEMORY: RefCell<DeviceMemory> = RefCell::new(DeviceMemory::new(&tiny().file, 1000));
    }
    let mut line = Line::new(rubbish);
    let ended = MEMORY.with_borrow_mut(|memory| memory.serve(&mut line, &tiny().file));
    assert_eq!(ended, Ended::Closed);
    line.found
}

/// A line with some bytes under way, whose host begins a scan when the device has dealt with them.
struct Line {
    coming: VecDeque<u8>,
    script: VecDeque<Vec<u8>>,
    receiver: Receiver,
    found: Option<Digests>,
}

impl Line {
    fn new(rubbish: Vec<u8>) -> Self {
        Self { coming: rubbish.into(), script: fresh_scan(tiny()), receiver: Receiver::new(), found: None }
    }
}

impl ErrorType for Line {
    type Error = ErrorKind;
}

impl Read for Line {
    fn read(&mut self, bytes: &mut [u8]) -> Result<usize, ErrorKind> {
        if self.coming.is_empty() {
            self.coming.extend(self.script.pop_front().unwrap_or_default());
        }
        let count = self.coming.len().min(bytes.len());
        bytes.iter_mut().zip(self.coming.drain(..count)).for_each(|(to, from)| *to = from);
        Ok(count)
    }
}

impl ReadReady for Line {
    fn read_ready(&mut self) -> Result<bool, ErrorKind> {
        Ok(!self.coming.is_empty())
    }
}

impl Write for Line {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, ErrorKind> {
        for &byte in bytes {
            if self.receiver.push(byte) != Event::Frame {
                continue;
            }
            match self.receiver.message::<Reply<'_>>() {
                Some((header, Some(Reply::Outcome(outcome)))) if header.session == SESSION + 1 => {
                    self.found = Some(outcome.digests);
                }
                Some((_, Some(_))) => {}
                other => panic!("the device sends what is no reply: {other:?}"),
            }
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> Result<(), ErrorKind> {
        Ok(())
    }
}

/// Number of the first of two sessions: the input may have opened one of them, but not both.
const SESSION: u32 = 0xfeed_0001;

fn fresh_scan(tiny: &Tiny) -> VecDeque<Vec<u8>> {
    let hello = Request::Hello { version: VERSION };
    let greet = |session| framed(Header { session, sequence: 0 }, &hello);
    // A zero first: it ends whatever frame the rubbish has left open.
    let mut script = VecDeque::from([vec![0], greet(SESSION), greet(SESSION + 1)]);
    let mut sequence = 0;
    let mut ask = |request: &Request<'_>| {
        sequence += 1;
        script.push_back(framed(Header { session: SESSION + 1, sequence }, request));
    };
    ask(&Request::Begin(Begin { hint: Hint::Exact, ..tiny.scan.begin }));
    for (number, points) in tiny.scan.points.chunks(MAX_BATCH).enumerate() {
        let batch: Vec<u8> = points.iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
        ask(&Request::Points { first: (number * MAX_BATCH) as u32, batch: &batch });
    }
    ask(&Request::Fit);
    ask(&Request::Outcome);
    script
}

/// Decodes an input: raw bytes, messages of raw bytes in and out of order, requests with fields of any value.
fn conversation(bytes: &[u8]) -> Vec<u8> {
    let (mut source, mut line) = (Source(bytes), vec![]);
    let mut header = Header { session: 1, sequence: 0 };
    while !source.is_empty() {
        let what = source.byte() % 4;
        let length = source.byte();
        match what {
            0 => line.extend(source.bytes(length.into())),
            1 => {
                header.sequence = header.sequence.wrapping_add(1);
                line.extend(framed(header, &Raw(source.bytes(length.into()))));
            }
            2 => {
                header = Header { session: source.word(), sequence: source.word() };
                line.extend(framed(header, &Raw(source.bytes(length.into()))));
            }
            _ => {
                header.sequence = header.sequence.wrapping_add(1);
                line.extend(request(&mut header, length, &mut source));
            }
        }
        if line.len() > 1 << 16 {
            break;
        }
    }
    line
}

/// A request by its number, with a byte of the input in its fields.
fn request(header: &mut Header, kind: u8, source: &mut Source<'_>) -> Vec<u8> {
    let tiny = tiny();
    let value = u32::from(source.byte());
    let points = tiny.scan.points.iter().skip(value as usize * MAX_BATCH).take(MAX_BATCH);
    let batch: Vec<u8> = points.flatten().flat_map(|v| v.to_le_bytes()).collect();
    let begin = tiny.scan.begin;
    let request = match kind % 16 {
        // Half of the numbers that stand for a hello.
        0 if kind >= 128 => depth_request(value, source),
        0 => {
            *header = Header { session: header.session.wrapping_add(value), sequence: 0 };
            Request::Hello { version: VERSION }
        }
        1 => Request::Info,
        2 => Request::Begin(Begin { scan: value, ..begin }),
        3 => Request::Begin(Begin { points: value, hint: Hint::Exact, ..begin }),
        4 => Request::Begin(Begin {
            step: source.float(),
            iterations: Iterations::Momentum,
            pose: lacuna::Pose { translation: std::array::from_fn(|_| source.float()), ..begin.pose },
            ..begin
        }),
        5 => Request::Points { first: value * MAX_BATCH as u32, batch: &batch },
        6 => Request::Fit,
        7 => Request::Outcome,
        8 => Request::Weights { of: Vector::Shape, first: value },
        9..=10 => Request::Weights { of: Vector::Global, first: value },
        11 => Request::Distances { first: value * 16 },
        12 => Request::Counters,
        13 => Request::Status,
        14 => Request::Cancel,
        _ => Request::Points { first: source.word(), batch: source.bytes(value as usize) },
    };
    framed(*header, &request)
}

/// A depth image that a few rows complete, or rows of it.
fn depth_request<'s>(value: u32, source: &mut Source<'s>) -> Request<'s> {
    let begin = tiny().scan.begin;
    let camera = Camera { width: 16, height: 6, fx: 20.0, fy: 20.0, cx: 8.0, cy: 3.0, unit: 0.5 };
    let frame = Frame { camera, jump: 50.0, reach: 1, stride: 1, view: begin.pose };
    match value % 4 {
        0 => Request::BeginDepth(BeginDepth { begin, frame }),
        1 => {
            let camera = Camera {
                width: source.word() as u16,
                height: source.word() as u16,
                fx: source.float(),
                cy: source.float(),
                unit: source.float(),
                ..camera
            };
            let (reach, stride) = (source.byte(), source.byte().into());
            let frame = Frame { camera, jump: source.float(), reach, stride, ..frame };
            Request::BeginDepth(BeginDepth { begin, frame })
        }
        2 => Request::DepthRows { row: source.byte().into(), column: 0, pixels: source.bytes(32) },
        _ => {
            let [row, column] = [source.byte().into(), source.byte().into()];
            Request::DepthRows { row, column, pixels: source.bytes(value as usize) }
        }
    }
}

/// A message of bytes as they are.
pub struct Raw<'a>(pub &'a [u8]);

impl Serialize for Raw<'_> {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut tuple = serializer.serialize_tuple(self.0.len())?;
        self.0.iter().try_for_each(|byte| tuple.serialize_element(byte))?;
        tuple.end()
    }
}

/// A frame, empty where the message is too long for one.
pub fn framed(header: Header, message: &impl Serialize) -> Vec<u8> {
    crate::framed::framed(header, message).unwrap_or_default()
}
