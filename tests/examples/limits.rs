//! What limits the missing part: `cargo run --release -p lacuna-tests --example limits`.
//!
//! The faces 03 to 09 of `../shared/data/faces/targets`, which none of the nine scans shows, are scanned from the front and
//! from the side by the simulated scanner and completed with 30 and with 90 shapes. Root mean square distance of what was
//! not seen, in three ways:
//!
//! - as users have it, in an unknown pose;
//! - in the pose in which the whole face, of which the scan shows half, lies nearest to the mean: without the pose's error;
//! - by the model of eq. (2), which knows the correspondences, from the distances of the true vertices along the true
//!   normals, in an unknown pose: what a linear model makes of what was seen if it need not find what corresponds.
//!   (The faces are samples of a linear model with 100 modes, so with 90 shapes it is nearly the model that made them.)
//!
//! Four minutes on two processors; `--shapes N` takes N shapes only.

use lacuna::{Fixed, Model};
use lacuna_host::complete::{GivenPose, Options, complete};
use lacuna_host::correspondence::Correspondence;
use lacuna_host::io::read;
use lacuna_host::mesh::{Mesh, Point, Vector};
use lacuna_host::quantile::median;
use lacuna_host::register::Placed;
use lacuna_host::register::umeyama::similarity;
use lacuna_host::synth::{Kind, ScannerSettings, scan};
use lacuna_host::train::align::{Align, align};
use lacuna_host::train::{Settings, train};
use lacuna_tests::real_data;
use lacuna_tests::sample::Sample;
use lacuna_tests::trained::training_faces;
use nalgebra::{DMatrix, DVector, Similarity3, Translation3, UnitQuaternion};
use std::path::Path;

/// Targets that none of the nine scans shows.
const TARGETS: std::ops::RangeInclusive<u64> = 3..=9;
/// Pose unknowns: turn, growth, shift.
const POSE: usize = 7;
/// Gauss-Newton steps; the last ones move nothing.
const STEPS: usize = 10;

fn main() {
    let Some(faces) = real_data("faces") else { return };
    for count in counts() {
        let shapes: Vec<Mesh> = training_faces(&faces.join("train"), 0..count)
            .iter()
            .map(|path| read(path).expect("a training shape"))
            .collect();
        let together = align(&shapes, Align::Auto, 1, &|_, _| ()).expect("aligned").shapes;
        let mean = mean(&together);
        // How far the shapes' own poses lay apart is left out: a pose that is given is held.
        let settings = Settings { spacing: Some(3.3), ..Settings::default() };
        let bytes = train(&together, &settings, &|_, _| ()).expect("a model");
        let model = Model::from_bytes(&bytes).expect("a model");
        let linear = Correspondence::train(&together.iter().collect::<Vec<_>>()).expect("a model");
        let unexplained = unexplained(&linear, &faces);
        println!("\n| {count} shapes | as users have it | pose of the whole face | correspondences known |");
        println!("|---|---|---|---|");
        for kind in [Kind::Front, Kind::Side] {
            let rows = TARGETS.map(|number| {
                let sample = scanned(&faces, number, kind);
                let row = [
                    completed(&model, &sample, GivenPose::None),
                    in_the_whole_ones_pose(&model, &sample, &mean),
                    sample.rms_mm(&in_scan(&explained(&linear, &sample, unexplained), &sample), |v| {
                        sample.missing[v]
                    }),
                ];
                tell(&sample.name, row);
                row
            });
            let rows: Vec<[f64; 3]> = rows.collect();
            let middle = |i: usize| median(rows.iter().map(|row| row[i]).collect()).expect("scans");
            tell(&format!("{kind:?}, median").to_lowercase(), [0, 1, 2].map(middle));
        }
    }
}

fn counts() -> Vec<usize> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        [] => vec![30, 90],
        ["--shapes", count] => vec![count.parse().expect("a number")],
        _ => panic!("usage: limits [--shapes N]"),
    }
}

fn tell(name: &str, row: [f64; 3]) {
    let [a, b, c] = row.map(|mm| format!("{mm:.2}"));
    println!("| {name} | {a} | {b} | {c} |");
}

fn target(faces: &Path, number: u64) -> Mesh {
    read(&faces.join(format!("targets/target_{number:02}.ply"))).expect("a target")
}

/// Mean of shapes whose vertices correspond.
fn mean(shapes: &[Mesh]) -> Vec<Point> {
    let at =
        |v: usize| shapes.iter().map(|shape| shape.points[v].coords).sum::<Vector>() / shapes.len() as f64;
    (0..shapes[0].points.len()).map(|v| at(v).into()).collect()
}

/// Deviation of a coordinate of the targets from what the model can approximate of them.
fn unexplained(model: &Correspondence, faces: &Path) -> f64 {
    let squared = |number: u64| {
        let truth = target(faces, number);
        let found = model.approximate(&truth, true).expect("a target of the class");
        let squares = truth.points.iter().zip(&found.points).map(|(p, q)| (p - q).norm_squared());
        squares.sum::<f64>() / (3 * truth.points.len()) as f64
    };
    (TARGETS.map(squared).sum::<f64>() / TARGETS.count() as f64).sqrt()
}

fn scanned(faces: &Path, number: u64, kind: Kind) -> Sample {
    let truth = target(faces, number);
    let made = scan(&truth, kind, &ScannerSettings::default(), number);
    let name = format!("target {number:02} {kind:?}").to_lowercase();
    let (scan, missing, model_to_scan) = (made.mesh, made.missing, made.model_to_scan);
    Sample { name, truth, scan, missing, model_to_scan }
}

fn completed(model: &Model<'_>, sample: &Sample, pose: GivenPose) -> f64 {
    let options = Options { pose, ..Options::of(model) };
    let completion = complete::<Fixed>(model, &sample.scan, &options).expect("a completion");
    sample.rms_mm(&completion.merged.mesh, |v| sample.missing[v])
}

/// In the pose in which the whole shape lies nearest to the mean.
fn in_the_whole_ones_pose(model: &Model<'_>, sample: &Sample, mean: &[Point]) -> f64 {
    let truth = in_scan(&sample.truth, sample);
    let pairs: Vec<(Point, Point)> = truth.points.iter().copied().zip(mean.iter().copied()).collect();
    let motion = similarity(&pairs).expect("a similarity");
    let rotation = motion.isometry.rotation.to_rotation_matrix().into_inner();
    let placed = Placed::new(model, &rotation, motion.scaling(), &motion.isometry.translation.vector);
    completed(model, sample, GivenPose::Exact(placed))
}

/// A mesh in the model's frame, in the scan's.
fn in_scan(mesh: &Mesh, sample: &Sample) -> Mesh {
    let points = mesh.points.iter().map(|p| sample.model_to_scan.transform_point(p)).collect();
    Mesh { points, ..mesh.clone() }
}

fn moved(mesh: &Mesh, motion: &Similarity3<f64>) -> Mesh {
    Mesh { points: mesh.points.iter().map(|p| motion * p).collect(), ..mesh.clone() }
}

/// The shape and pose that explain best how far the vertices that were seen lie off along their normals: the likeliest
/// ones if weights are normal and distances off by what the model leaves `unexplained`.
fn explained(model: &Correspondence, sample: &Sample, unexplained: f64) -> Mesh {
    let (modes, normals) = (model.modes(), sample.truth.vertex_normals());
    let seen: Vec<usize> = (0..normals.len()).filter(|&v| !sample.missing[v]).collect();
    let still = DVector::zeros(modes);
    let mean = model.instance(&still);
    let mode = |k: usize| {
        let mut one = still.clone();
        one[k] = 1.0;
        let points = model.instance(&one).points;
        points.iter().zip(&mean.points).map(|(p, m)| p - m).collect::<Vec<Vector>>()
    };
    let axes: Vec<Vec<Vector>> = (0..modes).map(mode).collect();
    let centre = mean.points.iter().map(|p| p.coords).sum::<Vector>() / mean.points.len() as f64;
    let (mut weights, mut motion) = (still, Similarity3::identity());
    for _ in 0..STEPS {
        let shape = moved(&model.instance(&weights), &motion);
        let mut rows = DMatrix::zeros(seen.len(), POSE + modes);
        let mut off = DVector::zeros(seen.len());
        for (i, &v) in seen.iter().enumerate() {
            let (normal, point) = (normals[v], shape.points[v]);
            let arm = point.coords - centre;
            rows.fixed_view_mut::<1, 3>(i, 0).tr_copy_from(&arm.cross(&normal));
            rows[(i, 3)] = arm.dot(&normal);
            rows.fixed_view_mut::<1, 3>(i, 4).tr_copy_from(&normal);
            for (k, axis) in axes.iter().enumerate() {
                rows[(i, POSE + k)] = normal.dot(&(motion * axis[v]));
            }
            off[i] = normal.dot(&(sample.truth.points[v] - point));
        }
        let mut matrix = rows.tr_mul(&rows) / unexplained.powi(2);
        let mut vector = rows.tr_mul(&off) / unexplained.powi(2);
        for k in 0..modes {
            matrix[(POSE + k, POSE + k)] += 1.0;
            vector[POSE + k] -= weights[k];
        }
        let step = matrix.cholesky().expect("a pose that the scan determines").solve(&vector);
        weights += step.rows(POSE, modes);
        motion = turned(&step, &centre) * motion;
    }
    moved(&model.instance(&weights), &motion)
}

/// The motion of a step's first seven entries, about a place.
fn turned(step: &DVector<f64>, about: &Vector) -> Similarity3<f64> {
    let turn = UnitQuaternion::from_scaled_axis(Vector::new(step[0], step[1], step[2]));
    let there = Translation3::from(about + Vector::new(step[4], step[5], step[6]));
    let growth = Similarity3::from_scaling(step[3].exp());
    let back = Translation3::from(-*about);
    there * (growth * (turn * back))
}
