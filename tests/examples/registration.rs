//! How surely and how fast scans are registered: `cargo run --release -p lacuna-tests --example registration`.
//!
//! Twelve scans in `../shared/data` (nine of faces, two of femurs, and a real head with collar and hair) are turned
//! any way, moved and scaled so that they are 0.8 to 1.25 times the class's size, and registered without a hint. A
//! pose counts as found when it is where the refinement from the known pose ends: that of the simulated scanner, of
//! the whole bone's registration, or of five landmarks. `--poses N` changes the number of poses, `--only NAME` keeps
//! the scans whose name begins so, `--open3d PYTHON` adds Open3D's RANSAC over FPFH features with scale,
//! run by a Python interpreter that has the `open3d` package.

use lacuna::Model;
use lacuna_host::io;
use lacuna_host::mesh::{Mesh, Point};
use lacuna_host::register::icp::similarity;
use lacuna_host::register::{Placed, refine_hint, register};
use lacuna_tests::real_data;
use lacuna_tests::registration::{Difference, Way, cpu_seconds, moved, similarity_of};
use lacuna_tests::sample::real;
use lacuna_tests::trained::{faces, femurs};
use nalgebra::Similarity3;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Vertices (by landmark) of the mean face that the real head's five landmarks correspond to: inner corners of the
/// eyes, tip of the nose, corners of the mouth.
const FIVE: [usize; 5] = [39, 42, 30, 48, 54];

struct Subject {
    name: String,
    class: usize,
    scan: Mesh,
    /// From the scan to the model's voxels, after refinement.
    truth: Similarity3<f64>,
}

/// What became of one pose.
struct Trial {
    subject: usize,
    difference: Difference,
    inliers: f64,
    runner_up: f64,
    seconds: f64,
    cpu: f64,
}

fn main() {
    let options = Options::parse();
    let (Some(face_data), Some(scans), Some(bones)) =
        (real_data("faces"), real_data("scans"), real_data("femurs"))
    else {
        return;
    };
    let bytes = [faces(&face_data), femurs(&bones)];
    let models = bytes.each_ref().map(|bytes| Model::from_bytes(bytes).expect("a model"));
    let mut subjects = subjects(&models, &face_data, &scans);
    subjects.retain(|subject| subject.name.starts_with(&options.only));
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let ways: Vec<(usize, Way)> = (0..options.poses).map(|i| (i % subjects.len(), Way::random(&mut random))).collect();
    let trials: Vec<Trial> = ways.iter().map(|(i, way)| trial(&models, &subjects, *i, way)).collect();
    table("Lacuna", &subjects, &trials);
    if let Some(python) = &options.open3d {
        open3d(python, &models, &subjects, &ways);
    }
}

struct Options {
    poses: usize,
    only: String,
    open3d: Option<PathBuf>,
}

impl Options {
    fn parse() -> Self {
        let arguments: Vec<String> = std::env::args().collect();
        let value = |name: &str| arguments.iter().position(|a| a == name).and_then(|at| arguments.get(at + 1));
        Self {
            poses: value("--poses").map_or(200, |text| text.parse().expect("a number of poses")),
            only: value("--only").cloned().unwrap_or_default(),
            open3d: value("--open3d").map(PathBuf::from),
        }
    }
}

fn subjects(models: &[Model<'_>; 2], faces: &Path, scans: &Path) -> Vec<Subject> {
    let names = (0..3).flat_map(|t| ["front", "side", "stitched"].map(|kind| format!("target_{t:02}_{kind}")));
    let mut all: Vec<Subject> = names.map(|name| face(&models[0], &scans.join(name))).collect();
    for name in ["femur_target_00_side", "femur_target_01_fragment"] {
        all.push(femur(&models[1], &scans.join(name)));
    }
    all.push(real_head(&models[0], faces));
    all
}

/// The subject with the pose in which a refinement from `rough` ends.
fn subject(name: String, class: usize, model: &Model<'_>, scan: Mesh, rough: &Placed) -> Subject {
    let found = refine_hint(model, &scan, rough).expect("a pose");
    println!("{name}: {:.1} % inliers at the known pose", 100.0 * found.inliers);
    Subject { name, class, scan, truth: similarity_of(&found.placed) }
}

fn face(model: &Model<'_>, folder: &Path) -> Subject {
    let sample = real(folder);
    let scan_to_model = sample.model_to_scan.try_inverse().expect("a similarity");
    let rough = placed(model, &nalgebra::convert_unchecked(scan_to_model));
    subject(sample.name, 0, model, sample.scan, &rough)
}

/// A bone's scan is where the whole bone is.
fn femur(model: &Model<'_>, folder: &Path) -> Subject {
    let sample = real(folder);
    let whole = register(model, &sample.truth, 1).expect("the whole bone's pose");
    let scan_to_whole: Similarity3<f64> =
        nalgebra::convert_unchecked(sample.model_to_scan.try_inverse().expect("a similarity"));
    let rough = placed_at(&(similarity_of(&whole.placed) * scan_to_whole));
    subject(sample.name, 1, model, sample.scan, &rough)
}

fn real_head(model: &Model<'_>, faces: &Path) -> Subject {
    let read = |path: &str| -> Value {
        serde_json::from_str(&std::fs::read_to_string(faces.join(path)).expect("landmarks")).expect("JSON")
    };
    let five: [[f64; 3]; 5] =
        serde_json::from_value(read("targets_real/demoface_landmarks.json")["xyz"].clone()).expect("landmarks");
    let index: Vec<usize> = serde_json::from_value(read("landmarks68.json")["index"].clone()).expect("indices");
    let mean = io::read(&faces.join("ict_mean.ply")).expect("the mean face");
    // Twice, because a similarity wants eight pairs.
    let pairs: Vec<(Point, Point)> =
        (0..10).map(|i| (Point::from(five[i % 5]), mean.points[index[FIVE[i % 5]]])).collect();
    let rough = placed(model, &similarity(&pairs).expect("five landmarks"));
    let scan = io::read(&faces.join("targets_real/demoface_raw.ply")).expect("the real head");
    subject("demoface_raw".into(), 0, model, scan, &rough)
}

/// A similarity to the frame of the training shapes, as a pose.
fn placed(model: &Model<'_>, to_shapes: &Similarity3<f64>) -> Placed {
    let header = model.header();
    let to_voxels = Similarity3::from_scaling(1.0 / f64::from(header.spacing))
        * nalgebra::Translation3::from(-nalgebra::Vector3::from(header.origin).map(f64::from));
    placed_at(&(to_voxels * to_shapes))
}

fn placed_at(to_voxels: &Similarity3<f64>) -> Placed {
    lacuna_tests::registration::placed(to_voxels)
}

fn trial(models: &[Model<'_>; 2], subjects: &[Subject], index: usize, way: &Way) -> Trial {
    let subject = &subjects[index];
    let (scan, motion) = moved(&subject.scan, way, &subject.truth, &models[subject.class]);
    let (start, cpu) = (Instant::now(), cpu_seconds());
    let found = register(&models[subject.class], &scan, 1);
    let (seconds, cpu) = (start.elapsed().as_secs_f64(), cpu_seconds() - cpu);
    let (difference, inliers, runner_up) = found.map_or((Difference::NONE, 0.0, 0.0), |found| {
        let there = similarity_of(&found.placed) * motion;
        (Difference::between(&there, &subject.truth, &models[subject.class]), found.inliers, found.runner_up)
    });
    if !difference.same() {
        println!(
            "{}: {:.1} degrees, {:.1} mm, {:.1} % off; inliers {:.3}, runner-up {:.3}",
            subject.name, difference.degrees, difference.millimetres, 100.0 * difference.growth, inliers, runner_up
        );
    }
    Trial { subject: index, difference, inliers, runner_up, seconds, cpu }
}

fn table(who: &str, subjects: &[Subject], trials: &[Trial]) {
    println!("\n| {who} | same optimum | degrees, median and worst of those | inliers, runner-up, medians | seconds, median | processor seconds, median |");
    println!("|---|---|---|---|---|---|");
    for (index, subject) in subjects.iter().enumerate() {
        row(&subject.name, &trials.iter().filter(|trial| trial.subject == index).collect::<Vec<_>>());
    }
    row("all", &trials.iter().collect::<Vec<_>>());
}

fn row(name: &str, trials: &[&Trial]) {
    let same: Vec<f64> =
        trials.iter().filter(|t| t.difference.same()).map(|t| t.difference.degrees).collect();
    let all = |pick: fn(&Trial) -> f64| median(trials.iter().map(|t| pick(t)).collect());
    println!(
        "| {name} | {} of {} | {:.2}, {:.2} | {:.3}, {:.3} | {:.3} | {:.3} |",
        same.len(),
        trials.len(),
        median(same.clone()),
        same.iter().copied().fold(0.0, f64::max),
        all(|t| t.inliers),
        all(|t| t.runner_up),
        all(|t| t.seconds),
        all(|t| t.cpu)
    );
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

fn open3d(_python: &Path, _models: &[Model<'_>; 2], _subjects: &[Subject], _ways: &[(usize, Way)]) {
    todo!()
}
