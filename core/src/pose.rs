//! The pose: a similarity transform from the scan's frame and unit to the model's voxels.

use crate::format::Header;

/// q = s R p + t.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Pose {
    /// R, row by row; orthonormal, determinant 1.
    pub rotation: [[f32; 3]; 3],
    /// s, voxels per scan unit.
    pub scale: f32,
    /// t, voxels.
    pub translation: [f32; 3],
}

pub(crate) fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    let ([a0, a1, a2], [b0, b1, b2]) = (a, b);
    a0 * b0 + a1 * b1 + a2 * b2
}

pub(crate) fn cross(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    let ([a0, a1, a2], [b0, b1, b2]) = (a, b);
    [a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0]
}

pub(crate) fn zip(a: [f32; 3], b: [f32; 3], f: impl Fn(f32, f32) -> f32) -> [f32; 3] {
    let ([a0, a1, a2], [b0, b1, b2]) = (a, b);
    [f(a0, b0), f(a1, b1), f(a2, b2)]
}

impl Pose {
    /// The pose that leaves everything where it is.
    pub const IDENTITY: Self = Self {
        rotation: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        scale: 1.0,
        translation: [0.0; 3],
    };

    /// The pose of a scan that lies in the frame of a model's training shapes by the similarity x = s R p + t, in their
    /// unit.
    pub fn in_frame_of(
        header: &Header<'_>,
        rotation: [[f32; 3]; 3],
        scale: f32,
        translation: [f32; 3],
    ) -> Self {
        let translation = zip(translation, header.origin, |t, origin| (t - origin) / header.spacing);
        Self { rotation, scale: scale / header.spacing, translation }
    }

    /// s R p + t.
    pub fn apply(&self, p: [f32; 3]) -> [f32; 3] {
        zip(self.rotate(p), self.translation, |r, t| self.scale * r + t)
    }

    /// R n.
    pub fn rotate(&self, n: [f32; 3]) -> [f32; 3] {
        self.rotation.map(|row| dot(row, n))
    }

    /// Whether all numbers are finite, the scale positive and R a rotation to a thousandth: its rows of length one and
    /// perpendicular, the third on the side of the others' cross product.
    pub fn is_valid(&self) -> bool {
        let [x, y, z] = self.rotation;
        let unit = |row: &[f32; 3]| (dot(*row, *row) - 1.0).abs() < 1e-3;
        let perpendicular = |(a, b): &([f32; 3], [f32; 3])| dot(*a, *b).abs() < 1e-3;
        self.scale.is_finite()
            && self.scale > 0.0
            && self.translation.iter().all(|t| t.is_finite())
            && self.rotation.iter().all(unit)
            && [(x, y), (y, z), (z, x)].iter().all(perpendicular)
            && dot(cross(x, y), z) > 0.0
    }

    /// The pose after a small motion in voxel space about `centre`: turn by the vector `omega` (radians),
    /// grow by exp(`growth`), move by `shift`.
    pub fn moved(&self, centre: [f32; 3], omega: [f32; 3], growth: f32, shift: [f32; 3]) -> Self {
        let turn = rotation(omega);
        let turned = |v: [f32; 3]| turn.map(|row| dot(row, v));
        let grow = libm::expf(growth);
        let from_centre = turned(zip(self.translation, centre, |t, c| t - c));
        let moved = zip(centre, shift, |c, s| c + s);
        Self {
            rotation: orthonormal(product(turn, self.rotation)),
            scale: self.scale * grow,
            translation: zip(moved, from_centre, |m, f| m + grow * f),
        }
    }
}

/// The rotation by a vector (Rodrigues' formula, through the unit quaternion).
fn rotation(omega: [f32; 3]) -> [[f32; 3]; 3] {
    let angle = libm::sqrtf(dot(omega, omega));
    let half = 0.5 * angle;
    let s = if angle > 1e-6 { libm::sinf(half) / angle } else { 0.5 };
    let ([x, y, z], w) = (omega.map(|o| o * s), libm::cosf(half));
    [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
        [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
        [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
    ]
}

fn product(a: [[f32; 3]; 3], b: [[f32; 3]; 3]) -> [[f32; 3]; 3] {
    let [b0, b1, b2] = b;
    a.map(|[x, y, z]| zip(zip(b0, b1, |p, q| x * p + y * q), b2, |s, r| s + z * r))
}

/// Gram-Schmidt on the rows: keeps rounding from bending R over many steps.
fn orthonormal([x, y, _]: [[f32; 3]; 3]) -> [[f32; 3]; 3] {
    let unit = |v: [f32; 3]| {
        let length = libm::sqrtf(dot(v, v));
        v.map(|c| c / length)
    };
    let x = unit(x);
    let along = dot(x, y);
    let y = unit(zip(y, x, |b, a| b - along * a));
    [x, y, cross(x, y)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quarter_turn_takes_x_to_y() {
        let pose =
            Pose::IDENTITY.moved([0.0; 3], [0.0, 0.0, core::f32::consts::FRAC_PI_2], 0.0, [1.0, 2.0, 3.0]);
        let q = pose.apply([1.0, 0.0, 0.0]);
        assert!(zip(q, [1.0, 3.0, 3.0], |a, b| (a - b).abs()).iter().all(|&d| d < 1e-6), "{q:?}");
        assert!(pose.is_valid());
    }

    #[test]
    fn a_mirrored_or_sheared_frame_is_no_pose() {
        let [x, y, z] = Pose::IDENTITY.rotation;
        let two_degrees = [0.0349, 0.99939, 0.0];
        let sheared = [[x, [0.6, 0.8, 0.0], z], [x, two_degrees, z], [two_degrees, y, z]];
        for rotation in [[x, y, z.map(|c| -c)], [y, x, z], [x, y, y]].into_iter().chain(sheared) {
            assert!(!Pose { rotation, ..Pose::IDENTITY }.is_valid(), "{rotation:?}");
        }
    }

    #[test]
    fn the_centre_of_a_motion_only_shifts() {
        let centre = [3.0, -2.0, 5.0];
        let pose = Pose::IDENTITY.moved(centre, [0.1, -0.2, 0.3], 0.2, [0.5, 0.0, 0.0]);
        let q = pose.apply(centre);
        assert!(zip(q, [3.5, -2.0, 5.0], |a, b| (a - b).abs()).iter().all(|&d| d < 1e-5), "{q:?}");
        assert!((pose.scale - libm::expf(0.2)).abs() < 1e-6);
    }

    #[test]
    fn many_small_turns_stay_orthonormal() {
        let mut pose = Pose::IDENTITY;
        for _ in 0..1000 {
            pose = pose.moved([1.0, 2.0, 3.0], [0.13, 0.07, -0.11], 0.0, [0.0; 3]);
        }
        assert!(pose.is_valid());
    }
}
