//! Similarity transforms that come as matrices.

use nalgebra::Matrix3;

/// How far the columns may be from a rotation's, Frobenius norm of R Rᵀ - 1: matrices are written with few digits.
const TOLERANCE: f64 = 1e-3;

/// Scale and rotation of a transform's linear part; `None` if it is not a rotation with a positive scale.
pub fn scale_and_rotation(linear: &Matrix3<f64>) -> Option<(f64, Matrix3<f64>)> {
    let scale = libm::cbrt(linear.determinant());
    let rotation = linear / scale;
    let error = (rotation * rotation.transpose() - Matrix3::identity()).norm();
    (scale.is_finite() && scale > 0.0 && error <= TOLERANCE).then_some((scale, rotation))
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Rotation3, Vector3};

    #[test]
    fn rotations_of_any_size_are_taken_apart_and_nothing_else() {
        let turn = Rotation3::from_scaled_axis(Vector3::new(0.3, -1.0, 2.0)).into_inner();
        for size in [1e-9, 1.0, 1e9] {
            let (scale, rotation) = scale_and_rotation(&(turn * size)).expect("a similarity");
            assert!((scale / size - 1.0).abs() < 1e-12 && (rotation - turn).norm() < 1e-12);
        }
        let mirrored = turn * Matrix3::from_diagonal(&Vector3::new(-1.0, 1.0, 1.0));
        let sheared = turn + Matrix3::new(0.0, 0.01, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
        for other in [mirrored, sheared, Matrix3::zeros(), turn * f64::NAN] {
            assert_eq!(scale_and_rotation(&other), None, "{other}");
        }
    }
}
