//! The built-in model follows from seeds: rebuilt by `lacuna synth heads` and `lacuna train`, and compared byte by byte.

use lacuna::cloud::Bytes;
use lacuna::completion::Settings;
use lacuna::pose_fit::ROUNDS;
use lacuna::{Fixed, Model, Schedule};
use lacuna_host::complete::clean::clean;
use lacuna_host::complete::noise::widest;
use lacuna_host::complete::{Options, start};
use lacuna_host::fit::fit;
use lacuna_host::io;
use lacuna_host::points::PackedPoints;
use lacuna_host::train::model_file::calibrated;
use lacuna_tests::program::{json, succeeds};
use lacuna_tests::trained::thirty_heads;

#[test]
fn the_built_in_model_is_what_its_seeds_make() {
    let bytes = &thirty_heads().model;
    assert_eq!(Model::from_bytes(bytes).unwrap().calibration(), None);
    // The calibration needs sixty completions: it is taken over, and looked at by itself.
    let built_in = lacuna_tests::model();
    let calibration = built_in.calibration().expect("a calibration");
    let bytes = calibrated(bytes, calibration, built_in.extras().factors).unwrap();
    let (rebuilt, stored) = (Model::from_bytes(&bytes).unwrap(), lacuna_tests::model());
    assert_eq!(rebuilt.header(), stored.header());
    assert_eq!(bytes.len(), lacuna_fixtures::MODEL.len());
    let differ = bytes.iter().zip(lacuna_fixtures::MODEL).position(|(a, b)| a != b);
    assert_eq!(differ, None, "first byte that differs");
}

#[test]
fn the_example_scan_is_what_its_seeds_make() {
    let folder = tempfile::tempdir().unwrap();
    let seeds = ["--head", "1000", "--scan-seed", "3"];
    succeeds(folder.path(), &[&["synth", "scan", "scan", "--small"], &seeds[..]].concat());
    assert!(std::fs::read(folder.path().join("scan/mesh.ply")).unwrap() == lacuna_fixtures::SCAN);
}

#[test]
fn the_built_in_model_is_small_enough_to_be_committed() {
    assert!(lacuna_fixtures::MODEL.len() <= 3 << 19, "1.5 MiB");
    assert_eq!(lacuna_tests::model().header().shapes, 30);
}

#[test]
fn the_built_in_model_is_calibrated() {
    let model = lacuna_tests::model();
    let calibration = model.calibration().expect("a calibration");
    assert_eq!(calibration.scans, 60);
    assert!(calibration.shares.iter().all(|share| (0.6..=0.75).contains(share)), "{calibration:?}");
    let mut factors: Vec<f32> = (0..model.bricks().count()).filter_map(|brick| model.factor(brick)).collect();
    assert_eq!(factors.len(), model.bricks().count());
    factors.sort_by(f32::total_cmp);
    let [low, high] = [1, 9].map(|tenth| factors[factors.len() * tenth / 10]);
    assert!(low < 1.0 && high > 1.0 && high < 4.0, "{low} to {high}");
}

/// Without its small pieces: the case is older than they are, and its digests stay what they were.
#[test]
fn the_packed_scan_is_the_example_scan_where_registration_finds_it() {
    let model = lacuna_tests::model();
    let example = io::parse(io::Format::Ply, lacuna_fixtures::SCAN).unwrap();
    let large = clean(&example, widest(&model)).scan;
    let start = start(&model, &large, &Options::of(&model)).unwrap();
    let bytes = start.packed().to_bytes(&start.thinned.rough.pose, start.known.hint);
    assert!(bytes == lacuna_fixtures::PACKED_SCAN);
}

#[test]
fn a_packed_scan_is_what_a_completion_fits() {
    let folder = tempfile::tempdir().unwrap();
    succeeds(folder.path(), &["register", "--pack", "scan.cloud"]);
    let bytes = std::fs::read(folder.path().join("scan.cloud")).unwrap();
    let (model, scan) = (lacuna_tests::model(), Bytes(&bytes));
    let points = PackedPoints { points: scan.points().collect(), step: scan.step() };
    let settings = Settings { rounds: &ROUNDS, schedule: Schedule::of(&model) };
    let found = fit::<Fixed>(&model, &points, &scan.pose(), settings).unwrap().digests;
    let completed = json(folder.path(), &["complete", "--no-picture", "--json"]);
    assert_eq!(serde_json::to_value(found).unwrap(), completed["digests"]);
}
