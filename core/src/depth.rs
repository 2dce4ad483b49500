//! Depth frames: organised range images with pinhole intrinsics become packed points, pixel by pixel.
//!
//! Pixels come in order, row by row. A pixel's normal is that of its four neighbours r = [`Frame::reach`] pixels
//! away. The last of them to come is the one below, so pixel (u, v) makes the point of pixel (u, v - r), and takes
//! the place of pixel (u, v - 2r), which is needed no more: 2 r rows are kept, whatever the height. Pixels that are
//! left out on the way were not measured.
//!
//! The cloud is thinned as it comes: only every [`Frame::stride`]-th pixel of every so many rows becomes a point.
//! Points that do not fit into the integers of a [`Packed`] point are not part of the scan.

use crate::cloud::{Packed, check_step, pack};
use crate::error::{Buffer, Error, OptionName};
use crate::pose::{Pose, cross, dot, zip};
use core::ops::Range;
use serde::{Deserialize, Serialize};

/// A depth camera. A pixel (u, v), both from 0 at the centre of the first pixel, sees
/// `((u - cx) / fx · Z, (v - cy) / fy · Z, Z)` with Z = value · unit; value 0 is "not measured".
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Camera {
    /// Pixels in a row.
    pub width: u16,
    /// Rows.
    pub height: u16,
    /// Focal length along u, pixels.
    pub fx: f32,
    /// Focal length along v, pixels.
    pub fy: f32,
    /// Principal point along u, pixels; it may lie outside of the image.
    pub cx: f32,
    /// Principal point along v, pixels.
    pub cy: f32,
    /// Length of a grey level, in the camera's unit, more than 0.
    pub unit: f32,
}

/// How a depth image becomes a cloud.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Frame {
    /// What made the image.
    pub camera: Camera,
    /// Largest depth difference between neighbours of one surface, in the camera's unit, 0 at least.
    pub jump: f32,
    /// Distance r of the neighbours that make a normal, pixels; 1 at least.
    pub reach: u8,
    /// Every so many pixels and rows become points; 1 at least.
    pub stride: u16,
    /// From the camera to the scan, whose origin is near its points.
    pub view: Pose,
}

impl Camera {
    /// Whether all numbers are finite, sizes, focal lengths and unit positive.
    ///
    /// # Errors
    /// The number that is not.
    pub fn check(&self) -> Result<(), Error> {
        let positive = |value: f32| value.is_normal() && value > 0.0;
        let checks = [
            (self.width > 0 && self.height > 0, OptionName::ImageSize),
            (positive(self.fx) && positive(self.fy), OptionName::FocalLength),
            (self.cx.is_finite() && self.cy.is_finite(), OptionName::PrincipalPoint),
            (positive(self.unit), OptionName::DepthUnit),
        ];
        checks.into_iter().try_for_each(|(good, name)| if good { Ok(()) } else { Err(Error::Option(name)) })
    }

    /// Pixels of an image.
    pub fn pixels(&self) -> u32 {
        // 65535² is less than 2³².
        u32::from(self.width).wrapping_mul(u32::from(self.height))
    }

    /// A pixel's number, row by row from the first.
    pub fn number(&self, u: u16, v: u16) -> u32 {
        u32::from(v).wrapping_mul(u32::from(self.width)).wrapping_add(u32::from(u))
    }

    /// The point a pixel sees, in the camera's frame and unit; `None` where it measured nothing (value 0).
    pub fn point(&self, u: u16, v: u16, value: u16) -> Option<[f32; 3]> {
        let z = f32::from(value) * self.unit;
        let seen = [(f32::from(u) - self.cx) / self.fx * z, (f32::from(v) - self.cy) / self.fy * z, z];
        (value > 0).then_some(seen)
    }
}

impl Frame {
    /// Whether all numbers are in their ranges.
    ///
    /// # Errors
    /// The number that is not, or a view that is no similarity.
    pub fn check(&self) -> Result<(), Error> {
        self.camera.check()?;
        if !(self.jump.is_finite() && self.jump >= 0.0) {
            return Err(Error::Option(OptionName::DepthJump));
        }
        if self.reach == 0 || self.stride == 0 {
            return Err(Error::Option(OptionName::PixelStride));
        }
        if self.view.is_valid() { Ok(()) } else { Err(Error::Pose) }
    }

    /// Pixels of the 2 r rows that are kept: elements of the memory of [`Rows`].
    pub const fn required(&self) -> usize {
        2 * self.reach as usize * self.camera.width as usize
    }
}

/// The last rows of a depth image.
#[derive(Debug)]
pub struct Rows<'r> {
    frame: Frame,
    step: f32,
    /// A pixel is at its number modulo 2 r rows.
    values: &'r mut [u16],
}

impl<'r> Rows<'r> {
    /// Rows in lent memory of at least [`Frame::required`] pixels, for a cloud of `step` scan units. What the memory
    /// holds are the rows before the next pixel; at the first one it may be anything.
    ///
    /// # Errors
    /// A frame or a step out of range, or too little memory.
    pub fn new(frame: Frame, step: f32, values: &'r mut [u16]) -> Result<Self, Error> {
        frame.check()?;
        check_step(step)?;
        let size = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
        let (needed, given) = (size(frame.required()), size(values.len()));
        if given < needed {
            return Err(Error::BufferTooSmall { buffer: Buffer::DepthRows, needed, given });
        }
        Ok(Self { frame, step, values })
    }

    /// Takes the next pixels of row `v`, the first of them in column `u`; what is beyond the image is left out. The
    /// pixels from number `next` on, row by row from the first, were left out before them: they were not measured.
    ///
    /// # Returns
    /// How many points they made, in the first of `places`; `None`, and nothing taken, where those are too few.
    pub fn take(
        &mut self,
        next: u32,
        (u, v): (u16, u16),
        pixels: impl Iterator<Item = u16> + Clone,
        places: &mut [Packed],
    ) -> Option<usize> {
        if v >= self.frame.camera.height {
            return Some(0);
        }
        let left_out = next..self.frame.camera.number(u, v);
        let columns = u..self.frame.camera.width;
        let mut made = 0usize;
        for (u, below) in columns.clone().zip(pixels.clone()) {
            if let Some(point) = self.point(u, v, below, &left_out) {
                *places.get_mut(made)? = point;
                made = made.saturating_add(1);
            }
        }
        let kept = u32::try_from(self.frame.required()).unwrap_or(u32::MAX);
        let Range { start, end } = left_out;
        for number in start.max(end.saturating_sub(kept))..end {
            self.keep(number, 0);
        }
        for (u, value) in columns.zip(pixels) {
            self.keep(self.frame.camera.number(u, v), value);
        }
        Some(made)
    }

    /// Where a pixel is kept.
    fn place(&self, number: u32) -> usize {
        (number as usize).checked_rem(self.frame.required()).unwrap_or(0)
    }

    fn keep(&mut self, number: u32, value: u16) {
        let place = self.place(number);
        if let Some(place) = self.values.get_mut(place) {
            *place = value;
        }
    }

    /// The point that pixel (u, v), the lower neighbour, completes; none where a neighbour is missing or beyond a
    /// jump: there the surface ends.
    fn point(&self, u: u16, v: u16, below: u16, left_out: &Range<u32>) -> Option<Packed> {
        let Frame { camera, jump, stride, view, .. } = &self.frame;
        let reach = u16::from(self.frame.reach);
        let middle = v.checked_sub(reach)?;
        let (above, left, right) = (middle.checked_sub(reach)?, u.checked_sub(reach)?, u.checked_add(reach)?);
        if u.checked_rem(*stride)? != 0 || middle.checked_rem(*stride)? != 0 || right >= camera.width {
            return None;
        }
        let seen = |u: u16, v: u16| {
            let number = camera.number(u, v);
            let value = self.values.get(self.place(number)).filter(|_| !left_out.contains(&number))?;
            camera.point(u, v, *value)
        };
        let point = seen(u, middle)?;
        let [_, _, z] = point;
        let near = |point: Option<[f32; 3]>| point.filter(|&[_, _, depth]| (depth - z).abs() <= *jump);
        let across = difference(near(seen(right, middle))?, near(seen(left, middle))?);
        let down = difference(near(camera.point(u, v, below))?, near(seen(u, above))?);
        let normal = towards_camera(point, cross(down, across))?;
        packed(view.apply(point), view.rotate(normal), self.step)
    }
}

fn difference(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    zip(a, b, |p, q| p - q)
}

/// The normal of length one on the side of the camera.
fn towards_camera(point: [f32; 3], normal: [f32; 3]) -> Option<[f32; 3]> {
    let length = libm::sqrtf(dot(normal, normal));
    let length = if dot(normal, point) > 0.0 { -length } else { length };
    length.is_normal().then(|| normal.map(|c| c / length))
}

/// The point as integers, if they hold it.
fn packed(position: [f32; 3], normal: [f32; 3], step: f32) -> Option<Packed> {
    const MOST: f32 = 32_767.0;
    position.iter().all(|c| (c / step).abs() <= MOST).then(|| pack(position, normal, step))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::Cloud;

    const STEP: f32 = 0.01;

    fn frame() -> Frame {
        let camera = Camera { width: 5, height: 5, fx: 10.0, fy: 10.0, cx: 2.0, cy: 2.0, unit: 0.5 };
        let view = Pose { translation: [0.0, 0.0, -100.0], ..Pose::IDENTITY };
        Frame { camera, jump: 9.0, reach: 1, stride: 1, view }
    }

    /// The points of an image that comes whole rows at a time, and how many there are.
    fn points(frame: Frame, depth: &[u16]) -> ([Packed; 25], usize) {
        let (mut memory, mut points, mut count) = ([7; 20], [[0; 6]; 25], 0);
        let mut rows = Rows::new(frame, STEP, &mut memory).unwrap();
        for (v, row) in depth.chunks(5).enumerate() {
            let first = frame.camera.number(0, v as u16);
            count += rows.take(first, (0, v as u16), row.iter().copied(), &mut points[count..]).unwrap();
        }
        (points, count)
    }

    #[test]
    fn a_wall_faces_the_camera() {
        let (points, count) = points(frame(), &[200; 25]);
        assert_eq!(count, 9);
        let cloud = Cloud::new(&points, STEP).unwrap();
        assert_eq!(cloud.point(4), Some(([0.0; 3], [0.0, 0.0, -1.0])));
        assert_eq!(cloud.point(5), Some(([10.0, 0.0, 0.0], [0.0, 0.0, -1.0])));
    }

    #[test]
    fn missing_and_far_neighbours_end_the_surface() {
        for (value, left) in [(0, 4), (300, 4), (210, 9)] {
            let mut depth = [200; 25];
            depth[12] = value;
            assert_eq!(points(frame(), &depth).1, left, "{value}");
        }
    }

    #[test]
    fn every_so_many_pixels_become_points() {
        assert_eq!(points(Frame { stride: 2, ..frame() }, &[200; 25]).1, 1);
        assert_eq!(points(Frame { stride: 3, ..frame() }, &[200; 25]).1, 1);
        assert_eq!(points(Frame { reach: 2, ..frame() }, &[200; 25]).1, 1);
    }

    #[test]
    fn rows_beyond_the_image_make_no_points() {
        let (mut memory, mut places) = ([0; 20], [[0; 6]; 25]);
        let mut rows = Rows::new(frame(), STEP, &mut memory).unwrap();
        for v in 0..8 {
            let next = frame().camera.number(0, v.min(5));
            let made = rows.take(next, (0, v), [200; 5].into_iter(), &mut places).unwrap();
            assert_eq!(made, if (2..5).contains(&v) { 3 } else { 0 }, "row {v}");
        }
    }

    #[test]
    fn points_that_integers_do_not_hold_are_left_out() {
        let far = Pose { translation: [-320.0, 0.0, -100.0], ..Pose::IDENTITY };
        assert_eq!(points(Frame { view: far, ..frame() }, &[200; 25]).1, 6);
    }

    #[test]
    fn pixels_give_the_same_points_however_they_are_cut() {
        let depth: [u16; 25] = core::array::from_fn(|i| 190 + (i * i % 13) as u16);
        let whole = points(frame(), &depth);
        let (mut memory, mut found, mut count) = ([0; 10], [[0; 6]; 25], 0);
        let mut rows = Rows::new(frame(), STEP, &mut memory).unwrap();
        for (i, value) in depth.into_iter().enumerate() {
            let place = ((i % 5) as u16, (i / 5) as u16);
            count += rows.take(i as u32, place, core::iter::once(value), &mut found[count..]).unwrap();
        }
        assert_eq!((found, count), whole);
    }

    #[test]
    fn pixels_that_are_left_out_are_not_measured() {
        let mut depth: [u16; 25] = core::array::from_fn(|i| 190 + (i * i % 13) as u16);
        // None, some, most of the pixels before the last rows.
        for (next, end) in [(3, 3), (3, 4), (6, 9), (4, 15), (0, 13)] {
            depth[next..end].fill(0);
            let whole = points(frame(), &depth);
            let (mut memory, mut found, mut count) = ([7; 10], [[0; 6]; 25], 0);
            let mut rows = Rows::new(frame(), STEP, &mut memory).unwrap();
            for i in (0..25).filter(|i| !(next..end).contains(i)) {
                let number = if i == end { next } else { i } as u32;
                let place = ((i % 5) as u16, (i / 5) as u16);
                count += rows.take(number, place, core::iter::once(depth[i]), &mut found[count..]).unwrap();
            }
            assert_eq!((found, count), whole, "{next} to {end}");
        }
    }

    #[test]
    fn what_finds_no_room_is_not_taken_and_can_come_again() {
        let (mut memory, mut points) = ([0; 10], [[0; 6]; 3]);
        let mut rows = Rows::new(frame(), STEP, &mut memory).unwrap();
        let row = [200; 5];
        for v in 0..2 {
            assert_eq!(rows.take(5 * u32::from(v), (0, v), row.into_iter(), &mut []), Some(0));
        }
        assert_eq!(rows.take(10, (1, 2), row.into_iter(), &mut points[..2]), None);
        assert_eq!(rows.take(10, (0, 2), row.into_iter(), &mut points), Some(3));
    }

    #[test]
    fn numbers_out_of_range_are_refused_by_name() {
        let refused = |frame: Frame| Rows::new(frame, STEP, &mut [0; 10]).err();
        let camera = frame().camera;
        let cameras = [
            (Camera { width: 0, ..camera }, OptionName::ImageSize),
            (Camera { height: 0, ..camera }, OptionName::ImageSize),
            (Camera { fx: 0.0, ..camera }, OptionName::FocalLength),
            (Camera { fy: f32::NAN, ..camera }, OptionName::FocalLength),
            (Camera { cx: f32::NAN, ..camera }, OptionName::PrincipalPoint),
            (Camera { cy: f32::INFINITY, ..camera }, OptionName::PrincipalPoint),
            (Camera { unit: -1.0, ..camera }, OptionName::DepthUnit),
        ];
        for (camera, name) in cameras {
            assert_eq!(refused(Frame { camera, ..frame() }), Some(Error::Option(name)));
        }
        let jump = Frame { jump: f32::NAN, ..frame() };
        assert_eq!(refused(jump), Some(Error::Option(OptionName::DepthJump)));
        for bad in [Frame { reach: 0, ..frame() }, Frame { stride: 0, ..frame() }] {
            assert_eq!(refused(bad), Some(Error::Option(OptionName::PixelStride)));
        }
        let flat = Pose { scale: 0.0, ..Pose::IDENTITY };
        assert_eq!(refused(Frame { view: flat, ..frame() }), Some(Error::Pose));
        let buffer = Error::BufferTooSmall { buffer: Buffer::DepthRows, needed: 20, given: 10 };
        assert_eq!(refused(Frame { reach: 2, ..frame() }), Some(buffer));
    }
}
