//! The expected errors of completed surfaces hold for shapes the trainer never saw.

use lacuna::Model;
use lacuna_host::mesh::Mesh;
use lacuna_host::synth::Head;
use lacuna_tests::expected_errors::shares;
use lacuna_tests::program::{json, lacuna, succeeds};
use std::path::Path;

/// Where the share of true errors below the stated one-sigma error must lie for a handful of synthetic scans: a
/// completion is off as a whole or not, and a few of them scatter.
const SHARE_OF_FEW: std::ops::RangeInclusive<f64> = 0.5..=0.85;

#[test]
fn a_synthetic_class_states_errors_that_hold_for_other_members() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    succeeds(path, &["synth", "heads", "heads", "--count", "6"]);
    let arguments = ["train", "heads", "-o", "m.lacuna", "--spacing", "7", "--align", "never", "--json"];
    let report = json(path, &[&arguments[..], &["--leave-one-out", "--folds", "2"]].concat());
    let calibration = &report["calibration"];
    assert_eq!(calibration["scans"], 12);
    let table = &report["leave_one_out"];
    assert_eq!(report["held_back"], table["summaries"], "of the same scans");
    assert_eq!(table["shapes"].as_array().unwrap().len(), 12);
    for summary in table["summaries"].as_array().unwrap() {
        let missing = summary["missing_rms"][1].as_f64().unwrap();
        let seen = summary["seen_rms"].as_f64().unwrap();
        assert!(seen < missing && missing < 12.0, "{summary}");
        assert_eq!((&summary["shapes"], &summary["failed"]), (&6.into(), &0.into()));
    }
    let bytes = std::fs::read(path.join("m.lacuna")).unwrap();
    let others: Vec<Mesh> = (1000..1003).map(|number| Head::sample(1, number).mesh()).collect();
    let shares = shares(&Model::from_bytes(&bytes).unwrap(), &others);
    assert!(shares.iter().all(|share| SHARE_OF_FEW.contains(share)), "{shares:?}");
    without_calibration(path);
}

/// The same model without a calibration says that its errors are guesses, and fits the same.
fn without_calibration(path: &Path) {
    let arguments = ["train", "heads", "-o", "plain.lacuna", "--spacing", "7", "--align", "never"];
    let text = succeeds(path, &[&arguments[..], &["--no-calibration"]].concat());
    assert!(text.contains("expected error  not calibrated") && !text.contains("held back"), "{text}");
    succeeds(path, &["synth", "scan", "scan", "--view", "side", "--small"]);
    let completed = |model: &str, out: &str| {
        let scan = "scan/mesh.ply";
        json(path, &["complete", scan, "--model", model, "-o", out, "--no-picture", "--json"])
    };
    let (with, without) = (completed("m.lacuna", "a.ply"), completed("plain.lacuna", "b.ply"));
    assert_eq!(with["digests"], without["digests"]);
    for (report, calibrated) in [(&with, true), (&without, false)] {
        let found = &report["expected_error"];
        assert_eq!(found["calibrated"], calibrated);
        let median = |part: &str| found[part]["median"].as_f64().unwrap();
        assert!(median("measured") > 0.0 && median("measured") < median("inferred"), "{found}");
    }
    let header =
        |name: &str| String::from_utf8_lossy(&std::fs::read(path.join(name)).unwrap()[..900]).into_owned();
    assert!(header("a.ply").contains("property float expected_error\n"));
    assert!(!header("a.ply").contains("a guess") && header("b.ply").contains("a guess"));
    let both = ["train", "heads", "-o", "x.lacuna", "--no-calibration", "--leave-one-out"];
    assert_eq!(lacuna(path, &both).status.code(), Some(2));
}
