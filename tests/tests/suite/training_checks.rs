//! What `train` and `evaluate` refuse before they work: the same of both.

use lacuna_host::io::{PlyOut, read, write_ply};
use lacuna_tests::program::{lacuna, succeeds};
use std::path::Path;
use std::time::{Duration, Instant};
use tempfile::{TempDir, tempdir};

/// A folder with three heads, and one of them also as a cloud and in metres.
fn folder() -> TempDir {
    let folder = tempdir().unwrap();
    let here = folder.path();
    succeeds(here, &["synth", "heads", "heads", "--count", "3"]);
    let mut head = read(&here.join("heads/head_001.ply")).unwrap();
    head.triangles.clear();
    write_ply(&here.join("cloud.ply"), &PlyOut::new(&head)).unwrap();
    let mut head = read(&here.join("heads/head_001.ply")).unwrap();
    head.points.iter_mut().for_each(|p| *p *= 1e-3);
    write_ply(&here.join("metres.ply"), &PlyOut::new(&head)).unwrap();
    folder
}

fn train<'a>(more: &[&'a str]) -> Vec<&'a str> {
    let given = ["train", "heads/head_000.ply", "heads/head_002.ply", "-o", "m.lacuna", "--align", "never"];
    [&given[..], more].concat()
}

fn evaluate<'a>(training: &'a str, target: &'a str, more: &[&'a str]) -> Vec<&'a str> {
    let given = [
        "evaluate",
        "--train",
        "heads/head_000.ply",
        "heads/head_002.ply",
        training,
        "--targets",
        target,
        "--counts",
        "2",
        "--draws",
        "1",
        "--align",
        "never",
    ];
    [&given[..], more].concat()
}

fn refused(folder: &Path, arguments: &[&str], words: &[&str]) {
    let output = lacuna(folder, arguments);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1), "{arguments:?}: {said}");
    assert!(words.iter().all(|word| said.contains(word)), "{arguments:?}: {said}");
    assert!(!folder.join("m.lacuna").exists() && !folder.join("evaluation/results.csv").exists());
}

#[test]
fn meshes_that_cannot_be_used_are_named() {
    let folder = folder();
    let head = "heads/head_001.ply";
    for (file, words) in [("metres.ply", "another unit"), ("cloud.ply", "no triangles")] {
        let spaced = [file, "--spacing", "12"];
        refused(folder.path(), &train(&spaced), &[file, words]);
        refused(folder.path(), &evaluate(file, head, &["--spacing", "12"]), &[file, words]);
        refused(folder.path(), &evaluate(head, file, &["--spacing", "12"]), &[file, words]);
    }
}

#[test]
fn spacings_without_a_grid_are_refused_at_once() {
    let folder = folder();
    let head = "heads/head_001.ply";
    let start = Instant::now();
    for spacing in ["0.001", "1e-9", "1e-300", "1e300", "0.3"] {
        refused(folder.path(), &train(&["--spacing", spacing]), &["--spacing"]);
        refused(folder.path(), &evaluate(head, head, &["--spacing", spacing]), &["--spacing"]);
    }
    assert!(start.elapsed() < Duration::from_secs(60), "ten refusals take {:?}", start.elapsed());
}

#[test]
fn the_grid_is_within_the_memory_that_is_allowed() {
    let folder = folder();
    let head = "heads/head_001.ply";
    let limits = ["--spacing", "1.2", "--max-memory", "60M"];
    let words = ["bytes of memory", "--max-memory allows 62914560", "--spacing"];
    refused(folder.path(), &train(&limits), &words);
    refused(folder.path(), &evaluate(head, head, &limits), &words);
    refused(folder.path(), &train(&["--max-memory", "1M"]), &["--max-memory allows 1048576"]);
    succeeds(folder.path(), &train(&["--spacing", "12", "--max-memory", "200M"]));
}

#[test]
fn a_stranger_among_the_shapes_is_told() {
    let folder = folder();
    let here = folder.path();
    let mut plate = read(&here.join("heads/head_001.ply")).unwrap();
    plate.points.iter_mut().for_each(|p| p.y *= 0.02);
    write_ply(&here.join("plate.ply"), &PlyOut::new(&plate)).unwrap();
    let output = lacuna(here, &train(&["plate.ply", "--spacing", "12"]));
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success() && said.contains("plate.ply: only"), "{said}");
    let output = lacuna(here, &evaluate("heads/head_001.ply", "plate.ply", &["--spacing", "12"]));
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success() && said.contains("target plate: the local model misses it"), "{said}");
}

/// Wherever it stands: where the first shape is the stranger, the others are not told.
#[test]
fn a_stranger_before_the_shapes_is_told_and_they_are_not() {
    let folder = folder();
    let here = folder.path();
    let mut plate = read(&here.join("heads/head_001.ply")).unwrap();
    plate.points.iter_mut().for_each(|p| p.y *= 0.02);
    write_ply(&here.join("a_plate.ply"), &PlyOut::new(&plate)).unwrap();
    let heads = ["heads/head_000.ply", "heads/head_001.ply", "heads/head_002.ply"];
    let given = ["train", "a_plate.ply", heads[0], heads[1], heads[2], "-o", "m.lacuna"];
    let output =
        lacuna(here, &[&given[..], &["--align", "never", "--spacing", "12", "--no-calibration"]].concat());
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success() && said.contains("a_plate.ply: only"), "{said}");
    assert!(heads.iter().all(|head| !said.contains(&format!("{head}: only"))), "{said}");
}
