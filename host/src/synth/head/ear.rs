//! Ears: thick leaves that stand off the side of the head and lean back.
//!
//! An upright footprint on the side of the head is pushed along directions that lean back and spread
//! out. They all leave the surface on the same side and never meet, so the leaf cannot cut itself or
//! the head; it is as thick as the footprint is wide, times the cosine of the lean.

use super::curve::{bell, step};
use super::parameters::Parameters;
use crate::mesh::Vector;

/// Azimuth of the middle of the footprint.
const AZIMUTH: f64 = 1.56;
/// Length of an arc of one radian at the side of the head.
const RADIUS: f64 = 86.0;

/// One ear of a head.
pub(super) struct Ear {
    side: f64,
    size: f64,
    lean: f64,
    height: f64,
}

impl Ear {
    /// `side` is +1 for the subject's left ear, -1 for the right one.
    pub fn new(p: &Parameters, side: f64) -> Self {
        Self {
            side,
            size: 1.0 + 0.05 * p.ear_size + 0.03 * side * p.ear_size_skew,
            lean: 0.82 - 0.05 * p.ear_angle - 0.035 * side * p.ear_angle_skew,
            height: 8.0 + 1.8 * p.ear_height + 1.2 * side * p.ear_height_skew,
        }
    }

    /// Place on the footprint: across (-1 in front, 1 behind) and along (-1 below, 1 above).
    pub fn place(&self, angle: f64, y: f64) -> (f64, f64) {
        let (back, up) = ((angle * self.side - AZIMUTH) * RADIUS, y - self.height);
        // The long axis of an ear is tilted backwards.
        let (back, up) = (back + 0.16 * up, up - 0.16 * back);
        (back / (17.0 * self.size), up / (30.0 * self.size))
    }

    pub fn displacement(&self, angle: f64, y: f64) -> Vector {
        let (s, t) = self.place(angle, y);
        if s.abs() >= 1.0 || t.abs() >= 1.0 {
            return Vector::zeros();
        }
        let spread = 0.22 * t;
        let (sin, cos) = (libm::sin(self.lean), libm::cos(self.lean));
        Vector::new(self.side * cos, spread, -sin) * (self.reach(s, t) * self.size)
    }

    /// Length of the displacement: a plateau, late to rise in the bowl, lower at the lobe.
    fn reach(&self, s: f64, t: f64) -> f64 {
        let inside = 1.0 - t * t;
        let s = s / (0.80 + 0.20 * inside);
        let bowl = 0.42 * bell((t + 0.06) / 0.42);
        let front = step(bowl - 1.0, 0.5 * bowl - 0.4, s);
        let back = step(1.0, 0.2, s);
        let outline = 1.25 * inside / (inside + 0.25) * step(0.0, 0.6, inside) * (22.0 + 3.0 * t);
        let tragus = 4.5 * bell((s + 0.78) / 0.12) * bell((t + 0.12) / 0.16) * step(0.0, 0.2, 1.0 - s * s);
        front * back * outline + tragus
    }
}
