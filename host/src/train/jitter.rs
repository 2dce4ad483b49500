//! The poses of shapes that were given in one frame and drawn to their mean: the frame is kept on average, and how far
//! the shapes lay apart in it is told to the model.

use crate::mesh::{Mesh, Point, Vector};
use lacuna::format::Jitter;
use nalgebra::{Matrix3, Rotation3, Similarity3, Translation3, UnitQuaternion};

/// Moves the common frame so that `motions`, from each shape to it, are none on average.
pub fn keep_frame(shapes: &[Mesh], motions: &mut [Similarity3<f64>]) {
    let count = motions.len().max(1) as f64;
    let middles = || shapes.iter().map(middle).zip(&*motions).map(|(middle, motion)| motion * middle);
    let centre = Point::from(middles().fold(Vector::zeros(), |sum, p| sum + p.coords) / count);
    let back: Vec<Similarity3<f64>> = motions.iter().map(Similarity3::inverse).collect();
    let turns = back.iter().fold(Matrix3::zeros(), |sum, motion| sum + rotation(motion).matrix());
    let turn = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix(&turns));
    let growth = back.iter().map(|motion| libm::log(motion.scaling())).sum::<f64>() / count;
    let target = back.iter().fold(Vector::zeros(), |sum, motion| sum + (motion * centre).coords) / count;
    let mean = Similarity3::from_parts(Translation3::from(target), turn, libm::exp(growth))
        * Translation3::from(-centre.coords);
    motions.iter_mut().for_each(|motion| *motion = mean * *motion);
}

/// How far shapes lay from their common pose, root mean square, in their own unit. A model file has it as a [`Jitter`], in
/// voxels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Apart {
    /// Turn about each axis, radians.
    pub turn: f32,
    /// Shift of the middle along each axis, in the shapes' unit.
    pub shift: f32,
    /// Logarithm of the growth.
    pub growth: f32,
}

impl Apart {
    /// As a model file with voxels of edge `spacing` has it, within what the core reads.
    pub fn in_voxels(&self, spacing: f32) -> Jitter {
        let bounded = |x: f32| x.clamp(Jitter::LEAST, Jitter::MOST);
        Jitter {
            turn: bounded(self.turn),
            shift: bounded(self.shift / spacing),
            growth: bounded(self.growth),
        }
    }

    /// What a model file with voxels of edge `spacing` says.
    pub fn of(&Jitter { turn, shift, growth }: &Jitter, spacing: f32) -> Self {
        Self { turn, shift: shift * spacing, growth }
    }
}

/// Motions below this are rounding: radians, logarithms, shares of the shapes' size.
const NONE: f32 = 1e-6;

/// Root mean square of the motions about the shapes' middles; `None` if they are none.
pub fn apart(shapes: &[Mesh], motions: &[Similarity3<f64>]) -> Option<Apart> {
    let mean = |sum: f64| (sum / motions.len().max(1) as f64).sqrt() as f32;
    let turn: f64 = motions.iter().map(|motion| rotation(motion).scaled_axis().norm_squared()).sum();
    let shift = |(shape, motion): (&Mesh, &Similarity3<f64>)| {
        let middle = middle(shape);
        (motion * middle - middle).norm_squared()
    };
    let shift: f64 = shapes.iter().zip(motions).map(shift).sum();
    let growth: f64 =
        motions.iter().map(|motion| libm::log(motion.scaling())).map(|growth| growth * growth).sum();
    let apart = Apart { turn: mean(turn / 3.0), shift: mean(shift / 3.0), growth: mean(growth) };
    let size = mean(shapes.iter().map(|shape| size(shape).powi(2)).sum());
    let moved = apart.turn.max(apart.growth) > NONE || apart.shift > NONE * size;
    moved.then_some(apart)
}

/// Diagonal of a shape's bounds.
fn size(shape: &Mesh) -> f64 {
    shape.bounds().map_or(0.0, |(low, high)| (high - low).norm())
}

fn rotation(motion: &Similarity3<f64>) -> Rotation3<f64> {
    motion.isometry.rotation.to_rotation_matrix()
}

/// Mean of the vertices.
fn middle(shape: &Mesh) -> Point {
    let sum = shape.points.iter().fold(Vector::zeros(), |sum, p| sum + p.coords);
    Point::from(sum / shape.points.len().max(1) as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synth::Random;

    fn scattered(count: u64) -> (Vec<Mesh>, Vec<Similarity3<f64>>) {
        let motion = |n: u64| {
            let mut random = Random::new(3, n);
            let turn = UnitQuaternion::from_scaled_axis(random.direction() * 0.05 * random.unit());
            let shift = Translation3::from(random.direction() * 4.0);
            Similarity3::from_parts(shift, turn, 1.0 + 0.04 * random.range(-1.0, 1.0))
        };
        let corners = [[0.0, 0.0, 0.0], [90.0, 0.0, 0.0], [0.0, 60.0, 0.0], [0.0, 0.0, 30.0]];
        let shape = Mesh { points: corners.map(Point::from).to_vec(), ..Mesh::default() };
        let motions: Vec<_> = (0..count).map(motion).collect();
        let moved = |motion: &Similarity3<f64>| Mesh {
            points: shape.points.iter().map(|p| motion.inverse() * p).collect(),
            ..Mesh::default()
        };
        (motions.iter().map(moved).collect(), motions)
    }

    /// However the common frame lies: the shapes are where they were, on average.
    #[test]
    fn the_frame_of_the_shapes_is_kept() {
        let (shapes, motions) = scattered(24);
        let turned = Similarity3::from_parts(
            Translation3::new(70.0, -20.0, 9.0),
            UnitQuaternion::from_euler_angles(0.4, -0.2, 0.9),
            1.3,
        );
        let mut moved: Vec<_> = motions.iter().map(|motion| turned * motion).collect();
        keep_frame(&shapes, &mut moved);
        let mean = |f: &dyn Fn(&Mesh, &Similarity3<f64>) -> Vector| {
            shapes.iter().zip(&moved).map(|(s, m)| f(s, m)).sum::<Vector>() / 24.0
        };
        assert!(mean(&|s, m| m * middle(s) - middle(s)).norm() < 0.2);
        assert!(mean(&|_, m| rotation(m).scaled_axis()).norm() < 1e-3);
        assert!(moved.iter().map(|m| m.scaling().ln()).sum::<f64>().abs() < 1e-9);
        let found = apart(&shapes, &moved).expect("they are apart");
        assert!((0.01..0.04).contains(&found.turn) && (0.01..0.03).contains(&found.growth), "{found:?}");
        assert!((1.5..3.5).contains(&found.shift), "{found:?}");
    }

    #[test]
    fn the_unit_of_the_shapes_makes_no_difference_to_a_models_jitter() {
        let of_unit = |unit: f64| {
            let (mut shapes, mut motions) = scattered(6);
            shapes.iter_mut().flat_map(|shape| &mut shape.points).for_each(|p| *p *= unit);
            motions.iter_mut().for_each(|motion| motion.isometry.translation.vector *= unit);
            let found = apart(&shapes, &motions).expect("moved, in any unit");
            found.in_voxels((3.0 * unit) as f32)
        };
        let millimetres = of_unit(1.0);
        for unit in [1e-6, 1e-3, 1e3, 1e6] {
            let found = of_unit(unit);
            assert!(
                found.is_sound() && (found.shift / millimetres.shift - 1.0).abs() < 1e-4,
                "{unit}: {found:?}"
            );
        }
        let shift_alone = Apart { turn: 0.0, shift: 1e9, growth: 0.0 };
        assert!(shift_alone.in_voxels(1.0).is_sound());
    }

    #[test]
    fn shapes_that_were_not_moved_have_no_jitter() {
        let (shapes, motions) = scattered(3);
        assert_eq!(apart(&shapes, &vec![Similarity3::identity(); motions.len()]), None);
    }
}
