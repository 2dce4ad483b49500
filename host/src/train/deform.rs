//! What a similarity explains of a smooth deformation.
//!
//! Drawn to the mean by a similarity alone, a long face turns and grows until it meets the mean's surface as well as it
//! can: the pose explains shape. So a shape is drawn by a cubic polynomial of its coordinates, which widens, lengthens
//! and bends it, and only the similarity next to that motion is kept:
//!
//! ```text
//! q' = q + Σ c_k φ_k(q),  φ all monomials up to degree 3 of (q - centre) / (size / 2)
//! (JᵀWJ + λ Σw I) δ = -(JᵀW d + λ Σw c),  row = [n φ_k],  w = (1 - (d / τ)²)²,  λ = 0.0003
//! ```
//!
//! Ten faces, compared with generalised Procrustes analysis of corresponding vertices: a similarity alone ends up to 4.9
//! degrees and 3.6 % of scale away, degree 2 1.7 and 1.7, degree 3 1.6 and 1.9.

use crate::mesh::{Point, Vector};
use crate::points::OrientedPoints;
use crate::register::field::Field;
use crate::register::umeyama::similarity;
use nalgebra::{DMatrix, DVector, Similarity3};

/// Highest degree of the polynomial, and the number of its monomials.
const DEGREE: usize = 3;
const TERMS: usize = 20;
/// Prior λ of a coefficient, voxel⁻².
const PRIOR: f64 = 3e-4;
/// Gauss-Newton steps.
const STEPS: usize = 4;
/// Distance beyond which a point does not count, class millimetres.
const GATE: f64 = 14.0;
/// Cosine between a point's normal and the surface's, at least.
const FACING: f64 = 0.5;

/// The pose moved by the similarity part of the deformation that takes the points to the surface.
pub fn drawn(field: &Field, points: &OrientedPoints, pose: &Similarity3<f64>) -> Similarity3<f64> {
    let placed: Vec<Point> = points.points.iter().map(|p| pose * p).collect();
    let normals: Vec<Vector> = points.normals.iter().map(|n| pose.isometry.rotation * n).collect();
    let sum = placed.iter().fold(Vector::zeros(), |sum, q| sum + q.coords);
    let centre = sum / placed.len().max(1) as f64;
    let terms: Vec<[f64; TERMS]> =
        placed.iter().map(|q| monomials((q.coords - centre) / (field.size / 2.0))).collect();
    let mut coefficients = DVector::zeros(3 * TERMS);
    for _ in 0..STEPS {
        let moved: Vec<Point> = placed.iter().zip(&terms).map(|(q, t)| q + bent(t, &coefficients)).collect();
        match step(field, &moved, &normals, &terms, &coefficients) {
            Some(change) => coefficients += change,
            None => return *pose,
        }
    }
    let pairs = placed.iter().zip(&terms).map(|(q, t)| (*q, q + bent(t, &coefficients)));
    similarity(&pairs.collect::<Vec<_>>()).map_or(*pose, |more| more * pose)
}

/// x^i y^j z^k for i + j + k up to the degree.
fn monomials(at: Vector) -> [f64; TERMS] {
    let mut terms = [0.0; TERMS];
    let powers = at.map(|x| [1.0, x, x * x, x * x * x]);
    let exponents = (0..=DEGREE)
        .flat_map(|i| (0..=DEGREE - i).flat_map(move |j| (0..=DEGREE - i - j).map(move |k| [i, j, k])));
    for (term, [i, j, k]) in terms.iter_mut().zip(exponents) {
        *term = powers.x[i] * powers.y[j] * powers.z[k];
    }
    terms
}

fn bent(terms: &[f64; TERMS], coefficients: &DVector<f64>) -> Vector {
    let along = |axis: usize| terms.iter().enumerate().map(|(k, t)| coefficients[axis * TERMS + k] * t).sum();
    Vector::new(along(0), along(1), along(2))
}

/// The change of the coefficients in one step; `None` where too few points are near the surface.
fn step(
    field: &Field,
    moved: &[Point],
    normals: &[Vector],
    terms: &[[f64; TERMS]],
    coefficients: &DVector<f64>,
) -> Option<DVector<f64>> {
    let mut matrix = DMatrix::zeros(3 * TERMS, 3 * TERMS);
    let mut vector = DVector::zeros(3 * TERMS);
    let mut total = 0.0;
    for ((q, normal), terms) in moved.iter().zip(normals).zip(terms) {
        let Some((distance, along)) = field.at(q.coords.map(|c| c as f32).into()) else { continue };
        let (distance, along) = (f64::from(distance), Vector::from(along.map(f64::from)));
        let ratio = distance / (GATE * field.millimetre);
        if ratio.abs() >= 1.0 || along.dot(normal) < FACING {
            continue;
        }
        let weight = (1.0 - ratio * ratio) * (1.0 - ratio * ratio);
        let row: [f64; 3 * TERMS] = std::array::from_fn(|i| along[i / TERMS] * terms[i % TERMS]);
        for (i, value) in row.iter().enumerate() {
            let scaled = weight * value;
            vector[i] -= scaled * distance;
            for (j, other) in row.iter().enumerate().take(i + 1) {
                matrix[(i, j)] += scaled * other;
            }
        }
        total += weight;
    }
    for i in 0..3 * TERMS {
        matrix[(i, i)] += PRIOR * total;
        vector[i] -= PRIOR * total * coefficients[i];
    }
    if total < 3.0 * TERMS as f64 {
        return None;
    }
    matrix.cholesky().map(|factor| factor.solve(&vector))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn twenty_monomials_the_first_constant() {
        let terms = monomials(Vector::new(2.0, 3.0, 5.0));
        assert_eq!(terms[..4], [1.0, 5.0, 25.0, 125.0]);
        assert_eq!(terms[TERMS - 1], 8.0);
        assert!(terms.iter().all(|&t| t > 0.0));
    }
}
