//! How good a completion is, on heads the built-in model has never seen, scanned in unknown poses. The bounds
//! are in one table; run with `--nocapture` for what is measured.

use lacuna::{Arithmetic, Fixed, Float, Model};
use lacuna_host::complete::{Completion, Hint, Options, complete};
use lacuna_host::register::register;
use lacuna_host::surface::is_manifold;
use lacuna_tests::sample::{Sample, heads};
use lacuna_tests::{default_schedule, model};

/// Rotation of the pose: a wrong candidate is 20 degrees off or more.
const POSE_DEGREES: f64 = 5.0;
/// Root mean square on the seen part, median over the scans: noise of the scanner 0.18 mm, the rest is the
/// mesh's resolution.
const SEEN_MM: f64 = 0.4;
/// Change of the surface's distance from the truth by rounding.
const ROUNDING_MM: f64 = 0.01;

fn completed<A: Arithmetic>(model: &Model<'_>, sample: &Sample, hint: Hint) -> Completion {
    let options = Options { hint, seed: 1, schedule: default_schedule(model), finer: 2 };
    complete::<A>(model, &sample.scan, &options).unwrap_or_else(|e| panic!("{}: {e}", sample.name))
}

#[test]
fn unseen_heads_are_completed_in_any_pose() {
    let model = model();
    let mut all_seen = Vec::new();
    for sample in heads(1001..=1003) {
        let completion = completed::<Fixed>(&model, &sample, Hint::None);
        let degrees = sample.degrees_off(&completion.placed);
        let mesh = &completion.merged.mesh;
        let [seen, missing] =
            [false, true].map(|missing| sample.rms_mm(mesh, |i| sample.missing[i] == missing));
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
    for sample in heads(1001..=1003) {
        let placed = register(&model, &sample.scan, 1).expect("a pose").placed;
        let fixed = completed::<Fixed>(&model, &sample, Hint::Exact(placed));
        let float = completed::<Float>(&model, &sample, Hint::Exact(placed));
        let [a, b] = [&fixed, &float].map(|c| sample.rms_mm(&c.local, |i| !sample.missing[i]));
        println!("{}: fixed {a:.4} mm, float {b:.4} mm", sample.name);
        assert!((a - b).abs() <= ROUNDING_MM, "{}: {a:.4} mm became {b:.4}", sample.name);
    }
}
