//! The scanner's geometry: a pinhole camera and a projector beside it, looking at the head.

use crate::mesh::{Point, Vector};
use crate::synth::Random;
use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion};

/// Horizontal field of view: 45 degrees; this is the tangent of half of it.
const HALF_VIEW: f64 = 0.414_213_562_373_095_1;
/// Projector to the camera's right, in millimetres.
const BASELINE_MM: (f64, f64) = (120.0, 140.0);
const DISTANCE_MM: (f64, f64) = (400.0, 450.0);

/// Pinhole: x right, y down, z forward; pixel centres at integers, `X = (column - cx) / fx * Z`.
#[derive(Clone, Debug)]
pub(super) struct Camera {
    pub width: u32,
    pub height: u32,
    pub f: f64,
    pub to_model: Isometry3<f64>,
    /// The projector's centre, model frame.
    pub projector: Point,
}

impl Camera {
    /// A camera that looks at the middle of the object from `yaw` degrees to the subject's left.
    pub fn looking(middle: Point, yaw_deg: f64, size: (u32, u32), random: &mut Random) -> Self {
        let yaw = (yaw_deg + random.range(-4.0, 4.0)).to_radians();
        let pitch = random.range(-8.0, 8.0).to_radians();
        let roll = random.range(-5.0, 5.0).to_radians();
        let distance = random.range(DISTANCE_MM.0, DISTANCE_MM.1);
        let to = Vector::new(
            libm::sin(yaw) * libm::cos(pitch),
            libm::sin(pitch),
            libm::cos(yaw) * libm::cos(pitch),
        );
        let eye = middle + to * distance;
        let to_model = Isometry3::from_parts(Translation3::from(eye), facing(-to, roll));
        let side = if random.unit() < 0.5 { -1.0 } else { 1.0 };
        let baseline = side * random.range(BASELINE_MM.0, BASELINE_MM.1);
        let projector = to_model * Point::new(baseline, 0.0, 0.0);
        Self { width: size.0, height: size.1, f: 0.5 * f64::from(size.0) / HALF_VIEW, to_model, projector }
    }

    /// The principal point, (column, row).
    pub fn centre(&self) -> (f64, f64) {
        (0.5 * (f64::from(self.width) - 1.0), 0.5 * (f64::from(self.height) - 1.0))
    }

    /// The line of sight of a pixel, with z = 1, so that lengths along it are depths; camera frame.
    pub fn sight(&self, column: u32, row: u32) -> Vector {
        let (cx, cy) = self.centre();
        Vector::new((f64::from(column) - cx) / self.f, (f64::from(row) - cy) / self.f, 1.0)
    }

    /// The camera's centre, model frame.
    pub fn eye(&self) -> Point {
        self.to_model * Point::origin()
    }
}

/// The rotation that takes z to `forward` and keeps y downwards, then rolled.
fn facing(forward: Vector, roll: f64) -> UnitQuaternion<f64> {
    let right = forward.cross(&Vector::y()).normalize();
    let down = forward.cross(&right);
    let (sin, cos) = (libm::sin(roll), libm::cos(roll));
    let rolled = Matrix3::from_columns(&[right * cos + down * sin, down * cos - right * sin, forward]);
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rolled))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_camera_sees_the_middle_upright() {
        let middle = Point::new(1.0, 2.0, 3.0);
        let camera = Camera::looking(middle, 0.0, (320, 240), &mut Random::new(1, 1));
        let seen = camera.to_model.inverse() * middle;
        assert!(seen.x.abs() < 1e-9 && seen.y.abs() < 1e-9 && seen.z >= 400.0);
        let down = camera.to_model * Vector::y();
        let right = camera.to_model * Vector::x();
        // In front of the subject the picture's right is the subject's left, +x.
        assert!(down.y < -0.9 && right.x > 0.9, "{down} {right}");
    }
}
