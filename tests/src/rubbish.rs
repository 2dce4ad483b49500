//! Frames as no host sends them: noise, truncated and repeated frames, requests out of order, wrong fields.

use crate::framed::framed;
use lacuna::Pose;
use lacuna::cloud::POINT_BYTES;
use lacuna::depth::{Camera, Frame};
use lacuna::wire::frame::Header;
use lacuna::wire::message::{
    Begin, BeginDepth, Hint, Iterations, MAX_BATCH, MAX_DATA, Request, VERSION, Vector,
};
use lacuna_host::device::Scan;
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Pixels in a row of a depth image.
const WIDTH: u16 = 20;
/// Bytes in it.
const ROW: usize = 2 * WIDTH as usize;

/// Makes such frames.
pub struct Rubbish<'s> {
    rng: ChaCha8Rng,
    session: u32,
    /// Where sensible points come from.
    scan: &'s Scan,
    /// Frames to be sent again, out of order.
    kept: Vec<Vec<u8>>,
}

impl<'s> Rubbish<'s> {
    /// Rubbish from a seed.
    pub fn new(scan: &'s Scan, seed: u64) -> Self {
        Self { rng: ChaCha8Rng::seed_from_u64(seed), session: 1, scan, kept: vec![] }
    }

    fn bytes(&mut self, most: usize) -> Vec<u8> {
        let mut bytes = vec![0; self.rng.random_range(0..=most)];
        self.rng.fill_bytes(&mut bytes);
        bytes
    }

    /// The next frame, or a few.
    pub fn some(&mut self) -> Vec<Vec<u8>> {
        match self.rng.random_range(0..12) {
            0 => vec![self.bytes(300)],
            1 => vec![self.bytes(3000).into_iter().filter(|&b| b != 0).collect()],
            2 => vec![self.whole(&())],
            3 => {
                let bytes = self.bytes(60);
                vec![self.whole(&bytes.as_slice())]
            }
            4 => {
                let mut frame = self.request(0);
                frame.truncate(self.rng.random_range(0..=frame.len()));
                vec![frame]
            }
            5 | 6 if !self.kept.is_empty() => {
                let at = self.rng.random_range(0..self.kept.len());
                vec![self.kept[at].clone()]
            }
            7 => {
                let sequence = self.rng.next_u32();
                vec![self.request(sequence)]
            }
            _ => self.conversation(),
        }
    }

    fn whole(&mut self, message: &impl serde::Serialize) -> Vec<u8> {
        let header = Header { session: self.session, sequence: self.rng.random_range(0..9) };
        framed(header, message).expect("short enough")
    }

    fn asked(&self, sequence: u32, request: &Request<'_>) -> Vec<u8> {
        framed(Header { session: self.session, sequence }, request).expect("short enough")
    }

    /// A session that begins well and goes on anyhow.
    fn conversation(&mut self) -> Vec<Vec<u8>> {
        self.session = self.session.wrapping_add(1).max(1);
        let hello = self.asked(0, &Request::Hello { version: VERSION });
        let requests = self.rng.random_range(0..12);
        let frames: Vec<_> =
            std::iter::once(hello).chain((1..=requests).map(|sequence| self.request(sequence))).collect();
        self.kept.extend_from_slice(&frames);
        let over = self.kept.len().saturating_sub(64);
        self.kept.drain(..over);
        frames
    }

    fn request(&mut self, sequence: u32) -> Vec<u8> {
        let bytes = self.bytes(MAX_DATA);
        let points = self.scan.points.iter().flatten().flat_map(|v| v.to_le_bytes());
        let points: Vec<u8> = points.take(MAX_BATCH * POINT_BYTES).collect();
        let value =
            if self.rng.random_bool(0.5) { self.rng.random_range(0..100) } else { self.rng.next_u32() };
        let begin = self.begin(value);
        let batch = if self.rng.random_bool(0.3) { &bytes } else { &points };
        let request = match self.rng.random_range(0..18) {
            0 => Request::Hello { version: value as u16 },
            1 => Request::Info,
            2 | 3 => Request::Begin(begin),
            4 | 5 => Request::Points { first: if self.rng.random_bool(0.5) { 0 } else { value }, batch },
            6 | 14 | 15 => Request::Fit,
            7 => Request::Status,
            8 => Request::Outcome,
            9 => Request::Weights { of: [Vector::Shape, Vector::Global][value as usize % 2], first: value },
            10 => Request::Distances { first: value },
            11 => Request::Counters,
            12 => Request::Cancel,
            13 => Request::BeginDepth(self.begin_depth(begin)),
            _ => {
                let row = self.rng.random_range(0..8);
                let column = if self.rng.random_bool(0.8) { 0 } else { value as u16 };
                let most = if self.rng.random_bool(0.8) { ROW } else { bytes.len() };
                Request::DepthRows { row, column, pixels: bytes.get(..most).unwrap_or(&bytes) }
            }
        };
        self.asked(sequence, &request)
    }

    /// A depth image of a few rows, or one that is none.
    fn begin_depth(&mut self, begin: Begin) -> BeginDepth {
        let wild = f32::from_bits(self.rng.next_u32());
        let camera = Camera { width: WIDTH, height: 4, fx: 30.0, fy: 30.0, cx: 10.0, cy: 2.0, unit: 0.01 };
        let frame = Frame { camera, jump: 1e4, reach: 1, stride: 1, view: Pose::IDENTITY };
        let frame = match self.rng.random_range(0..10) {
            0 => Frame { camera: Camera { fx: wild, cy: wild, ..camera }, ..frame },
            1 => Frame { camera: Camera { width: self.rng.next_u32() as u16, ..camera }, ..frame },
            2 => Frame { jump: wild, view: Pose { scale: wild, ..frame.view }, ..frame },
            3 => Frame { reach: self.rng.next_u32() as u8, stride: self.rng.random_range(0..4), ..frame },
            _ => frame,
        };
        BeginDepth { begin, frame }
    }

    /// A scan that one batch may complete, or one that is none.
    fn begin(&mut self, value: u32) -> Begin {
        let points = if self.rng.random_bool(0.7) { MAX_BATCH as u32 } else { self.rng.random_range(0..100) };
        let begin = Begin { scan: value, points, ..self.scan.begin };
        match self.rng.random_range(0..10) {
            0 => Begin { step: f32::from_bits(self.rng.next_u32()), ..begin },
            1 => Begin { points: value, pose: Pose { scale: f32::from_bits(value), ..begin.pose }, ..begin },
            2 => Begin { pose: Pose { translation: [f32::from_bits(value); 3], ..begin.pose }, ..begin },
            3 => Begin { hint: Hint::Exact, iterations: Iterations::Momentum, ..begin },
            _ => begin,
        }
    }
}
