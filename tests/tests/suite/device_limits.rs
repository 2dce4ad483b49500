//! `train --flash` and `--ram`: models as large as a device has room for.

use lacuna_tests::program::{json, refuses, succeeds};
use serde_json::Value;
use std::path::Path;
use tempfile::{TempDir, tempdir};

fn heads() -> TempDir {
    let folder = tempdir().unwrap();
    succeeds(folder.path(), &["synth", "heads", "heads", "--count", "5"]);
    folder
}

fn arguments<'a>(more: &[&'a str]) -> Vec<&'a str> {
    [&["train", "heads", "-o", "m.lacuna", "--align", "never"], more].concat()
}

/// What `train` says, after a look at whether `inspect` says the same of the file.
fn trained(folder: &Path, more: &[&str]) -> Value {
    let report = json(folder, &[&arguments(more)[..], &["--json"]].concat());
    let inspected = json(folder, &["inspect", "m.lacuna", "--json"]);
    for name in ["bytes", "fit_bytes", "modes", "spacing"] {
        assert_eq!(report[name], inspected[name], "{name} of {report}");
    }
    assert_eq!(report["bytes"], std::fs::metadata(folder.join("m.lacuna")).unwrap().len());
    report
}

#[test]
fn a_class_is_made_to_fit_flash_and_memory() {
    let folder = heads();
    let report = trained(folder.path(), &["--flash", "150K", "--ram", "230K", "--no-calibration"]);
    assert!(report["bytes"].as_u64() <= Some(150 << 10), "{report}");
    assert!(report["fit_bytes"].as_u64() <= Some(230 << 10), "{report}");
    let [usual, chosen] = ["usual", "chosen"].map(|name| &report["choice"][name]);
    assert!(chosen["spacing"].as_f64() > usual["spacing"].as_f64(), "{report}");
    assert_eq!((&usual["modes"], &chosen["modes"]), (&4.into(), &report["modes"]));
}

#[test]
fn a_spacing_that_was_asked_for_stays_and_the_calibration_has_room() {
    let folder = heads();
    let whole = trained(folder.path(), &["--spacing", "12", "--no-calibration"]);
    assert_eq!(whole["choice"], Value::Null);
    let limit = (whole["bytes"].as_u64().unwrap() - 1).to_string();
    let less = trained(folder.path(), &["--spacing", "12", "--flash", &limit]);
    assert_eq!((&less["spacing"], &less["modes"]), (&12.0.into(), &3.into()));
    assert!(less["calibration"].is_object() && less["bytes"].as_u64() < whole["bytes"].as_u64(), "{less}");
}

#[test]
fn modes_that_were_asked_for_stay() {
    let folder = heads();
    let report = trained(folder.path(), &["--modes", "3", "--ram", "100K", "--no-calibration"]);
    assert_eq!(report["modes"], 3);
    assert!(report["fit_bytes"].as_u64() <= Some(100 << 10), "{report}");
}

#[test]
fn the_limits_that_a_model_keeps_change_nothing_of_it() {
    let folder = heads();
    let fixed = ["--spacing", "12", "--no-calibration"];
    let free = trained(folder.path(), &fixed);
    let limited = trained(folder.path(), &[&fixed[..], &["--flash", "1G", "--ram", "1G"]].concat());
    assert_eq!(free["checksum"], limited["checksum"]);
    let text = succeeds(folder.path(), &arguments(&[&fixed[..], &["--ram", "1G"]].concat()));
    assert!(text.contains("nothing had to be given up"), "{text}");
}

#[test]
fn what_nothing_fits_into_is_refused_with_the_smallest_model_there_is() {
    let folder = heads();
    let spaced = ["--spacing", "12", "--ram", "1K"];
    let cases: [(&[&str], [&str; 3]); 3] = [
        (&["--flash", "3K"], ["with 1 mode and", "bytes of flash (--flash 3072)", "allow more"]),
        (
            &spaced,
            [
                "voxels of 12 ",
                "bytes of RAM (--ram 1024)",
                "ask for a wider --stride, or leave out --spacing",
            ],
        ),
        (&["--modes", "2", "--flash", "3K"], ["with 2 modes", "--flash 3072", "leave out --modes"]),
    ];
    for (more, words) in cases {
        let said = refuses(folder.path(), &arguments(more));
        assert!(words.iter().all(|word| said.contains(word)), "{more:?}: {said}");
    }
}
