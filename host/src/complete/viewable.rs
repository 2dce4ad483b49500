//! How much of a surface one view can show.

use crate::mesh::{Mesh, Vector};
use rayon::prelude::*;
use std::f64::consts::PI;

/// Directions that are tried, evenly over the sphere: 18 degrees apart.
const DIRECTIONS: usize = 120;
/// Cosine of the steepest angle that a scanner measures at, 75 degrees.
const STEEPEST: f64 = 0.26;

/// Share of a surface, by area, that faces one direction at most, if nothing hid it: a ball 0.37, a plane 1.
pub fn share(mesh: &Mesh) -> f64 {
    let areas: Vec<Vector> = (0..mesh.triangles.len())
        .map(|t| {
            let [a, b, c] = mesh.corners(t);
            (b - a).cross(&(c - a))
        })
        .collect();
    let total: f64 = areas.iter().map(Vector::norm).sum();
    let seen = |number: usize| -> f64 {
        let towards = direction(number);
        let faces = |area: &&Vector| area.dot(&towards) > STEEPEST * area.norm();
        areas.iter().filter(faces).map(Vector::norm).sum()
    };
    let most = (0..DIRECTIONS).into_par_iter().map(seen).reduce(|| 0.0, f64::max);
    if total > 0.0 { most / total } else { 1.0 }
}

/// The points of a spiral over the sphere.
fn direction(number: usize) -> Vector {
    let z = 1.0 - (2 * number + 1) as f64 / DIRECTIONS as f64;
    let golden = PI * (3.0 - libm::sqrt(5.0));
    let (sine, cosine) = libm::sincos(golden * number as f64);
    Vector::new(cosine, sine, 0.0) * libm::sqrt(1.0 - z * z) + Vector::z() * z
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::shapes::{ball, sheet};

    #[test]
    fn of_a_ball_less_than_half_is_seen_and_of_a_sheet_all() {
        let ball = share(&ball(32, 12.0));
        assert!((ball - 0.37).abs() < 0.01, "{ball}");
        assert_eq!(share(&sheet(10)), 1.0);
        assert_eq!(share(&Mesh::default()), 1.0);
    }
}
