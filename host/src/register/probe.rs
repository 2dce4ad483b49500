//! Points of a scan in a pose, read from the field: what the pose explains, and the pose that explains more.
//!
//! A point counts where the surface is near and faces its way, by the share 1 - (d / τ)² of its distance d within
//! the gate τ: what is farther is clutter, however far. A point deep within the body contradicts the pose.

use super::field::Field;
use crate::mesh::Point;
use crate::points::OrientedPoints;
use nalgebra::{SMatrix, SVector, Similarity3, Translation3, UnitQuaternion, Vector3};

/// Cosine between a point's normal and the surface's, at least.
const FACING: f32 = 0.5;
/// Points this deep within the body cannot have been seen, class millimetres.
const DEEP: f32 = 12.0;
/// What such a point takes away, as a share of what a point on the surface explains.
const PENALTY: f32 = 0.5;
/// Every so many points it is asked whether the pose can still reach what is wanted.
const ASKED: usize = 32;
/// The mean of n points, each of which explains 0 to 1, has a deviation of 0.5 / √n at most; three of these are granted.
const HOPE: f64 = 1.5;
/// Least sum of weights that a step is taken for; seven unknowns want as many points.
const LEAST_SUPPORT: f32 = 8.0;
/// Damping of a step, for each point: turn and growth count as at an arm of this share of the size.
const DAMPING: f32 = 1e-3;
const ARM: f32 = 0.1;
/// Largest step: turn, radians; shift, class millimetres; growth, a logarithm.
const MOST_TURN: f32 = 0.25;
const MOST_SHIFT: f32 = 20.0;
const MOST_GROWTH: f32 = 0.08;

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

    /// All points of a set, in their order.
    pub fn of_all(set: &OrientedPoints) -> Self {
        Self::new(set, &(0..set.points.len()).collect::<Vec<_>>())
    }

    /// Where the points' mean lies in a pose.
    pub fn middle(&self, pose: &Similarity3<f64>) -> Point {
        pose * Point::from(self.mean)
    }

    /// What a pose explains, as a share of the points: below 0 where more of them contradict it.
    pub fn explained(&self, field: &Field, pose: &Similarity3<f64>, gate: f64) -> f64 {
        self.explained_at_least(field, pose, gate, f64::NEG_INFINITY).unwrap_or(0.0)
    }

    /// The same; `None` as soon as it is unlikely to reach `least`.
    pub fn explained_at_least(
        &self,
        field: &Field,
        pose: &Similarity3<f64>,
        gate: f64,
        least: f64,
    ) -> Option<f64> {
        let motion = Motion::new(pose);
        let millimetre = field.millimetre as f32;
        let (gate, deep) = (gate as f32 * millimetre, -DEEP * millimetre);
        let count = self.points.len();
        let mut sum = 0.0f32;
        for (done, (&p, &n)) in self.points.iter().zip(&self.normals).enumerate() {
            if let Some((d, along)) = field.at(motion.place(p)) {
                if d < deep {
                    sum -= PENALTY;
                } else if d.abs() < gate && dot(along, motion.direction(n)) > FACING {
                    sum += 1.0 - (d / gate) * (d / gate);
                }
            }
            let seen = done + 1;
            if seen % ASKED == 0 && (f64::from(sum) + HOPE * (seen as f64).sqrt()) / (seen as f64) < least {
                return None;
            }
        }
        Some(f64::from(sum) / count.max(1) as f64)
    }

    /// One Gauss-Newton step towards the surface, with scale; the same pose where there is nothing to hold on to.
    pub fn step(&self, field: &Field, pose: &Similarity3<f64>, gate: f64) -> Similarity3<f64> {
        let mut sums = Sums::about(self.middle(pose));
        self.add(field, pose, gate, &mut sums);
        sums.moved(field, pose)
    }

    /// Adds the distances of these points, in a pose, from the surface.
    pub fn add(&self, field: &Field, pose: &Similarity3<f64>, gate: f64, sums: &mut Sums) {
        let motion = Motion::new(pose);
        let gate = (gate * field.millimetre) as f32;
        for (&p, &n) in self.points.iter().zip(&self.normals) {
            let q = motion.place(p);
            let Some((d, along)) = field.at(q) else { continue };
            if d.abs() < gate && dot(along, motion.direction(n)) > FACING {
                // The last entry is the residual in units of the points: it stops the shrinking.
                sums.add(q, along, [d, -d], gate);
            }
        }
    }

    /// Adds the distances of these points, which stay, from a surface in a pose: `pose` is that of the field.
    pub fn add_back(&self, field: &Field, pose: &Similarity3<f64>, gate: f64, sums: &mut Sums) {
        let (back, forth) = (Motion::new(&pose.inverse()), Motion::new(pose));
        let (gate, scale) = ((gate * field.millimetre) as f32, pose.scaling() as f32);
        for (&q, &n) in self.points.iter().zip(&self.normals) {
            let Some((d, along)) = field.at(back.place(q)) else { continue };
            let along = forth.direction(along);
            if d.abs() < gate && dot(along, n) > FACING {
                sums.add(q, along, [-d * scale, 0.0], gate * scale);
            }
        }
    }
}

/// Sums of a Gauss-Newton step: turn about the centre, shift, growth.
pub struct Sums {
    matrix: SMatrix<f32, 7, 7>,
    vector: SVector<f32, 7>,
    total: f32,
    centre: Point,
}

impl Sums {
    /// Nothing yet; turns go about `centre`.
    pub fn about(centre: Point) -> Self {
        Self { matrix: SMatrix::zeros(), vector: SVector::zeros(), total: 0.0, centre }
    }

    /// A point at `q` whose distance from a surface changes along a direction, and what growth adds to that.
    fn add(&mut self, q: [f32; 3], along: [f32; 3], [distance, growth]: [f32; 2], gate: f32) {
        let [x, y, z]: [f32; 3] = self.centre.coords.map(|c| c as f32).into();
        let arm = [q[0] - x, q[1] - y, q[2] - z];
        let [a, b, c] = cross(arm, along);
        let row = [a, b, c, along[0], along[1], along[2], dot(arm, along) + growth];
        let ratio = distance / gate;
        let weight = (1.0 - ratio * ratio) * (1.0 - ratio * ratio);
        for i in 0..7 {
            let scaled = weight * row[i];
            self.vector[i] -= scaled * distance;
            for (j, other) in row.iter().enumerate().take(i + 1) {
                self.matrix[(i, j)] += scaled * other;
            }
        }
        self.total += weight;
    }

    /// The pose after the step, of limited length; the same where there is nothing to hold on to.
    pub fn moved(mut self, field: &Field, pose: &Similarity3<f64>) -> Similarity3<f64> {
        if self.total < LEAST_SUPPORT {
            return *pose;
        }
        let arm = field.size as f32 * ARM;
        for i in 0..7 {
            self.matrix[(i, i)] += self.total * if i < 3 || i == 6 { DAMPING * arm * arm } else { DAMPING };
        }
        let Some(solved) = self.matrix.cholesky().map(|factor| factor.solve(&self.vector)) else {
            return *pose;
        };
        let limited =
            |v: Vector3<f32>, limit: f32| v.map(f64::from) * f64::from((limit / v.norm().max(1e-9)).min(1.0));
        let turn = UnitQuaternion::from_scaled_axis(limited(solved.fixed_rows::<3>(0).into(), MOST_TURN));
        let shift = limited(solved.fixed_rows::<3>(3).into(), MOST_SHIFT * field.millimetre as f32);
        let growth = libm::exp(f64::from(solved[6].clamp(-MOST_GROWTH, MOST_GROWTH)));
        let from_centre = turn * (pose.isometry.translation.vector - self.centre.coords) * growth;
        let translation = Translation3::from(self.centre.coords + shift + from_centre);
        Similarity3::from_parts(translation, turn * pose.isometry.rotation, pose.scaling() * growth)
    }
}

#[inline]
fn cross([a0, a1, a2]: [f32; 3], [b0, b1, b2]: [f32; 3]) -> [f32; 3] {
    [a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0]
}
