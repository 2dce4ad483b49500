//! The expected errors of completed surfaces hold for shapes the trainer never saw.

use lacuna::Model;
use lacuna_host::synth::{Head, Kind};
use lacuna_host::train::held_out::trial;
use lacuna_host::uncertainty::expected::{expected, misfit};
use lacuna_host::{io, mesh::Mesh};
use lacuna_tests::program::{json, lacuna, succeeds};
use lacuna_tests::real_data;
use std::path::Path;

/// Where the share of true errors below the stated one-sigma error must lie, over several scans.
const SHARE: std::ops::RangeInclusive<f64> = 0.6..=0.75;
/// The same for a handful of synthetic scans: a completion is off as a whole or not, and a few of them scatter.
const SHARE_OF_FEW: std::ops::RangeInclusive<f64> = 0.5..=0.85;

/// Shares of measured and inferred vertices whose true error is below the expected one, over scans of `shapes` from
/// one side and from three.
fn shares(model: &Model<'_>, shapes: &[Mesh]) -> [f64; 2] {
    let calibration = model.calibration().expect("a calibration");
    let (mut within, mut of) = ([0.0; 2], [0.0; 2]);
    for (number, shape) in shapes.iter().enumerate() {
        for kind in [Kind::Front, Kind::Stitched] {
            let done = trial(model, shape, 100 + number, kind).expect("a completion");
            let misfit = misfit(&done.cues);
            let known = done.cues.iter().zip(&done.errors).filter_map(|(cue, error)| Some((cue, (*error)?)));
            for (cue, error) in known {
                let part = usize::from(!cue.measured);
                of[part] += 1.0;
                within[part] += f64::from(u8::from(error <= expected(calibration, cue, misfit)));
            }
        }
    }
    let shares = [within[0] / of[0], within[1] / of[1]];
    println!("{} shapes: measured {:.3}, inferred {:.3}", shapes.len(), shares[0], shares[1]);
    shares
}

#[test]
fn a_synthetic_class_states_errors_that_hold_for_other_members() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    succeeds(path, &["synth", "heads", "heads", "--count", "12"]);
    let arguments = ["train", "heads", "-o", "m.lacuna", "--spacing", "7", "--align", "never", "--json"];
    let report = json(path, &[&arguments[..], &["--leave-one-out", "--folds", "6"]].concat());
    let calibration = &report["calibration"];
    assert_eq!(calibration["scans"], 24);
    let table = &report["leave_one_out"];
    assert_eq!(table["shapes"].as_array().unwrap().len(), 24);
    for summary in table["summaries"].as_array().unwrap() {
        let missing = summary["missing_rms"][1].as_f64().unwrap();
        let seen = summary["seen_rms"].as_f64().unwrap();
        assert!(seen < missing && missing < 12.0, "{summary}");
        assert_eq!(summary["shapes"], 12);
    }
    let bytes = std::fs::read(path.join("m.lacuna")).unwrap();
    let others: Vec<Mesh> = (1000..1006).map(|number| Head::sample(1, number).mesh()).collect();
    let shares = shares(&Model::from_bytes(&bytes).unwrap(), &others);
    assert!(shares.iter().all(|share| SHARE_OF_FEW.contains(share)), "{shares:?}");
    without_calibration(path);
}

/// The same model without a calibration says that its errors are guesses, and fits the same.
fn without_calibration(path: &Path) {
    let arguments = ["train", "heads", "-o", "plain.lacuna", "--spacing", "7", "--align", "never"];
    let text = succeeds(path, &[&arguments[..], &["--no-calibration"]].concat());
    assert!(text.contains("expected error  not calibrated"), "{text}");
    succeeds(path, &["synth", "scan", "scan", "--view", "side"]);
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

#[test]
fn real_faces_state_errors_that_hold_for_other_faces() {
    let Some(faces) = real_data("faces/train") else { return };
    let folder = tempfile::tempdir().unwrap();
    let names: Vec<String> =
        (0..30).map(|i| faces.join(format!("train_{i:03}.ply")).display().to_string()).collect();
    let mut arguments = vec!["train", "-o", "face.lacuna", "--spacing", "3.3"];
    arguments.extend(names.iter().map(String::as_str));
    succeeds(folder.path(), &arguments);
    let bytes = std::fs::read(folder.path().join("face.lacuna")).unwrap();
    let others: Vec<Mesh> =
        (30..42).map(|i| io::read(&faces.join(format!("train_{i:03}.ply"))).unwrap()).collect();
    let shares = shares(&Model::from_bytes(&bytes).unwrap(), &others);
    assert!(shares.iter().all(|share| SHARE.contains(share)), "{shares:?}");
}
