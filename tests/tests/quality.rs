//! How good a completion is, on heads the built-in model has never seen, scanned in unknown poses. The bounds
//! are in one table; run with `--nocapture` for what is measured.

use lacuna::{Arithmetic, Fixed, Float, Model};
use lacuna_host::complete::{Completion, Hint, Options, complete};
use lacuna_host::mesh::Mesh;
use lacuna_host::register::{Placed, register};
use lacuna_host::surface::is_manifold;
use lacuna_host::synth::{Head, Kind, Scan, ScannerSettings, scan};
use lacuna_host::train::distance::Surface;
use lacuna_tests::{default_schedule, degrees_between, model};

/// Rotation of the pose: a wrong candidate is 20 degrees off or more.
const POSE_DEGREES: f64 = 5.0;
/// Root mean square on the seen part, median over the scans: noise of the scanner 0.18 mm, the rest is the
/// mesh's resolution.
const SEEN_MM: f64 = 0.4;
/// Change of the surface's distance from the truth by rounding.
const ROUNDING_MM: f64 = 0.01;

struct Sample {
    name: String,
    truth: Mesh,
    scan: Scan,
}

fn samples() -> impl Iterator<Item = Sample> {
    (1001..=1003).flat_map(|number| {
        [Kind::Front, Kind::Side].map(|kind| {
            let truth = Head::sample(1, number).mesh();
            let scan = scan(&truth, kind, &ScannerSettings::small(), number);
            Sample { name: format!("head {number} {kind:?}"), truth, scan }
        })
    })
}

fn completed<A: Arithmetic>(model: &Model<'_>, sample: &Sample, hint: Hint) -> Completion {
    let options = Options { hint, seed: 1, schedule: default_schedule(model), finer: 2 };
    complete::<A>(model, &sample.scan.mesh, &options).unwrap_or_else(|e| panic!("{}: {e}", sample.name))
}

/// Degrees between the pose found and the true one.
fn degrees_off(placed: &Placed, scan: &Scan) -> f64 {
    let truth = scan.model_to_scan.try_inverse().expect("a similarity");
    let rotation = placed.pose.rotation;
    let entry = |i: usize, j: usize| if i < 3 && j < 3 { f64::from(rotation[i][j]) } else { 0.0 };
    let rows = |f: &dyn Fn(usize, usize) -> f64| std::array::from_fn(|i| std::array::from_fn(|j| f(i, j)));
    degrees_between(&rows(&entry), &rows(&|i, j| truth[(i, j)]))
}

/// Root mean square distance of the truth's vertices from a mesh in the scan's frame, in true millimetres.
fn rms_mm(sample: &Sample, mesh: &Mesh, keep: impl Fn(usize) -> bool) -> f64 {
    let surface = Surface::new(mesh).expect("a surface");
    let to_scan = &sample.scan.model_to_scan;
    let scale = to_scan.fixed_view::<3, 1>(0, 0).norm();
    let kept = sample.truth.points.iter().enumerate().filter(|&(i, _)| keep(i));
    let distance = |p| surface.distance(&to_scan.transform_point(p), f64::INFINITY).map_or(0.0, |d| d.value);
    let squares: Vec<f64> = kept.map(|(_, p)| (distance(p) / scale).powi(2)).collect();
    (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt()
}

#[test]
fn unseen_heads_are_completed_in_any_pose() {
    let model = model();
    let mut all_seen = Vec::new();
    for sample in samples() {
        let completion = completed::<Fixed>(&model, &sample, Hint::None);
        let degrees = degrees_off(&completion.placed, &sample.scan);
        let mesh = &completion.merged.mesh;
        let [seen, missing] =
            [false, true].map(|missing| rms_mm(&sample, mesh, |i| sample.scan.missing[i] == missing));
        println!("{}: {degrees:.2} degrees, seen {seen:.3} mm, missing {missing:.2} mm", sample.name);
        assert!(degrees < POSE_DEGREES, "{}: {degrees:.1} degrees off", sample.name);
        assert!(is_manifold(mesh), "{}: not a manifold", sample.name);
        all_seen.push(seen);
    }
    all_seen.sort_by(f64::total_cmp);
    let median = all_seen[all_seen.len() / 2];
    assert!(median <= SEEN_MM, "median {median:.3} mm on the seen parts");
}

#[test]
fn rounding_does_not_change_the_surface() {
    let model = model();
    for sample in samples() {
        let placed = register(&model, &sample.scan.mesh, 1).expect("a pose").placed;
        let fixed = completed::<Fixed>(&model, &sample, Hint::Exact(placed));
        let float = completed::<Float>(&model, &sample, Hint::Exact(placed));
        let [a, b] = [&fixed, &float].map(|c| rms_mm(&sample, &c.local, |i| !sample.scan.missing[i]));
        println!("{}: fixed {a:.4} mm, float {b:.4} mm", sample.name);
        assert!((a - b).abs() <= ROUNDING_MM, "{}: {a:.4} mm became {b:.4}", sample.name);
    }
}
