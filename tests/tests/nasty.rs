//! Some hundred nasty files: each is accepted with the right result, or refused with a sentence and exit code 1;
//! never a panic, ten seconds, or a GiB.
#![cfg(unix)]

use lacuna_tests::nasty::{Expected, Nasty, all};
use lacuna_tests::program::path;
use std::path::Path;
use std::process::{Command, Output};
use std::time::{Duration, Instant};
use tempfile::tempdir;

/// Runs the program with a GiB of address space and for ten seconds at most.
fn bounded(folder: &Path, arguments: &[&str]) -> Output {
    let start = Instant::now();
    let output = Command::new("sh")
        .args(["-c", "ulimit -v 1048576 && exec timeout -s KILL 10 \"$@\"", "sh"])
        .arg(path())
        .args(arguments)
        .current_dir(folder)
        .output()
        .expect("sh");
    let complaint = String::from_utf8_lossy(&output.stderr);
    let code = output.status.code();
    assert!(matches!(code, Some(0 | 1)), "lacuna {arguments:?}: {code:?} {complaint}");
    assert!(!complaint.contains("panicked"), "lacuna {arguments:?}: {complaint}");
    assert!(start.elapsed() < Duration::from_secs(10), "lacuna {arguments:?} took too long");
    output
}

/// What is wrong with the outcome, if anything.
fn complaint(folder: &Path, nasty: &Nasty) -> Option<String> {
    let output = bounded(folder, &["check", &nasty.name, "--json", "--threads", "1"]);
    let report: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    let right = match nasty.expected {
        Expected::Accepted(vertices, triangles) => {
            output.status.success()
                && report[0]["vertices"] == vertices
                && report[0]["triangles"] == triangles
                && said.is_empty()
        }
        Expected::Refused(words) => {
            output.status.code() == Some(1)
                && said.contains(words)
                && said.contains(&nasty.name)
                && said.len() > 30
        }
    };
    (!right).then(|| format!("{}: {:?}, but {said} {report}", nasty.name, nasty.expected))
}

#[test]
fn every_nasty_file_is_accepted_rightly_or_refused_in_words() {
    let folder = tempdir().unwrap();
    let all = all();
    assert!(all.len() >= 100, "{} files", all.len());
    for nasty in &all {
        std::fs::write(folder.path().join(&nasty.name), &nasty.bytes).unwrap();
    }
    let wrong: Vec<String> = all.iter().filter_map(|nasty| complaint(folder.path(), nasty)).collect();
    assert!(wrong.is_empty(), "{} of {}:\n{}", wrong.len(), all.len(), wrong.join("\n"));
}

#[test]
fn nothing_nasty_is_completed_or_trained_on() {
    let folder = tempdir().unwrap();
    for nasty in all().iter().step_by(6) {
        std::fs::write(folder.path().join(&nasty.name), &nasty.bytes).unwrap();
        let completed = bounded(folder.path(), &["complete", &nasty.name, "--no-picture"]);
        assert_eq!(completed.status.code(), Some(1), "{}", nasty.name);
        assert!(!folder.path().join("completed.ply").exists());
        let trained = bounded(folder.path(), &["train", &nasty.name, &nasty.name, "-o", "m.lacuna"]);
        assert_eq!(trained.status.code(), Some(1), "{}", nasty.name);
        assert!(!folder.path().join("m.lacuna").exists());
    }
}

#[test]
fn memory_is_refused_before_it_is_taken() {
    let folder = tempdir().unwrap();
    std::fs::write(folder.path().join("scan.ply"), lacuna_fixtures::SCAN).unwrap();
    let small = bounded(folder.path(), &["check", "scan.ply", "--max-memory", "1M"]);
    let said = String::from_utf8_lossy(&small.stderr).into_owned();
    assert!(small.status.code() == Some(1) && said.contains("--max-memory allows 1048576"), "{said}");
    assert!(bounded(folder.path(), &["check", "scan.ply", "--max-memory", "1G"]).status.success());
    assert_eq!(bounded(folder.path(), &["check", "/dev/zero"]).status.code(), Some(1));
}
