//! The scan as the core takes it: oriented points, packed into six 16-bit integers each.
//!
//! Host and device unpack the same integers to the same floats, so that both fit the same scan; on the wire
//! and in memory a point takes 12 bytes. Positions are relative to a centre the caller keeps (the scan may lie
//! far from its origin), in steps of the cloud: 65535 steps over 300 mm are 0.005 mm each.

use crate::error::{Error, OptionName};
use crate::hint::Hint;
use crate::pose::Pose;
use libm::floorf;

/// A point: position in steps, then its outward unit normal in 1/16384.
pub type Packed = [i16; 6];

/// Most points of a scan: as many as the example firmwares have room for. The host thins a scan until it has no more,
/// so that host and device fit the same points and no scan is too large.
pub const CAPACITY: usize = 24_576;

/// Units a component of a unit normal has.
const NORMAL: f32 = 16384.0;

/// Whether coordinates can count in steps of so many scan units.
pub(crate) fn check_step(step: f32) -> Result<(), Error> {
    if step.is_normal() && step > 0.0 { Ok(()) } else { Err(Error::Option(OptionName::CloudStep)) }
}

/// A scan's points, about half a voxel apart, with normals of length one: points whose normal is more than 1 % longer or
/// shorter reach no voxel. Results depend a little on their order: neighbours help most next to each other
/// ([`along_curve`](crate::curve::along_curve)), and for equal bits the order must be equal.
#[derive(Clone, Copy, Debug)]
pub struct Cloud<'a> {
    points: &'a [Packed],
    step: f32,
}

impl<'a> Cloud<'a> {
    /// Points whose positions count in `step` scan units.
    ///
    /// # Errors
    /// A step that is not a positive number.
    pub fn new(points: &'a [Packed], step: f32) -> Result<Self, Error> {
        check_step(step)?;
        Ok(Self { points, step })
    }

    /// Number of points.
    pub const fn len(&self) -> usize {
        self.points.len()
    }

    /// Whether there are none.
    pub const fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// Position, scan unit, and outward normal of point `index`.
    pub fn point(&self, index: usize) -> Option<([f32; 3], [f32; 3])> {
        let &[x, y, z, a, b, c] = self.points.get(index)?;
        let position = [x, y, z].map(|v| f32::from(v) * self.step);
        Some((position, [a, b, c].map(|v| f32::from(v) / NORMAL)))
    }
}

/// A packed scan in bytes, little endian: how firmware carries a scan of its own.
///
/// | size | content |
/// |---|---|
/// | 4 | f32 step, scan units |
/// | 52 | [`Pose`]: f32 rotation row by row, scale, translation (scan units to voxels) |
/// | 4 | how well the pose is known: the number of a [`Hint`], then zeros |
/// | 12 n | points, six i16 each |
#[derive(Clone, Copy, Debug)]
pub struct Bytes<'a>(pub &'a [u8]);

/// Bytes before the first point.
const HEAD: usize = 60;
/// Where the hint lies.
const HINT_AT: usize = 56;

impl<'a> Bytes<'a> {
    fn number(&self, index: usize) -> f32 {
        let bytes = self.0.get(4 * index..).and_then(|b| b.first_chunk()).copied();
        f32::from_le_bytes(bytes.unwrap_or_default())
    }

    /// Scan units a step.
    pub fn step(&self) -> f32 {
        self.number(0)
    }

    /// The pose.
    pub fn pose(&self) -> Pose {
        let n = |i: usize| self.number(i);
        let row = |i: usize| [n(i), n(i + 1), n(i + 2)];
        Pose { rotation: [row(1), row(4), row(7)], scale: n(10), translation: row(11) }
    }

    /// How well the pose is known.
    pub fn hint(&self) -> Hint {
        self.0.get(HINT_AT).map_or(Hint::Rough, |&byte| Hint::from_byte(byte))
    }

    /// The points.
    pub fn points(&self) -> impl ExactSizeIterator<Item = Packed> + use<'a> {
        from_bytes(self.0.get(HEAD..).unwrap_or(&[]))
    }

    /// The bytes before the points.
    pub fn head(step: f32, pose: &Pose, hint: Hint) -> [u8; HEAD] {
        let numbers = [step].into_iter().chain(pose.rotation.into_iter().flatten());
        let numbers = numbers.chain([pose.scale]).chain(pose.translation);
        let mut head = [0; HEAD];
        for (bytes, number) in head.as_chunks_mut().0.iter_mut().zip(numbers) {
            *bytes = number.to_le_bytes();
        }
        if let Some(byte) = head.get_mut(HINT_AT) {
            *byte = hint.to_byte();
        }
        head
    }
}

/// Bytes of a point.
pub const POINT_BYTES: usize = 12;

/// Points from their bytes, little endian; a last part that is no whole point is left out.
pub fn from_bytes(bytes: &[u8]) -> impl ExactSizeIterator<Item = Packed> + '_ {
    let (points, _) = bytes.as_chunks::<POINT_BYTES>();
    points.iter().map(|&[a, b, c, d, e, f, g, h, i, j, k, l]| {
        [[a, b], [c, d], [e, f], [g, h], [i, j], [k, l]].map(i16::from_le_bytes)
    })
}

/// The step that just holds positions up to `extent` scan units from the centre.
pub fn step_for(extent: f32) -> f32 {
    // One part in 30000 instead of 32767, so that rounding cannot leave the range.
    (extent / 30_000.0).max(f32::MIN_POSITIVE)
}

/// A position (scan units from the centre) and a unit normal as integers, saturated.
pub fn pack(position: [f32; 3], normal: [f32; 3], step: f32) -> Packed {
    let round = |v: f32| floorf(v + 0.5) as i16;
    let ([x, y, z], [a, b, c]) = (position.map(|v| round(v / step)), normal.map(|v| round(v * NORMAL)));
    [x, y, z, a, b, c]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_come_back_to_half_a_step() {
        let step = step_for(150.0);
        let (position, normal) = ([-150.0, 0.01, 99.987], [0.6, -0.8, 0.0]);
        let points = [pack(position, normal, step)];
        let (p, n) = Cloud::new(&points, step).unwrap().point(0).unwrap();
        assert!(p.iter().zip(position).all(|(a, b)| (a - b).abs() <= 0.51 * step));
        assert!(n.iter().zip(normal).all(|(a, b)| (a - b).abs() <= 0.51 / NORMAL));
    }

    #[test]
    fn bytes_give_back_step_pose_and_points() {
        let pose = Pose { scale: 0.25, translation: [1.0, -2.0, 3.5], ..Pose::IDENTITY };
        let mut bytes = [0; HEAD + 12];
        bytes[..HEAD].copy_from_slice(&Bytes::head(0.125, &pose, Hint::Settled));
        bytes[HEAD..].copy_from_slice(&[1, 0, 0xff, 0xff, 2, 1, 0, 0x40, 0, 0, 0, 0]);
        let back = Bytes(&bytes);
        assert_eq!((back.step(), back.pose(), back.hint()), (0.125, pose, Hint::Settled));
        assert!(back.points().eq([[1, -1, 258, 16384, 0, 0]]));
    }

    #[test]
    fn a_step_must_be_a_positive_number() {
        for step in [0.0, -1.0, f32::NAN, f32::INFINITY] {
            assert!(Cloud::new(&[], step).is_err(), "{step}");
        }
    }
}
