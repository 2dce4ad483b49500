//! Training stays within a gibibyte: the peak memory of the program itself, as Linux counts it.

use lacuna_tests::program;
use lacuna_tests::real_data;
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::time::Duration;

const LIMIT_KIB: u64 = 1 << 20;

/// Peak resident memory of a running program, KiB; none once it has ended, or where there is no /proc.
fn peak(process: u32) -> Option<u64> {
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    line.split_whitespace().next()?.parse().ok()
}

/// Thirty real faces where they are, else thirty heads of the built-in class.
fn shapes(folder: &std::path::Path) -> Vec<PathBuf> {
    if let Some(faces) = real_data("faces/train") {
        return (0..30).map(|i| faces.join(format!("train_{i:03}.ply"))).collect();
    }
    program::succeeds(folder, &["synth", "heads", "heads", "--count", "30"]);
    let heads = std::fs::read_dir(folder.join("heads")).unwrap().flatten();
    heads.map(|entry| entry.path()).filter(|path| path.extension().is_some_and(|e| e == "ply")).collect()
}

#[test]
fn training_thirty_shapes_takes_less_than_a_gibibyte() {
    if peak(std::process::id()).is_none() {
        println!("skipped: this system has no /proc/PID/status");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let shapes = shapes(folder.path());
    let mut child = Command::new(program::path())
        .arg("train")
        .args(&shapes)
        .args(["-o", "m.lacuna", "--spacing", "3.3"])
        .current_dir(folder.path())
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
    assert!(highest > 10_000, "{highest} KiB: not measured");
    assert!(highest < LIMIT_KIB, "{highest} KiB");
}
