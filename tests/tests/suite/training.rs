//! Training at full resolution: what it takes, as Linux counts it, and whether the errors it states hold.

use lacuna::Model;
use lacuna_host::io;
use lacuna_tests::expected_errors::shares;
use lacuna_tests::program;
use lacuna_tests::real_data;
use lacuna_tests::required::lacks;
use std::ops::{Range, RangeInclusive};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

const LIMIT_KIB: u64 = 1 << 20;
/// Where the share of true errors below the stated one-sigma error must lie, over several scans.
const SHARE: RangeInclusive<f64> = 0.6..=0.75;
/// Shapes that expected errors are learned from: two scans of each are completed, by far the most of the time.
const CALIBRATED: usize = 12;

/// Peak resident memory of a running program, KiB; none once it has ended, or where there is no /proc.
fn peak(process: u32) -> Option<u64> {
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    line.split_whitespace().next()?.parse().ok()
}

fn faces(folder: &Path, numbers: Range<usize>) -> Vec<PathBuf> {
    numbers.map(|i| folder.join(format!("train_{i:03}.ply"))).collect()
}

/// Thirty real faces where they are, else thirty heads of the built-in class.
fn shapes(folder: &Path) -> Vec<PathBuf> {
    if let Some(real) = real_data("faces/train") {
        return faces(&real, 0..30);
    }
    program::succeeds(folder, &["synth", "heads", "heads", "--count", "30"]);
    let heads = std::fs::read_dir(folder.join("heads")).unwrap().flatten();
    heads.map(|entry| entry.path()).filter(|path| path.extension().is_some_and(|e| e == "ply")).collect()
}

/// Trains `m.lacuna` in a folder with less than a gibibyte.
fn train(folder: &Path, shapes: &[PathBuf], options: &[&str]) {
    let mut child = Command::new(program::path())
        .arg("train")
        .args(shapes)
        .args(["-o", "m.lacuna", "--spacing", "3.3"])
        .args(options)
        .current_dir(folder)
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    let mut highest = 0;
    // The kernel keeps the peak: the last look before the end misses at most what the last moments added.
    while child.try_wait().unwrap().is_none() {
        highest = peak(child.id()).unwrap_or(highest).max(highest);
        std::thread::sleep(Duration::from_millis(20));
    }
    assert!(child.wait().unwrap().success());
    println!("{} shapes: {} MiB at most", shapes.len(), highest / 1024);
    if peak(std::process::id()).is_none() {
        return lacks("PROC", "there is no /proc to tell the memory of a program");
    }
    assert!(highest > 10_000, "{highest} KiB: not measured");
    assert!(highest < LIMIT_KIB, "{highest} KiB");
}

#[test]
fn thirty_shapes_take_less_than_a_gibibyte() {
    let folder = tempfile::tempdir().unwrap();
    train(folder.path(), &shapes(folder.path()), &["--no-calibration"]);
}

#[test]
fn errors_learned_from_faces_take_less_than_a_gibibyte_and_hold_for_others() {
    let Some(real) = real_data("faces/train") else { return };
    let folder = tempfile::tempdir().unwrap();
    train(folder.path(), &faces(&real, 0..CALIBRATED), &[]);
    let bytes = std::fs::read(folder.path().join("m.lacuna")).unwrap();
    let others = faces(&real, 30..38).into_iter().map(|path| io::read(&path).unwrap());
    let shares = shares(&Model::from_bytes(&bytes).unwrap(), &others.collect::<Vec<_>>());
    assert!(shares.iter().all(|share| SHARE.contains(share)), "{shares:?}");
}
