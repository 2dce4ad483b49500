//! The built-in model follows from seeds: rebuilt here as `lacuna synth heads` and `lacuna train` make it, and
//! compared byte by byte.

use lacuna::Model;
use lacuna_host::io::{self, PlyOut, write_ply};
use lacuna_host::mesh::Mesh;
use lacuna_host::synth::Head;
use lacuna_host::train::align::{Align, Way, align};
use lacuna_host::train::model_file::calibrated;
use lacuna_host::train::{Settings, train};
use lacuna_tests::program::succeeds;

/// Heads as they come back from the files that `lacuna synth heads` writes: coordinates are single precision.
fn heads(count: u64) -> Vec<Mesh> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("head.ply");
    let through_file = |number| {
        write_ply(&path, &PlyOut::new(&Head::sample(1, number).mesh())).unwrap();
        io::read(&path).unwrap()
    };
    (0..count).map(through_file).collect()
}

#[test]
fn the_built_in_model_is_what_its_seeds_make() {
    let aligned = align(&heads(30), Align::Auto, 1, &|_, _| ()).unwrap();
    assert!(matches!(aligned.way, Way::Drawn(Some(_))), "the heads are in one pose");
    let settings = Settings {
        class: "head".into(),
        spacing: Some(3.3),
        apart: aligned.way.apart(),
        ..Settings::default()
    };
    let bytes = train(&aligned.shapes, &settings, &|_, _| ()).unwrap();
    assert_eq!(Model::from_bytes(&bytes).unwrap().calibration(), None);
    // The calibration needs sixty completions: it is taken over, and looked at by itself.
    let built_in = lacuna_tests::model();
    let calibration = built_in.calibration().expect("a calibration");
    let bytes = calibrated(&bytes, calibration, built_in.extras().factors).unwrap();
    let (rebuilt, stored) = (Model::from_bytes(&bytes).unwrap(), lacuna_tests::model());
    assert_eq!(rebuilt.header(), stored.header());
    assert_eq!(bytes.len(), lacuna_fixtures::MODEL.len());
    let differ = bytes.iter().zip(lacuna_fixtures::MODEL).position(|(a, b)| a != b);
    assert_eq!(differ, None, "first byte that differs");
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

#[test]
fn the_packed_scan_is_the_example_scan_where_registration_finds_it() {
    let folder = tempfile::tempdir().unwrap();
    succeeds(folder.path(), &["register", "--pack", "front.cloud"]);
    assert!(std::fs::read(folder.path().join("front.cloud")).unwrap() == lacuna_fixtures::PACKED_SCAN);
}
