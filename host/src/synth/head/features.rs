//! Brows, eyes, nose, mouth, chin and cheeks: displacements of the base.

use super::curve::{bell, bump, step};
use super::parameters::Parameters;
use crate::mesh::{Point, Vector};

/// Displacement of the base point `q` by all features of the front.
pub(super) fn displacement(p: &Parameters, q: &Point) -> Vector {
    let front = step(0.0, 25.0, q.z);
    if front == 0.0 {
        return Vector::zeros();
    }
    let at = [q.x, q.y];
    let forward = brows(p, at) + eyes(p, at) + mouth(p, at) + chin(p, at);
    (Vector::z() * forward + nose(p, at) + cheeks(p, at)) * front
}

/// +1 on the subject's left, -1 on the right.
const SIDES: [f64; 2] = [1.0, -1.0];

fn brows(p: &Parameters, at: [f64; 2]) -> f64 {
    let middle = 2.0 * bump(at, [0.0, 41.0], [12.0, 8.0]);
    let ridges = SIDES.map(|side| {
        let x = side * at[0];
        let height = 3.4 + 1.1 * p.brow + 0.7 * side * p.brow_skew;
        let line = 41.0 - 0.006 * (x - 26.0) * (x - 26.0);
        height * bump([x, at[1]], [29.0, line], [15.0, 5.5])
    });
    middle + ridges[0] + ridges[1]
}

fn eyes(p: &Parameters, at: [f64; 2]) -> f64 {
    SIDES.map(|side| eye(p, side, [side * at[0], at[1]])).iter().sum()
}

/// Socket, ball, rims of the lids, fold of the upper lid.
fn eye(p: &Parameters, side: f64, [x, y]: [f64; 2]) -> f64 {
    let centre = [32.5 + 1.6 * p.eye_distance, 24.0 + 1.1 * side * p.eye_skew];
    let (dx, dy) = (x - centre[0], y - centre[1]);
    let dy = dy - (0.06 + 0.06 * p.eye_tilt) * dx;
    let size = 1.0 + 0.06 * p.eye_size;
    // The lids close in an almond: the ellipse is pulled flat towards the corners.
    let (u, v) = (dx / (14.0 * size), dy / (6.6 * size));
    let squared = u * u + v * v * (1.0 + 0.5 * u * u);
    let r = squared.sqrt();
    let upper = step(-2.0, 2.0, dy);
    let socket = -7.5 * bump([dx, dy], [-2.0, 1.0], [17.0, 10.0]);
    let ball = (8.0 + 1.1 * p.eye_depth) * libm::exp(-0.55 * (u * u + v * v * 0.75));
    let opening = -1.3 * libm::exp(-squared * squared * squared);
    let rim = (0.8 + 0.6 * upper) * bell((r - 1.14) / 0.16);
    let fold = -1.5 * upper * bell((r - 1.75) / 0.22) * bell(u / 1.1);
    socket + ball + opening + rim + fold
}

/// Ridge, tip, wings and nostrils, pushed forward and a little down.
fn nose(p: &Parameters, [x, y]: [f64; 2]) -> Vector {
    let (bridge, tip) = (27.0, -15.0 - 2.3 * p.nose_length);
    let along = (bridge - y) / (bridge - tip);
    let x = x - 1.8 * p.nose_bent * step(0.0, 1.0, along);
    let hump = 1.2 * p.nose_hump * bell((along - 0.45) / 0.22);
    let rise = 6.5 + 1.4 * p.nose_bridge * bell((along - 0.1) / 0.5) + hump + 10.0 * along.clamp(-0.3, 1.3);
    let ends = step(bridge + 22.0, bridge - 8.0, y) * step(tip - 13.0, tip + 2.0, y - 0.022 * x * x);
    let width = (1.0 + 0.07 * p.nose_width) * (6.2 + 2.6 * step(0.3, 1.1, along));
    let ridge = rise * ends * flank(x / width);
    let ball = (5.0 + 1.7 * p.nose_tip) * bump([x, y], [0.0, tip - 0.5], [9.0, 8.5]);
    let wing_x = 13.8 + 0.9 * p.nose_wings + 0.8 * p.nose_width;
    let wings: f64 = SIDES.map(|s| bump([x, y], [s * wing_x, tip - 3.5], [4.8, 5.6])).iter().sum();
    let holes: f64 = SIDES.map(|s| bump([x, y], [s * 7.0, tip - 10.0], [3.4, 2.6])).iter().sum();
    let forward = Vector::new(0.0, -0.18, 1.0) * (ridge + ball);
    forward + Vector::z() * ((7.5 + 0.6 * p.nose_wings) * wings) + Vector::new(0.0, 1.2, -2.4) * holes
}

/// Cross-section of the nose: round on top, with a foot that runs out softly.
fn flank(r: f64) -> f64 {
    let squared = r * r;
    1.0 / (1.0 + 0.35 * squared + 0.28 * squared * squared)
}

/// Lips, the line between them, the groove above and the fold below.
fn mouth(p: &Parameters, [x, y]: [f64; 2]) -> f64 {
    let half = 25.0 + 1.7 * p.mouth_width;
    let (u, height) = (x / half, -47.0 + 1.5 * p.mouth_height);
    let line = height + 1.2 * p.mouth_skew * u.clamp(-1.5, 1.5) - 0.8 * bell(x / 4.0) - 1.0 * u * u;
    let taper = libm::exp(-u * u * u * u * 1.1);
    let full = 1.0 + 0.17 * p.lips;
    let cupid = 1.2 * (bell((x.abs() - 5.0) / 3.5) - 0.8 * bell(x / 2.8));
    let upper = 3.6 * full * taper * bell((y - line - (4.2 * full + cupid) * taper) / 2.7);
    let lower = 4.3 * full * taper * bell((y - line + 5.2 * full * taper) / 3.5);
    let gap = -3.6 * libm::exp(-libm::pow(u * u, 4.0) * 0.6) * bell((y - line) / 1.35);
    let dimples: f64 = SIDES.map(|s| bump([x, y], [s * (half + 1.0), line - 0.5], [4.0, 3.5])).iter().sum();
    let philtrum = -1.3 * bump([x, y], [0.0, height + 13.5], [2.4, 5.0])
        + 0.7 * SIDES.map(|s| bump([x, y], [s * 5.0, height + 13.0], [1.8, 5.0])).iter().sum::<f64>();
    let below = -3.2 * bump([x, y], [0.0, height - 14.5], [15.0, 4.0]);
    let above = 2.5 * bump([x, y], [0.0, height + 14.0], [16.0, 7.0]);
    let whole = (3.0 + 1.4 * p.mouth_protrusion) * bump([x, y], [0.0, height], [21.0, 15.0]);
    upper + lower + gap - 1.4 * dimples + philtrum + above + below + whole
}

fn chin(p: &Parameters, at: [f64; 2]) -> f64 {
    let size = 1.0 + 0.08 * p.chin_size;
    (4.6 + 0.8 * p.chin_size) * bump(at, [0.0, -78.0], [15.0 * size, 8.5 * size])
}

/// Cheekbones stand out sideways, the flesh below them and the fold beside the nose forward.
fn cheeks(p: &Parameters, [x, y]: [f64; 2]) -> Vector {
    SIDES
        .iter()
        .map(|side| {
            let at = [side * x, y];
            let out = Vector::new(0.55 * side, 0.0, 0.83);
            let bone = (3.0 + 1.3 * p.cheekbones) * bump(at, [47.0, 4.0], [15.0, 10.0]);
            let flesh = -1.5 + 1.7 * p.cheeks + 1.1 * side * p.cheek_skew;
            let fold = -1.5 * bell(from_segment(at, [18.0, -20.0], [33.0, -50.0]) / 3.2);
            let pad = 2.2 * bump(at, [31.0, -14.0], [10.0, 11.0]);
            out * (bone + flesh * bump(at, [44.0, -34.0], [15.0, 17.0])) + Vector::z() * (fold + pad)
        })
        .sum()
}

/// Distance from a point to a segment.
fn from_segment([x, y]: [f64; 2], [ax, ay]: [f64; 2], [bx, by]: [f64; 2]) -> f64 {
    let (dx, dy) = (bx - ax, by - ay);
    let t = (((x - ax) * dx + (y - ay) * dy) / (dx * dx + dy * dy)).clamp(0.0, 1.0);
    let (ex, ey) = (x - ax - t * dx, y - ay - t * dy);
    (ex * ex + ey * ey).sqrt()
}
