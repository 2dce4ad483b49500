//! Points of a scan in a pose, read from the field: what the pose explains, and the pose that explains more.
//!
//! A point counts where the surface is near and faces its way, by the share 1 - (d / τ)² of its distance d within
//! the gate τ: what is farther is clutter, however far. A point deep within the body contradicts the pose.

use super::field::Field;
use crate::points::OrientedPoints;
use nalgebra::{SMatrix, SVector, Similarity3, Translation3, UnitQuaternion, Vector3};

/// Cosine between a point's normal and the surface's, at least.
const FACING: f32 = 0.5;
/// Points this deep within the body cannot have been seen, class millimetres.
const DEEP: f32 = 12.0;

/// Oriented points in single precision.
pub struct Probe {
    points: Vec<[f32; 3]>,
    normals: Vec<[f32; 3]>,
    mean: Vector3<f64>,
}

/// A pose at work: s R, R and t in single precision.
struct Motion {
    grown: [[f32; 3]; 3],
    turn: [[f32; 3]; 3],
    shift: [f32; 3],
}

impl Motion {
    fn new(pose: &Similarity3<f64>) -> Self {
        let turn: [[f32; 3]; 3] =
            pose.isometry.rotation.to_rotation_matrix().matrix().transpose().map(|c| c as f32).into();
        let scale = pose.scaling() as f32;
        let shift = pose.isometry.translation.vector.map(|c| c as f32).into();
        Self { grown: turn.map(|row| row.map(|c| c * scale)), turn, shift }
    }

    #[inline]
    fn place(&self, p: [f32; 3]) -> [f32; 3] {
        let [x, y, z] = self.grown.map(|row| dot(row, p));
        [x + self.shift[0], y + self.shift[1], z + self.shift[2]]
    }

    #[inline]
    fn direction(&self, n: [f32; 3]) -> [f32; 3] {
        self.turn.map(|row| dot(row, n))
    }
}

#[inline]
fn dot([a, b, c]: [f32; 3], [x, y, z]: [f32; 3]) -> f32 {
    a * x + b * y + c * z
}

impl Probe {
    /// The points numbered `chosen`.
    pub fn new(scan: &OrientedPoints, chosen: &[usize]) -> Self {
        let points: Vec<[f32; 3]> =
            chosen.iter().map(|&i| scan.points[i].coords.map(|c| c as f32).into()).collect();
        let normals = chosen.iter().map(|&i| scan.normals[i].map(|c| c as f32).into()).collect();
        let sum = chosen.iter().fold(Vector3::zeros(), |sum, &i| sum + scan.points[i].coords);
        Self { points, normals, mean: sum / chosen.len().max(1) as f64 }
    }

    /// What a pose explains, a share of the points; given up where it cannot reach `least` any more.
    pub fn explained(&self, field: &Field, pose: &Similarity3<f64>, gate: f64, least: f64) -> f64 {
        let motion = Motion::new(pose);
        let millimetre = field.millimetre as f32;
        let (gate, deep) = (gate as f32 * millimetre, -DEEP * millimetre);
        let count = self.points.len();
        let mut sum = 0.0f32;
        for (done, (&p, &n)) in self.points.iter().zip(&self.normals).enumerate() {
            if let Some((d, along)) = field.at(motion.place(p)) {
                if d < deep {
                    sum -= 0.5;
                } else if d.abs() < gate && dot(along, motion.direction(n)) > FACING {
                    sum += 1.0 - (d / gate) * (d / gate);
                }
            }
            if done % 32 == 31 {
                // What the rest explains is likely no more than three deviations above what these did.
                let seen = (done + 1) as f64;
                if (f64::from(sum) + 1.5 * seen.sqrt()) / seen < least {
                    return f64::MIN;
                }
            }
        }
        f64::from(sum) / count.max(1) as f64
    }

    /// One Gauss-Newton step towards the surface, with scale; the same pose where there is nothing to hold on to.
    pub fn step(&self, field: &Field, pose: &Similarity3<f64>, gate: f64) -> Similarity3<f64> {
        let motion = Motion::new(pose);
        let gate = (gate * field.millimetre) as f32;
        let centre = pose * nalgebra::Point3::from(self.mean);
        let middle: [f32; 3] = centre.coords.map(|c| c as f32).into();
        let (mut matrix, mut vector) = (SMatrix::<f32, 7, 7>::zeros(), SVector::<f32, 7>::zeros());
        let mut total = 0.0f32;
        for (&p, &n) in self.points.iter().zip(&self.normals) {
            let q = motion.place(p);
            let Some((d, along)) = field.at(q) else { continue };
            if d.abs() >= gate || dot(along, motion.direction(n)) < FACING {
                continue;
            }
            let rest = 1.0 - (d / gate) * (d / gate);
            let weight = rest * rest;
            let arm = [q[0] - middle[0], q[1] - middle[1], q[2] - middle[2]];
            let turn = cross(arm, along);
            // The last entry is the residual in scan units: it stops the shrinking.
            let row = [turn[0], turn[1], turn[2], along[0], along[1], along[2], dot(arm, along) - d];
            for i in 0..7 {
                let scaled = weight * row[i];
                vector[i] -= scaled * d;
                for j in 0..=i {
                    matrix[(i, j)] += scaled * row[j];
                }
            }
            total += weight;
        }
        if total < 8.0 {
            return *pose;
        }
        let arm = field.size as f32 * 0.1;
        for i in 0..7 {
            matrix[(i, i)] += total * if i < 3 || i == 6 { 1e-3 * arm * arm } else { 1e-3 };
        }
        let Some(solved) = matrix.cholesky().map(|factor| factor.solve(&vector)) else { return *pose };
        let limited =
            |v: Vector3<f32>, limit: f32| v.map(f64::from) * f64::from((limit / v.norm().max(1e-9)).min(1.0));
        let turn = limited(solved.fixed_rows::<3>(0).into(), 0.25);
        let shift = limited(solved.fixed_rows::<3>(3).into(), 20.0 * field.millimetre as f32);
        let growth = f64::from(solved[6].clamp(-0.08, 0.08)).exp();
        let turn = UnitQuaternion::from_scaled_axis(turn);
        let from_centre = turn * (pose.isometry.translation.vector - centre.coords) * growth;
        let translation = Translation3::from(centre.coords + shift + from_centre);
        Similarity3::from_parts(translation, turn * pose.isometry.rotation, pose.scaling() * growth)
    }
}

#[inline]
fn cross([a0, a1, a2]: [f32; 3], [b0, b1, b2]: [f32; 3]) -> [f32; 3] {
    [a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0]
}
