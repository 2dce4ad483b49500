//! The smooth base without features, and the overall proportions.
//!
//! Cross-sections at constant height: ellipses, a little flattened in front, given by the azimuth
//! (0 in front, positive to the subject's left) and the height.

use super::curve::{Profile, bump, step};
use super::parameters::Parameters;
use crate::mesh::{Point, Vector};

/// z of the midline without nose, lips and chin.
const FRONT: Profile = Profile([
    20.0, 22.0, 23.0, 26.0, 68.0, 81.0, 80.0, 81.0, 82.5, 83.0, 82.0, 80.0, 80.0, 83.0, 84.0, 82.0, 76.0,
    65.0, 46.0, 20.0,
]);
/// Half width.
const WIDTH: Profile = Profile([
    58.0, 56.0, 54.0, 54.0, 52.0, 57.0, 62.0, 66.0, 69.0, 71.5, 73.0, 74.0, 75.0, 76.0, 76.5, 76.0, 73.0,
    67.0, 56.0, 38.0,
]);
/// z of the widest point.
const CENTRE: Profile = Profile([
    -36.0, -34.0, -32.0, -29.0, -24.0, -19.0, -16.0, -14.0, -12.0, -11.0, -11.0, -12.0, -14.0, -16.0, -18.0,
    -18.0, -18.0, -18.0, -18.0, -18.0,
]);
/// Flatness of the front; negative is pointed.
const FLAT: Profile = Profile([
    0.0, 0.0, 0.0, 0.0, -0.04, -0.05, -0.01, 0.04, 0.09, 0.12, 0.13, 0.12, 0.10, 0.10, 0.10, 0.10, 0.09,
    0.08, 0.06, 0.04,
]);

/// How far the lower edge of the jaw rises from the chin to the ears.
const JAW_RISE: f64 = 30.0;

/// The base surface at azimuth `angle` (radians) and height `y`.
pub(super) fn base(angle: f64, y: f64) -> Point {
    let (sin, cos) = (libm::sin(angle), libm::cos(angle));
    let side = sin * sin * step(0.0, 1.2, angle.abs());
    let level = y - JAW_RISE * side * step(-25.0, -75.0, y);
    let centre = CENTRE.at(level);
    let depth = FRONT.at(level) - centre;
    let forward = cos * (1.0 + FLAT.at(level) * sin * sin);
    Point::new(WIDTH.at(level) * sin, y, centre + depth * forward)
}

/// Overall proportions, applied to a finished point; each step keeps neighbours in order.
pub(super) fn proportion(p: &Parameters, mut q: Point) -> Point {
    let lower = step(-20.0, -70.0, q.y);
    let jaw = bump([0.0, q.y], [0.0, -72.0], [1.0, 26.0]);
    let neck = step(-90.0, -112.0, q.y);
    let temple = bump([0.0, q.y], [0.0, 52.0], [1.0, 22.0]);
    q.z -= 5.0 * p.forehead * step(35.0, 110.0, q.y);
    q.z += 2.0 * p.chin_protrusion * jaw * step(0.0, 60.0, q.z);
    q.x *= 1.0 + 0.035 * p.jaw_width * jaw + 0.04 * p.neck * neck + 0.018 * p.temples * temple;
    q.z += 2.0 * p.neck * neck;
    q.x += 1.8 * p.jaw_shift * lower * (1.0 - 0.7 * neck);
    q.y -= 2.5 * p.jaw_length * lower;
    let scale = Vector::new(1.0 + 0.032 * p.width, 1.0 + 0.028 * p.height, 1.0 + 0.03 * p.depth);
    Point::from(q.coords.component_mul(&scale))
}
