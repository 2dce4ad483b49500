//! What has arrived of a scan: its points, or the pixels that become its points.

use super::message::{Begin, BeginDepth, PIXEL_BYTES, Request};
use super::refusal::Refusal;
use crate::cloud::{Cloud, POINT_BYTES, Packed, from_bytes};
use crate::curve::along_curve;
use crate::depth::{Camera, Frame, Rows};
use crate::error::Error;

/// Memory for what arrives.
#[derive(Debug)]
pub(super) struct Room<'m> {
    /// The scan's points.
    pub points: &'m mut [Packed],
    /// The last rows of a depth image.
    pub rows: &'m mut [u16],
}

/// A scan that has been announced.
#[derive(Clone, Copy, Debug)]
pub(super) struct Intake {
    begin: Begin,
    /// How pixels become points, if they do.
    frame: Option<Frame>,
    /// Points or pixels.
    received: u32,
    /// Points that are there.
    points: usize,
}

impl Intake {
    /// A scan of points, for a device that takes `most` of them.
    pub fn of_points(begin: &Begin, most: u32) -> Result<Self, Refusal> {
        if begin.points > most {
            return Err(Refusal::TooManyPoints { limit: most });
        }
        Cloud::new(&[], begin.step).map_err(Refusal::Core)?;
        if !begin.pose.is_valid() {
            return Err(Refusal::Core(Error::Pose));
        }
        Ok(Self { begin: *begin, frame: None, received: 0, points: 0 })
    }

    /// A scan of pixels, for a device that keeps `kept` of them.
    pub fn of_pixels(
        BeginDepth { begin, frame }: &BeginDepth,
        most: u32,
        kept: u32,
    ) -> Result<Self, Refusal> {
        if kept == 0 {
            return Err(Refusal::Unsupported);
        }
        frame.check().map_err(Refusal::Core)?;
        let needed = u32::try_from(frame.required()).unwrap_or(u32::MAX);
        if needed > kept {
            return Err(Refusal::ImageTooWide { limit: kept, needed });
        }
        Ok(Self { frame: Some(*frame), ..Self::of_points(begin, most)? })
    }

    /// Number and size of the scan.
    pub fn announced(&self) -> (u32, u32) {
        (self.begin.scan, self.frame.map_or(self.begin.points, |frame| frame.camera.pixels()))
    }

    /// Points or pixels received.
    pub const fn received(&self) -> u32 {
        self.received
    }

    /// Points that are there.
    pub const fn points(&self) -> usize {
        self.points
    }

    /// Takes points or pixels.
    pub fn take(&mut self, request: &Request<'_>, room: &mut Room<'_>) -> Result<(), Refusal> {
        match (request, self.frame) {
            (&Request::Points { first, batch }, None) => self.take_points(first, batch, room.points),
            (&Request::DepthRows { row, column, pixels }, Some(frame)) => {
                self.take_pixels(frame, (row, column), pixels, room)
            }
            _ => Err(Refusal::WrongKind),
        }
    }

    fn take_points(&mut self, first: u32, batch: &[u8], memory: &mut [Packed]) -> Result<(), Refusal> {
        let points = from_bytes(batch);
        let end = u32::try_from(points.len()).ok().and_then(|n| first.checked_add(n));
        if !batch.len().is_multiple_of(POINT_BYTES) {
            return Err(Refusal::BrokenBatch);
        }
        if first != self.received {
            return Err(Refusal::WrongPlace { received: self.received });
        }
        let limit = self.begin.points;
        let end = end.filter(|&end| end <= limit).ok_or(Refusal::TooManyPoints { limit })?;
        let places = memory.get_mut(first as usize..).unwrap_or(&mut []);
        for (place, point) in places.iter_mut().zip(points) {
            *place = point;
        }
        (self.received, self.points) = (end, end as usize);
        Ok(())
    }

    fn take_pixels(
        &mut self,
        frame: Frame,
        (row, column): (u16, u16),
        bytes: &[u8],
        room: &mut Room<'_>,
    ) -> Result<(), Refusal> {
        let (pixels, rest) = bytes.as_chunks::<PIXEL_BYTES>();
        if !rest.is_empty() {
            return Err(Refusal::BrokenBatch);
        }
        let Camera { width, height, .. } = frame.camera;
        let first = frame.camera.number(column, row);
        if row >= height || column >= width || first < self.received {
            let (row, column) = self.next_pixel(&frame);
            return Err(Refusal::WrongRow { row, column });
        }
        if pixels.len() > usize::from(width.saturating_sub(column)) {
            return Err(Refusal::RowTooLong { width });
        }
        let mut rows = Rows::new(frame, self.begin.step, room.rows).map_err(Refusal::Core)?;
        let limit = self.begin.points;
        let places = room.points.get_mut(self.points..limit as usize).unwrap_or(&mut []);
        let values = pixels.iter().map(|pixel| u16::from_le_bytes(*pixel));
        let made = rows
            .take(self.received, (column, row), values, places)
            .ok_or(Refusal::TooManyPoints { limit })?;
        self.points = self.points.saturating_add(made);
        self.received = first.saturating_add(pixels.len() as u32);
        if self.received == frame.camera.pixels() {
            along_curve(room.points.get_mut(..self.points).unwrap_or(&mut []));
        }
        Ok(())
    }

    /// Row and column of the next pixel.
    fn next_pixel(&self, frame: &Frame) -> (u16, u16) {
        let width = u32::from(frame.camera.width);
        let [row, column] = [self.received.checked_div(width), self.received.checked_rem(width)]
            .map(Option::unwrap_or_default);
        (row as u16, column as u16)
    }

    /// The scan to fit, when all of it is there.
    pub fn ready(&self) -> Result<Begin, Refusal> {
        let (received, (_, announced)) = (self.received, self.announced());
        match self.frame {
            _ if received == announced => Ok(self.begin),
            None => Err(Refusal::PointsMissing { received, announced }),
            Some(frame) => {
                let (received, _) = self.next_pixel(&frame);
                Err(Refusal::RowsMissing { received, announced: frame.camera.height })
            }
        }
    }
}
