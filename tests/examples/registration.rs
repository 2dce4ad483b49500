//! How surely and how fast scans are registered: `cargo run --release -p lacuna-tests --example registration`.
//!
//! Twelve scans in `../shared/data` (nine of faces, two of femurs, and a real head with collar and hair) are turned
//! any way, moved and scaled so that they are 0.8 to 1.25 times the class's size, and registered without a hint. A
//! pose counts as found when it is where the refinement of the same scan from the known pose ends: that of the simulated
//! scanner, of the whole bone's registration, or of five landmarks. `--poses N` changes the number of poses, `--only NAME` keeps
//! the scans whose name begins so, `--export DIR` writes the scans in their poses with what is known, for
//! `registration_open3d.py` beside this file, which registers them by Open3D's RANSAC over FPFH features with scale.

use lacuna::Model;
use lacuna_host::fit::dense;
use lacuna_host::io;
use lacuna_host::mesh::{Mesh, Point};
use lacuna_host::quantile::median;
use lacuna_host::register::umeyama::similarity;
use lacuna_host::register::{refine_hint, register};
use lacuna_host::surface::{Volume, marching_cubes};
use lacuna_tests::nine::nine_names;
use lacuna_tests::real_data;
use lacuna_tests::registration::{
    Difference, Way, cpu_seconds, moved, placed as at, similarity_of, to_voxels,
};
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
    /// From the scan to the model's voxels, as far as it is known.
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
    let names: Vec<String> = subjects.iter().map(|subject| subject.name.clone()).collect();
    subjects.retain(|subject| subject.name.starts_with(&options.only));
    assert!(!subjects.is_empty(), "--only {}: there are {}", options.only, names.join(", "));
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let ways: Vec<(usize, Way)> =
        (0..options.poses).map(|i| (i % subjects.len(), Way::random(&mut random))).collect();
    let trials: Vec<Trial> = ways.iter().map(|(i, way)| trial(&models, &subjects, *i, way)).collect();
    table(&subjects, &trials);
    if let Some(folder) = &options.export {
        export(folder, &models, &subjects, &ways);
    }
}

struct Options {
    poses: usize,
    only: String,
    export: Option<PathBuf>,
}

impl Options {
    fn parse() -> Self {
        let arguments: Vec<String> = std::env::args().collect();
        let value =
            |name: &str| arguments.iter().position(|a| a == name).and_then(|at| arguments.get(at + 1));
        Self {
            poses: value("--poses").map_or(200, |text| text.parse().expect("a number of poses")),
            only: value("--only").cloned().unwrap_or_default(),
            export: value("--export").map(PathBuf::from),
        }
    }
}

fn subjects(models: &[Model<'_>; 2], faces: &Path, scans: &Path) -> Vec<Subject> {
    let mut all: Vec<Subject> = nine_names().map(|name| face(&models[0], &scans.join(name))).collect();
    for name in ["femur_target_00_side", "femur_target_01_fragment"] {
        all.push(femur(&models[1], &scans.join(name)));
    }
    all.push(real_head(&models[0], faces));
    all
}

fn face(model: &Model<'_>, folder: &Path) -> Subject {
    let sample = real(folder);
    let truth = to_voxels(model, &nalgebra::convert_unchecked(sample.scan_to_model()));
    Subject { name: sample.name, class: 0, scan: sample.scan, truth }
}

/// A bone's scan is where the whole bone is.
fn femur(model: &Model<'_>, folder: &Path) -> Subject {
    let sample = real(folder);
    let whole = register(model, &sample.truth, 1).expect("the whole bone's pose");
    let scan_to_whole: Similarity3<f64> = nalgebra::convert_unchecked(sample.scan_to_model());
    let truth = similarity_of(&whole.placed) * scan_to_whole;
    Subject { name: sample.name, class: 1, scan: sample.scan, truth }
}

fn real_head(model: &Model<'_>, faces: &Path) -> Subject {
    let read = |path: &str| -> Value {
        serde_json::from_str(&std::fs::read_to_string(faces.join(path)).expect("landmarks")).expect("JSON")
    };
    let five: [[f64; 3]; 5] =
        serde_json::from_value(read("targets_real/demoface_landmarks.json")["xyz"].clone())
            .expect("landmarks");
    let index: Vec<usize> =
        serde_json::from_value(read("landmarks68.json")["index"].clone()).expect("indices");
    let mean = io::read(&faces.join("ict_mean.ply")).expect("the mean face");
    // Twice, because a similarity wants eight pairs.
    let pairs: Vec<(Point, Point)> =
        (0..10).map(|i| (Point::from(five[i % 5]), mean.points[index[FIVE[i % 5]]])).collect();
    let truth = to_voxels(model, &similarity(&pairs).expect("five landmarks"));
    let scan = io::read(&faces.join("targets_real/demoface_raw.ply")).expect("the real head");
    Subject { name: "demoface_raw".into(), class: 0, scan, truth }
}

fn trial(models: &[Model<'_>; 2], subjects: &[Subject], index: usize, way: &Way) -> Trial {
    let subject = &subjects[index];
    let model = &models[subject.class];
    let (scan, motion) = moved(&subject.scan, way, &subject.truth, model);
    let (start, cpu) = (Instant::now(), cpu_seconds());
    let found = register(model, &scan, 1);
    let (seconds, cpu) = (start.elapsed().as_secs_f64(), cpu_seconds() - cpu);
    let known = refine_hint(model, &scan, &at(&(subject.truth * motion.inverse()))).expect("a pose");
    let (difference, inliers, runner_up) = found.map_or((Difference::NONE, 0.0, 0.0), |found| {
        let [there, known] = [found.placed, known.placed].map(|placed| similarity_of(&placed));
        (Difference::between(&there, &known, model), found.inliers, found.runner_up)
    });
    if !difference.same() {
        println!(
            "{}: {:.1} degrees, {:.1} mm, {:.1} % off; inliers {:.3}, runner-up {:.3}",
            subject.name,
            difference.degrees,
            difference.millimetres,
            100.0 * difference.growth,
            inliers,
            runner_up
        );
    }
    Trial { subject: index, difference, inliers, runner_up, seconds, cpu }
}

fn table(subjects: &[Subject], trials: &[Trial]) {
    println!(
        "\n| scan | same optimum | degrees off, median and worst | mm off | inliers, runner-up, medians | seconds, median | processor seconds, median |"
    );
    println!("|---|---|---|---|---|---|---|");
    for (index, subject) in subjects.iter().enumerate() {
        row(&subject.name, &trials.iter().filter(|trial| trial.subject == index).collect::<Vec<_>>());
    }
    row("all", &trials.iter().collect::<Vec<_>>());
}

fn row(name: &str, trials: &[&Trial]) {
    let same: Vec<&&Trial> = trials.iter().filter(|t| t.difference.same()).collect();
    let of_same =
        |pick: fn(&Difference) -> f64| -> Vec<f64> { same.iter().map(|t| pick(&t.difference)).collect() };
    let spread = |values: Vec<f64>| {
        [median(values.clone()).unwrap_or(f64::NAN), values.into_iter().fold(0.0, f64::max)]
    };
    let [degrees, worst] = spread(of_same(|d| d.degrees));
    let [millimetres, farthest] = spread(of_same(|d| d.millimetres));
    let all = |pick: fn(&Trial) -> f64| median(trials.iter().map(|t| pick(t)).collect()).unwrap_or(f64::NAN);
    println!(
        "| {name} | {} of {} | {degrees:.2}, {worst:.2} | {millimetres:.2}, {farthest:.2} | {:.3}, {:.3} | {:.3} | {:.3} |",
        same.len(),
        trials.len(),
        all(|t| t.inliers),
        all(|t| t.runner_up),
        all(|t| t.seconds),
        all(|t| t.cpu)
    );
}

/// Writes the scans in their poses, and `poses.json` with what the model looks like and where each of them is.
fn export(folder: &Path, models: &[Model<'_>; 2], subjects: &[Subject], ways: &[(usize, Way)]) {
    std::fs::create_dir_all(folder).expect("a folder");
    let write = |name: &str, mesh: &Mesh| {
        io::write_ply(&folder.join(name), &io::PlyOut::new(mesh)).expect("a mesh that can be written");
    };
    let mut trials = Vec::new();
    for (number, (index, way)) in ways.iter().enumerate() {
        let subject = &subjects[*index];
        let model = &models[subject.class];
        let (scan, motion) = moved(&subject.scan, way, &subject.truth, model);
        let known = refine_hint(model, &scan, &at(&(subject.truth * motion.inverse()))).expect("a pose");
        let rows = |motion: &Similarity3<f64>| motion.to_homogeneous().transpose().as_slice().to_vec();
        let name = format!("scan_{number:03}.ply");
        write(&name, &scan);
        trials.push(serde_json::json!({
            "scan": name,
            "subject": subject.name,
            "class": subject.class,
            "scan_to_voxels": rows(&similarity_of(&known.placed)),
            "shapes_to_voxels": rows(&to_voxels(model, &Similarity3::identity())),
            "voxels_per_unit": 1.0 / f64::from(model.header().spacing),
        }));
    }
    for (class, model) in models.iter().enumerate() {
        write(&format!("class_{class}.ply"), &mean_surface(model));
    }
    let millimetre = models.each_ref().map(|model| model.header().scales.millimetre);
    let text = serde_json::json!({ "trials": trials, "voxels_per_class_millimetre": millimetre }).to_string();
    io::atomic::write(&folder.join("poses.json"), |file| file.write_all(text.as_bytes()))
        .expect("poses.json");
}

fn mean_surface(model: &Model<'_>) -> Mesh {
    let mut means = vec![0i16; model.voxels()];
    for brick in model.bricks() {
        (0..brick.voxels()).for_each(|voxel| means[brick.first + voxel] = brick.mean(voxel));
    }
    let values = dense(model, &means);
    marching_cubes(
        &Volume { dims: model.grid().sides().map(usize::from), values: &values },
        &Point::origin(),
        1.0,
    )
}
