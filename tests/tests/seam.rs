//! The completed mesh at its seam, at its rim and where it was inferred: no step, no hole, a manifold, neither ragged
//! nor crumpled. Run with `--nocapture` for what is measured.

use lacuna::{Fixed, Model};
use lacuna_host::complete::{Completion, Hint, Options, complete};
use lacuna_host::mesh::Mesh;
use lacuna_host::surface::is_manifold;
use lacuna_host::{io, train};
use lacuna_tests::looks::{rim_roughness, sharpest_bend};
use lacuna_tests::seam::{largest_step, rims, steps};
use lacuna_tests::{default_schedule, model, real_data};
use std::path::Path;

/// Largest step at the seam of any scan.
const STEP_MM: f64 = 0.3;
/// 99 % of the inferred edges bend by less in the median scan, degrees.
const BEND: f64 = 28.0;
/// Length of the rim over its length when smoothed over 10 mm: a smooth one is at 1.01, corners shrink.
const ROUGHNESS: f64 = 1.023;
const WIDTH_MM: f64 = 10.0;

fn completed(model: &Model<'_>, scan: &Mesh) -> Completion {
    let options = Options { hint: Hint::None, seed: 1, schedule: default_schedule(model), finer: 2 };
    complete::<Fixed>(model, scan, &options).expect("a completion")
}

/// Checks the mesh and returns its largest step in millimetres and what 99 % of its inferred edges bend by at most.
fn check(name: &str, model: &Model<'_>, scan: &Mesh) -> [f64; 2] {
    let completion = completed(model, scan);
    let merged = &completion.merged;
    let voxel = 1.0 / f64::from(completion.placed.pose.scale);
    let step = largest_step(merged, voxel);
    let mut all = steps(merged, voxel);
    all.sort_by(f64::total_cmp);
    let rims = rims(&merged.mesh);
    let p99 = all.get(all.len() * 99 / 100).copied().unwrap_or(0.0);
    let (bend, unit) = (sharpest_bend(merged), voxel * f64::from(model.header().scales.millimetre));
    let roughness = rim_roughness(&merged.mesh, WIDTH_MM * unit);
    println!("{name}: largest step {step:.3} mm, 99 % below {p99:.3}, rims of {rims:?} edges");
    println!("{name}: 99 % bend by less than {bend:.1} degrees, roughness of the rim {roughness:.3}");
    assert!(is_manifold(&merged.mesh), "{name}: not a manifold");
    assert_eq!(rims.len(), 1, "{name}: open along {rims:?}");
    assert!(roughness <= ROUGHNESS, "{name}: the rim is {roughness:.3} times as long as when smooth");
    [step, bend]
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

#[test]
fn the_example_has_no_step_no_hole_and_no_crumple() {
    let scan = io::parse(io::Format::Ply, lacuna_fixtures::SCAN).expect("the example");
    let [step, bend] = check("example", &model(), &scan);
    assert!(step <= STEP_MM, "{step:.3} mm");
    assert!(bend <= BEND, "{bend:.1} degrees");
}

#[test]
fn nine_scans_of_faces_have_no_step_no_hole_and_no_crumple() {
    let Some(scans) = real_data("scans") else { return };
    let Some(faces) = real_data("faces/train") else { return };
    let read = |path: &Path| io::read(path).expect("a mesh");
    let shapes: Vec<Mesh> = (0..30).map(|i| read(&faces.join(format!("train_{i:03}.ply")))).collect();
    let settings = train::Settings { spacing: Some(3.3), ..train::Settings::default() };
    let bytes = train::train(&shapes, &settings, &|_, _| ()).expect("a model");
    let model = Model::from_bytes(&bytes).expect("a model");
    let names =
        (0..3).flat_map(|t| ["front", "side", "stitched"].map(|kind| format!("target_{t:02}_{kind}")));
    let all: Vec<[f64; 2]> =
        names.map(|name| check(&name, &model, &read(&scans.join(&name).join("mesh.ply")))).collect();
    let [step, bend] = [0, 1].map(|i| median(all.iter().map(|scan| scan[i]).collect()));
    println!("median of the largest steps: {step:.3} mm, of the bends {bend:.1} degrees");
    assert!(all.iter().all(|[step, _]| *step <= STEP_MM), "{all:?}");
    assert!(bend <= BEND, "{bend:.1} degrees");
}
