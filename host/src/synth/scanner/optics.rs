//! Which points of the surface a camera and a projector measure together.

use super::camera::Camera;
use crate::bvh::Bvh;
use crate::mesh::{Mesh, Point, Vector, twice_area_vector};
use crate::synth::Random;

/// Cosine of 75 degrees: beyond, stripes are too blurred.
const STEEPEST: f64 = 0.258_819_045_102_520_76;
/// Cosine below which pixels begin to get lost at random.
const GRAZING: f64 = 0.42;
/// Cosine of half the angle of a highlight on shiny skin.
const HIGHLIGHT: f64 = 0.985;

/// The scene of one view: the object, its materials, the devices.
pub(super) struct Scene<'a> {
    pub mesh: &'a Mesh,
    pub normals: &'a [Vector],
    pub bvh: &'a Bvh,
    pub camera: &'a Camera,
    pub spots: &'a Spots,
}

impl Scene<'_> {
    /// Depth of a pixel, if it is measured. `luck` is uniform in [0, 1).
    pub fn measure(&self, column: u32, row: u32, luck: f64) -> Option<f64> {
        let eye = self.camera.eye();
        let sight = self.camera.to_model * self.camera.sight(column, row);
        let (depth, triangle) = self.bvh.cast(&eye, &sight, f64::INFINITY)?;
        let point = eye + sight * depth;
        let (to_camera, to_projector) =
            ((eye - point).normalize(), (self.camera.projector - point).normalize());
        let flat = twice_area_vector(&self.mesh.corners(triangle as usize)).try_normalize(0.0)?;
        let facing = flat.dot(&to_camera).min(flat.dot(&to_projector));
        let lost = facing < STEEPEST || luck * (GRAZING - STEEPEST) > facing - STEEPEST;
        let normal = self.normal(triangle, &point);
        let shiny = (to_camera + to_projector).normalize().dot(&normal) > HIGHLIGHT;
        let hidden = || self.bvh.occluded(&self.camera.projector, &point);
        (!lost && !self.spots.swallow(&point, shiny) && !hidden()).then_some(depth)
    }

    /// The normal interpolated over the triangle, so that highlights have smooth outlines.
    fn normal(&self, triangle: u32, p: &Point) -> Vector {
        let [a, b, c] = self.mesh.corners(triangle as usize);
        let [na, nb, nc] = self.mesh.triangles[triangle as usize].map(|v| self.normals[v as usize]);
        let area = |u: &Point, v: &Point| (u - p).cross(&(v - p)).norm();
        (na * area(&b, &c) + nb * area(&c, &a) + nc * area(&a, &b)).normalize()
    }
}

/// Patches of the object that reflect badly: the dark ones are never measured, the shiny ones not
/// where camera and projector see each other mirrored.
pub(super) struct Spots {
    dark: Vec<(Point, f64)>,
    shiny: Vec<(Point, f64)>,
    ripple: Vector,
}

impl Spots {
    /// A few patches at random vertices of the object.
    pub fn new(mesh: &Mesh, random: &mut Random) -> Self {
        let mut patches = |count: usize, low: f64, high: f64| -> Vec<(Point, f64)> {
            let at = |random: &mut Random| mesh.points[random.below(mesh.points.len())];
            let count = if mesh.points.is_empty() { 0 } else { count };
            (0..count).map(|_| (at(random), random.range(low, high))).collect()
        };
        let (dark, shiny) = (patches(4, 2.0, 5.0), patches(8, 14.0, 40.0));
        Self { dark, shiny, ripple: random.direction() * 0.45 }
    }

    fn swallow(&self, p: &Point, mirrored: bool) -> bool {
        // Ragged outlines: the radius varies with the place.
        let wave = |axis: usize| {
            libm::sin(self.ripple[axis] * p[axis] * 3.0 + self.ripple[(axis + 1) % 3] * p[(axis + 1) % 3])
        };
        let ragged = 1.0 + 0.3 * wave(0) * wave(1) + 0.2 * wave(2);
        let within = |(centre, radius): &(Point, f64)| (p - centre).norm() < radius * ragged;
        self.dark.iter().any(within) || mirrored && self.shiny.iter().any(within)
    }
}
