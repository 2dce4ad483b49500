//! Face-like heads: an open surface from hairline to neck, from ear to ear.
//!
//! A base of cross-sections (`skull`), displaced by features (`features`) and ears (`ear`),
//! then brought to its proportions. [`Parameters`] say how one head differs from another. Every
//! head has a triangulation of its own: nothing can be learnt from the order of its vertices.

mod curve;
mod ear;
mod features;
mod parameters;
mod relief;
mod skull;
#[cfg(test)]
mod tests;

pub use parameters::Parameters;

use super::random::Random;
use super::tessellate::{Surface, tessellate};
use crate::mesh::{Mesh, Point};
use curve::bump;
use ear::Ear;
use relief::Relief;

/// Middle height and half height of the part of the head that is modelled.
const HEIGHTS: (f64, f64) = (-8.0, 114.0);
/// Half the azimuth it covers.
const HALF_ANGLE: f64 = 1.86;
/// Corners sampled along the rim before they are spaced evenly.
const RIM: usize = 2000;

/// One member of the class.
#[derive(Clone, Debug)]
pub struct Head {
    parameters: Parameters,
    relief: Option<Relief>,
    rim: [f64; 8],
    tessellation: u64,
}

impl Head {
    /// Member `index` of the class `seed`: its parameters, its rim and its triangulation.
    pub fn sample(seed: u64, index: u64) -> Self {
        let mut random = Random::new(seed, index);
        let parameters = Parameters::draw(&mut random);
        let rim = [(); 8].map(|()| random.normal());
        Self { parameters, relief: None, rim, tessellation: (random.unit() * 1e15) as u64 }
    }

    /// The head with these parameters; `tessellation` picks one of its triangulations.
    pub fn with_parameters(parameters: Parameters, tessellation: u64) -> Self {
        Self { parameters, relief: None, rim: [0.0; 8], tessellation }
    }

    /// The same head with smooth bumps that no parameter explains, for tests off the model.
    /// Up to about 1 mm RMS the surface stays free of cuts.
    pub fn with_relief(self, rms_mm: f64, seed: u64) -> Self {
        Self { relief: Some(Relief::new(rms_mm, seed)), ..self }
    }

    /// What this head was made from.
    pub fn parameters(&self) -> &Parameters {
        &self.parameters
    }

    /// The surface: one component, one boundary loop, manifold, outward winding, 8 to 16 thousand
    /// triangles, finer at eyes, nose, mouth and ears than elsewhere.
    pub fn mesh(&self) -> Mesh {
        let mut random = Random::new(self.tessellation, 0);
        let coarseness = random.range(1.04, 1.22);
        let surface =
            Surface { position: |at| self.position(at), edge_mm: |at| coarseness * self.edge_mm(at) };
        tessellate(&surface, &self.outline(), &mut random)
    }

    /// The surface at `at`, two coordinates in millimetres: arc from the midline, height.
    fn position(&self, at: [f64; 2]) -> Point {
        let (angle, y) = (at[0] / ARC, at[1]);
        let base = skull::base(angle, y);
        let mut moved = base + features::displacement(&self.parameters, &base);
        for side in [1.0, -1.0] {
            moved += Ear::new(&self.parameters, side).displacement(angle, y);
        }
        let point = skull::proportion(&self.parameters, moved);
        self.relief.as_ref().map_or(point, |relief| relief.apply(point))
    }

    /// The length an edge should have here.
    fn edge_mm(&self, at: [f64; 2]) -> f64 {
        let [x, y] = [at[0].abs(), at[1]];
        let eye = bump([x, y], [32.0, 24.0], [16.0, 11.0]);
        let nose = bump([x, y], [0.0, -14.0], [18.0, 16.0]);
        let mouth = bump([x, y], [0.0, -47.0], [26.0, 12.0]);
        let side = f64::from(at[0] > 0.0) * 2.0 - 1.0;
        let (s, t) = Ear::new(&self.parameters, side).place(at[0] / ARC, y);
        let ear = bump([s, t], [0.0, 0.0], [1.0, 0.9]);
        4.5 - 2.1 * (eye + nose + mouth + ear).min(1.0)
    }

    /// The rim, counter-clockwise, evenly spaced: a rounded rectangle with a few slow waves.
    fn outline(&self) -> Vec<[f64; 2]> {
        let dense: Vec<[f64; 2]> = (0..RIM).map(|i| self.rim_at(i as f64 / RIM as f64)).collect();
        let points: Vec<Point> = dense.iter().map(|&at| self.position(at)).collect();
        let mut outline = vec![];
        let mut walked = f64::INFINITY;
        for i in 0..RIM {
            if walked >= 0.85 * self.edge_mm(dense[i]) {
                outline.push(dense[i]);
                walked = 0.0;
            }
            walked += (points[(i + 1) % RIM] - points[i]).norm();
        }
        if walked < 0.4 * self.edge_mm(dense[0]) {
            outline.pop();
        }
        outline
    }

    fn rim_at(&self, turn: f64) -> [f64; 2] {
        let angle = std::f64::consts::TAU * turn;
        let (cos, sin) = (libm::cos(angle), libm::sin(angle));
        let corner = libm::pow(libm::pow(cos.abs(), 6.0) + libm::pow(sin.abs(), 6.0), -1.0 / 6.0);
        let wave = |k: usize| {
            let phase = (k + 2) as f64 * angle;
            self.rim[2 * k] * libm::cos(phase) + self.rim[2 * k + 1] * libm::sin(phase)
        };
        let r = corner * (1.0 + 0.007 * (0..4).map(wave).sum::<f64>());
        [HALF_ANGLE * ARC * r * cos, HEIGHTS.0 + HEIGHTS.1 * r * sin]
    }
}

/// Millimetres of the first surface coordinate for one radian of azimuth.
const ARC: f64 = 80.0;
