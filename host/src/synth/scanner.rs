//! A structured light scanner, simulated: camera, projector, drop-outs, noise, an unknown pose.
//!
//! A pixel is measured if camera and projector both see its point at less than 75 degrees, no
//! highlight or dark patch swallows it and its depth does not jump. The measured depths are then
//! moved by a random similarity: a scan knows nothing about the frame of the truth.

mod camera;
mod depth;
mod noise;
mod optics;
mod sheet;
#[cfg(test)]
mod tests;

use super::Random;
use crate::bvh::Bvh;
use crate::depth_view::DepthView;
use crate::mesh::{Mesh, Point, Vector};
use crate::surface::keep_triangles;
use camera::Camera;
use depth::Depths;
use nalgebra::{Isometry3, Matrix4, Similarity3, Translation3, UnitQuaternion};
use optics::{Scene, Spots};
use rayon::prelude::*;

/// Grey levels of a depth image for one millimetre.
const UNITS_PER_MM: f64 = 16.0;
/// A vertex farther than this from the scan is missing.
const MISSING_MM: f64 = 2.0;
/// Arm of the turn by which views are off.
pub const ARM_MM: f64 = 100.0;

/// Where the scanner stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// One view from the front.
    Front,
    /// One view from about 60 degrees to one side.
    Side,
    /// Three views: front, left and right, as overlapping sheets.
    Stitched,
}

/// Properties of the scanner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Width and height of the depth image.
    pub size: (u32, u32),
    /// Deviation of the noise of each pixel.
    pub noise_mm: f64,
    /// Deviation of the smooth part of the noise.
    pub smooth_noise_mm: f64,
    /// Deviation of where a further view is put beside the first one, along each axis, and of where its turn moves what is
    /// [`ARM_MM`] from the middle.
    pub registration_mm: f64,
    /// Neighbouring depths that differ by more are dropped and not joined.
    pub jump_mm: f64,
}

impl Default for Settings {
    /// 640 x 480 pixels, 0.15 mm noise, 0.1 mm smooth noise, 0.1 mm between the views, jumps of 9 mm.
    fn default() -> Self {
        Self { size: (640, 480), noise_mm: 0.15, smooth_noise_mm: 0.1, registration_mm: 0.1, jump_mm: 9.0 }
    }
}

impl Settings {
    /// The same scanner with a quarter of the pixels.
    pub fn small() -> Self {
        Self { size: (320, 240), ..Self::default() }
    }
}

/// A scan and the truth about it.
#[derive(Clone, Debug, PartialEq)]
pub struct Scan {
    /// The depth images.
    pub views: Vec<DepthView>,
    /// The views as triangulated sheets, scan frame; no triangle spans a jump.
    pub mesh: Mesh,
    /// All measured points with unit normals, scan frame.
    pub points: Mesh,
    /// The true pose: a similarity, `p_scan = M p_model`.
    pub model_to_scan: Matrix4<f64>,
    /// For each vertex of the truth: farther than 2 mm (of the model frame) from what was measured of it.
    pub missing: Vec<bool>,
}

/// Scans `truth` (model frame, millimetres). The same seed gives the same scan, whatever the
/// number of threads. A mesh without triangles gives an empty scan.
pub fn scan(truth: &Mesh, kind: Kind, settings: &Settings, seed: u64) -> Scan {
    scan_among(truth, &Mesh::default(), kind, settings, seed)
}

/// Scans `truth` among other things, which are seen with it and hide parts of it.
pub fn scan_among(truth: &Mesh, others: &Mesh, kind: Kind, settings: &Settings, seed: u64) -> Scan {
    let mut random = Random::new(seed, 0);
    let pose = pose(&mut random);
    let mut all = truth.clone();
    all.append(others);
    let (bvh, normals, spots) = (Bvh::new(&all), all.vertex_normals(), Spots::new(truth, &mut random));
    let middle = truth.bounds().map_or_else(Point::origin, |(low, high)| nalgebra::center(&low, &high));
    let mut view = |(yaw_deg, stream): (f64, u64)| {
        let camera = Camera::looking(middle, yaw_deg, settings.size, &mut random);
        let scene = Scene { mesh: &all, normals: &normals, bvh: &bvh, camera: &camera, spots: &spots };
        let depths = Depths::measure(&scene, settings, seed, stream << 32);
        let off = if stream == 1 { Isometry3::identity() } else { misplaced(middle, settings, seed, stream) };
        view_of(&camera, &depths, &(pose * off))
    };
    let views: Vec<DepthView> = yaws(kind, seed).into_iter().zip(1..).map(&mut view).collect();
    assemble((truth, others), views, &pose, settings.jump_mm)
}

/// Degrees to the subject's left.
fn yaws(kind: Kind, seed: u64) -> Vec<f64> {
    let side = if Random::new(seed, 1).unit() < 0.5 { -1.0 } else { 1.0 };
    match kind {
        Kind::Front => vec![0.0],
        Kind::Side => vec![60.0 * side],
        Kind::Stitched => vec![0.0, 60.0, -60.0],
    }
}

/// By how much a further view is not where it belongs.
fn misplaced(middle: Point, settings: &Settings, seed: u64, stream: u64) -> Isometry3<f64> {
    let mut random = Random::new(seed, 1 + stream);
    let mut vector = |deviation: f64| Vector::from_fn(|_, _| deviation * random.normal());
    let shift = vector(settings.registration_mm);
    let turn = UnitQuaternion::from_scaled_axis(vector(settings.registration_mm / ARM_MM));
    Translation3::from(shift) * Isometry3::rotation_wrt_point(turn, middle)
}

/// Uniformly random rotation, a shift of some decimetres, scale 0.9 to 1.1.
fn pose(random: &mut Random) -> Similarity3<f64> {
    let rotation = random.rotation();
    let shift = Vector::from_fn(|_, _| 120.0 * random.normal());
    Similarity3::from_parts(Translation3::from(shift), rotation, random.range(0.9, 1.1))
}

fn view_of(camera: &Camera, depths: &Depths, pose: &Similarity3<f64>) -> DepthView {
    let (cx, cy) = camera.centre();
    DepthView {
        depth: depths.quantised(),
        width: camera.width as usize,
        height: camera.height as usize,
        fx: camera.f,
        fy: camera.f,
        cx,
        cy,
        unit_mm: 1.0 / UNITS_PER_MM,
        camera_to_scan: (pose * camera.to_model).to_homogeneous(),
    }
}

fn assemble(
    (truth, others): (&Mesh, &Mesh),
    views: Vec<DepthView>,
    pose: &Similarity3<f64>,
    jump_mm: f64,
) -> Scan {
    let (mut mesh, mut points) = (Mesh::default(), Mesh::default());
    for view in &views {
        let sheet = sheet::sheet(view, jump_mm);
        points.append(&sheet::cloud(&sheet));
        // Without vertices that no triangle has.
        mesh.append(&keep_triangles(&sheet, |_| true));
    }
    let missing = if others.triangles.is_empty() {
        missing(truth, &mesh, pose)
    } else {
        missing(truth, &of_truth(&mesh, (truth, others), pose), pose)
    };
    Scan { views, mesh, points, model_to_scan: pose.to_homogeneous(), missing }
}

/// The part of the measured surface that is nearer to the truth than to other things.
fn of_truth(measured: &Mesh, (truth, others): (&Mesh, &Mesh), pose: &Similarity3<f64>) -> Mesh {
    let (back, surfaces) = (pose.inverse(), [Bvh::new(others), Bvh::new(truth)]);
    let is_other = |p: &Point| {
        let [other, truth] = surfaces.each_ref().map(|of| of.closest(&(back * p), f64::INFINITY));
        other.is_some_and(|other| truth.is_none_or(|truth| other.squared_distance < truth.squared_distance))
    };
    let others: Vec<bool> = measured.points.par_iter().map(is_other).collect();
    keep_triangles(measured, |t| measured.triangles[t].iter().all(|&v| !others[v as usize]))
}

fn missing(truth: &Mesh, mesh: &Mesh, pose: &Similarity3<f64>) -> Vec<bool> {
    let bvh = Bvh::new(mesh);
    let reach = MISSING_MM * pose.scaling();
    truth.points.par_iter().map(|p| bvh.closest(&(pose * p), reach).is_none()).collect()
}
