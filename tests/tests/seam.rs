//! The completed mesh at its seam and its rim: no step, no hole, a manifold. Run with `--nocapture` for what is
//! measured.

use lacuna::{Fixed, Model};
use lacuna_host::complete::{Completion, Hint, Options, complete};
use lacuna_host::mesh::Mesh;
use lacuna_host::surface::is_manifold;
use lacuna_host::{io, train};
use lacuna_tests::seam::{largest_step, rims, steps};
use lacuna_tests::{default_schedule, model, real_data};
use std::path::Path;

/// Largest step at the seam in the median scan.
const STEP_MM: f64 = 0.3;

fn completed(model: &Model<'_>, scan: &Mesh) -> Completion {
    let options = Options { hint: Hint::None, seed: 1, schedule: default_schedule(model), finer: 2 };
    complete::<Fixed>(model, scan, &options).expect("a completion")
}

/// Checks the mesh and returns its largest step in millimetres.
fn check(name: &str, model: &Model<'_>, scan: &Mesh) -> f64 {
    let completion = completed(model, scan);
    let merged = &completion.merged;
    let voxel = 1.0 / f64::from(completion.placed.pose.scale);
    let step = largest_step(merged, voxel);
    let mut all = steps(merged, voxel);
    all.sort_by(f64::total_cmp);
    let rims = rims(&merged.mesh);
    let p99 = all.get(all.len() * 99 / 100).copied().unwrap_or(0.0);
    println!("{name}: largest step {step:.3} mm, 99 % below {p99:.3}, rims of {rims:?} edges");
    assert!(is_manifold(&merged.mesh), "{name}: not a manifold");
    assert_eq!(rims.len(), 1, "{name}: open along {rims:?}");
    step
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

#[test]
fn the_example_has_no_step_and_no_hole() {
    let scan = io::parse(io::Format::Ply, lacuna_fixtures::SCAN).expect("the example");
    let step = check("example", &model(), &scan);
    assert!(step <= STEP_MM, "{step:.3} mm");
}

#[test]
fn nine_scans_of_faces_have_no_step_and_no_hole() {
    let Some(scans) = real_data("scans") else { return };
    let Some(faces) = real_data("faces/train") else { return };
    let read = |path: &Path| io::read(path).expect("a mesh");
    let shapes: Vec<Mesh> = (0..30).map(|i| read(&faces.join(format!("train_{i:03}.ply")))).collect();
    let settings = train::Settings { spacing: Some(3.3), ..train::Settings::default() };
    let bytes = train::train(&shapes, &settings, &|_, _| ()).expect("a model");
    let model = Model::from_bytes(&bytes).expect("a model");
    let names =
        (0..3).flat_map(|t| ["front", "side", "stitched"].map(|kind| format!("target_{t:02}_{kind}")));
    let steps = names.map(|name| check(&name, &model, &read(&scans.join(&name).join("mesh.ply")))).collect();
    let median = median(steps);
    println!("median of the largest steps: {median:.3} mm");
    assert!(median <= STEP_MM, "{median:.3} mm");
}
