//! How much of a surface one view can show.

use crate::mesh::{Mesh, Vector, twice_area_vector};
use rayon::prelude::*;
use std::f64::consts::PI;

/// Directions that are tried, evenly over the sphere: 18 degrees apart.
const DIRECTIONS: usize = 120;
/// Cosine of the steepest angle that a scanner measures at, 75 degrees.
const STEEPEST: f64 = 0.26;

/// Share of a surface, by area, that faces one direction at most, if nothing hid it: a ball 0.37, a plane 1.
pub fn share(mesh: &Mesh) -> f64 {
    let area = mesh.area();
    let shown = (0..DIRECTIONS).into_par_iter().map(|number| facing(mesh, &direction(number)));
    let most = shown.reduce(|| 0.0, f64::max);
    if area > 0.0 { most / area } else { 1.0 }
}

/// Area of a surface that faces a direction, of unit length, so that a scanner there measures it.
pub fn facing(mesh: &Mesh, towards: &Vector) -> f64 {
    let area = |t: usize| {
        let cross = twice_area_vector(&mesh.corners(t));
        if cross.dot(towards) > STEEPEST * cross.norm() { 0.5 * cross.norm() } else { 0.0 }
    };
    (0..mesh.triangles.len()).map(area).sum()
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
        assert!((share(&sheet(10)) - 1.0).abs() < 1e-12);
        assert_eq!(share(&Mesh::default()), 1.0);
    }
}
