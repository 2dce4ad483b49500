//! A scan as it is sent, and a device's results as the host's own.

use super::Results;
use crate::complete::Start;
use crate::complete::depth_rows::Depth;
use crate::fit::{Buffers, Digests, Fit, global_distances};
use lacuna::cloud::Packed;
use lacuna::digest::Digest;
use lacuna::wire::message::{Begin, BeginDepth, Iterations, MAX_BATCH, MAX_PIXELS, Request};
use lacuna::{Error, Fixed, Model, Sizes};

/// A scan to be completed by a device.
#[derive(Clone, Debug)]
pub struct Scan {
    /// Its announcement.
    pub begin: Begin,
    /// Its points.
    pub points: Vec<Packed>,
    /// The depth image that is sent in place of the points, and that the device makes them of.
    pub depth: Option<Depth>,
    /// Points or pixels in a message, at most [`MAX_BATCH`] or [`MAX_PIXELS`].
    pub batch: usize,
}

impl Scan {
    /// A scan in a pose, numbered by what it holds.
    pub fn new(start: &Start, iterations: Iterations) -> Self {
        let packed = start.packed();
        let begin = Begin {
            scan: 0,
            points: packed.points.len() as u32,
            step: packed.step,
            pose: start.thinned.rough.pose,
            hint: start.known.hint,
            iterations,
        };
        let depth = start.depth.as_ref().map(|scan| scan.image.clone());
        let mut number = Digest::new();
        number.add(&postcard::to_allocvec(&begin).unwrap_or_default());
        packed.points.iter().flatten().for_each(|value| number.add(&value.to_le_bytes()));
        if let Some(Depth { frame, pixels }) = &depth {
            number.add(&postcard::to_allocvec(frame).unwrap_or_default());
            pixels.iter().for_each(|value| number.add(&value.to_le_bytes()));
        }
        let begin = Begin { scan: number.value(), ..begin };
        let batch = if depth.is_some() { MAX_PIXELS } else { MAX_BATCH };
        Self { begin, points: packed.points, depth, batch }
    }

    /// What announces it.
    pub fn announcement(&self) -> Request<'static> {
        match &self.depth {
            None => Request::Begin(self.begin),
            Some(depth) => Request::BeginDepth(BeginDepth { begin: self.begin, frame: depth.frame }),
        }
    }

    /// Number and size, as a device that holds it says them.
    pub fn announced(&self) -> (u32, u32) {
        let size = self.depth.as_ref().map_or(self.begin.points, |depth| depth.frame.camera.pixels());
        (self.begin.scan, size)
    }

    /// The points that follow what was received.
    pub fn points_after(&self, received: u32) -> Vec<u8> {
        let points = self.points.iter().skip(received as usize).take(self.batch.clamp(1, MAX_BATCH));
        points.flatten().flat_map(|value| value.to_le_bytes()).collect()
    }
}

impl Depth {
    /// The measured pixels of a row that follow what was received, at most `batch`, or the last pixel of the image:
    /// their row, column and bytes.
    pub fn pixels_after(&self, received: u32, batch: usize) -> (u16, u16, Vec<u8>) {
        let last = self.pixels.len().saturating_sub(1);
        let measured = self.pixels.iter().enumerate().skip(received as usize).find(|(_, value)| **value > 0);
        let first = measured.map_or(last, |(first, _)| first);
        let width = usize::from(self.frame.camera.width);
        let (row, column) = (first / width, first % width);
        let rest: Vec<u16> = self
            .pixels
            .iter()
            .skip(first)
            .take((width - column).min(batch.clamp(1, MAX_PIXELS)))
            .copied()
            .collect();
        let length = rest.iter().rposition(|value| *value > 0).map_or(1, |last| last + 1);
        let bytes = rest.iter().take(length).flat_map(|value| value.to_le_bytes()).collect();
        (row as u16, column as u16, bytes)
    }
}

impl Results {
    /// The results as if the fit had run here. The hull's targets stay on the device.
    ///
    /// # Errors
    /// A model that the iterations do not go with.
    pub fn into_fit(self, model: &Model<'_>, begin: &Begin) -> Result<Fit, Error> {
        let schedule = begin.settings(model).schedule;
        let sizes = Sizes::required(model, &schedule)?;
        let mut buffers = Buffers::<Fixed>::new(&sizes);
        let digests = Digests::of(&self.outcome, &self.distances);
        Ok(Fit {
            outcome: self.outcome,
            shape: self.shape,
            targets: vec![],
            global_distances: global_distances(model, &self.global, schedule, &mut buffers)?,
            global: self.global,
            local_distances: self.distances,
            digests,
            buffer_bytes: sizes.bytes::<Fixed>(),
        })
    }
}
