//! About two hundred nasty files: each is accepted with the right result, or refused with a sentence and exit code 1;
//! never a panic, ten seconds, or a GiB.
#![cfg(target_os = "linux")]

use lacuna_host::io::{PlyOut, write_ply};
use lacuna_host::synth::Random;
use lacuna_tests::nasty::{Expected, Nasty, all};
use lacuna_tests::program::path;
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::path::Path;
use std::process::{Command, Output};
use tempfile::tempdir;

/// Runs the program with a GiB of address space, for ten seconds of processor time and a minute at most.
fn bounded(folder: &Path, arguments: &[&str]) -> Output {
    let output = Command::new("sh")
        .args(["-c", "ulimit -v 1048576 && ulimit -t 10 && exec timeout -s KILL 60 \"$@\"", "sh"])
        .arg(path())
        .args(arguments)
        // Every thread's stack counts: a computer with many processors would leave nothing of the GiB.
        .env("RAYON_NUM_THREADS", "2")
        .current_dir(folder)
        .output()
        .expect("sh");
    let complaint = String::from_utf8_lossy(&output.stderr);
    let code = output.status.code();
    assert!(matches!(code, Some(0 | 1)), "lacuna {arguments:?}: {code:?} {complaint}");
    assert!(!complaint.contains("panicked"), "lacuna {arguments:?}: {complaint}");
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
    let mut names: Vec<&str> = all.iter().map(|nasty| nasty.name.as_str()).collect();
    names.sort_unstable();
    assert!(names.windows(2).all(|pair| pair[0] != pair[1]), "two files of one name");
    all.iter().for_each(|nasty| nasty.write(folder.path()));
    let wrong: Vec<String> = all.iter().filter_map(|nasty| complaint(folder.path(), nasty)).collect();
    assert!(wrong.is_empty(), "{} of {}:\n{}", wrong.len(), all.len(), wrong.join("\n"));
}

/// Whether a command was refused, or ended with words that warn of the result.
fn warned(output: &Output, words: &str) -> bool {
    output.status.code() == Some(1) || String::from_utf8_lossy(&output.stdout).contains(words)
}

/// One of six of every kind: of what is read as PLY, as OBJ and so on, at least one.
fn some() -> Vec<Nasty> {
    let mut numbers: BTreeMap<Option<OsString>, usize> = BTreeMap::new();
    let chosen = |nasty: &Nasty| {
        let number = numbers.entry(Path::new(&nasty.name).extension().map(OsString::from)).or_default();
        *number += 1;
        *number % 6 == 1
    };
    all().into_iter().filter(chosen).collect()
}

#[test]
fn nothing_nasty_of_any_kind_is_used_without_a_word() {
    let folder = tempdir().unwrap();
    let here = folder.path();
    assert!(bounded(here, &["synth", "heads", "heads", "--count", "3"]).status.success());
    for nasty in some() {
        nasty.write(here);
        let name = nasty.name.as_str();
        let completed = bounded(here, &["complete", name, "--no-picture", "--json"]);
        assert!(warned(&completed, r#""grade": "reject""#), "complete {name}");
        assert_eq!(completed.status.success(), std::fs::remove_file(here.join("completed.ply")).is_ok());
        assert!(warned(&bounded(here, &["register", name]), "note  "), "register {name}");
        let trained = bounded(here, &["train", name, name, "-o", "m.lacuna"]);
        assert_eq!(trained.status.code(), Some(1), "train {name}");
        assert!(!here.join("m.lacuna").exists());
        let evaluated = bounded(
            here,
            &[
                "evaluate",
                "--train",
                "heads",
                "--targets",
                name,
                "--counts",
                "2",
                "--draws",
                "1",
                "--spacing",
                "14",
                "--align",
                "never",
            ],
        );
        assert!(warned(&evaluated, "the local model misses it"), "evaluate {name}");
    }
}

#[test]
fn what_is_no_file_is_refused_in_words() {
    let folder = tempdir().unwrap();
    let here = folder.path();
    std::os::unix::fs::symlink("loop.ply", here.join("loop.ply")).unwrap();
    std::os::unix::fs::symlink("nowhere.ply", here.join("dangling.ply")).unwrap();
    std::fs::create_dir(here.join("folder.ply")).unwrap();
    assert!(Command::new("mkfifo").arg(here.join("pipe.ply")).status().unwrap().success());
    let names = ["loop.ply", "dangling.ply", "folder.ply", "pipe.ply", "/dev/zero", "/dev/null"];
    for (name, words) in
        names.iter().zip(["", "no such file", "scan.json", "nobody writes", "device", "device"])
    {
        let output = bounded(here, &["check", name]);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.code() == Some(1) && said.contains(words) && said.len() > 30, "{name}: {said}");
    }
}

#[test]
fn models_and_poses_without_an_end_are_refused_too() {
    let folder = tempdir().unwrap();
    assert!(Command::new("mkfifo").arg(folder.path().join("pipe")).status().unwrap().success());
    for (name, words) in [("/dev/zero", "device"), ("pipe", "nobody writes"), (".", "folder")] {
        let wrong: [&[&str]; 3] =
            [&["inspect", name], &["complete", "--model", name], &["complete", "--pose", name]];
        for arguments in wrong {
            let output = bounded(folder.path(), arguments);
            let said = String::from_utf8_lossy(&output.stderr).into_owned();
            assert!(output.status.code() == Some(1) && said.contains(words), "{arguments:?}: {said}");
        }
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
}

#[test]
fn noise_and_triangles_at_random_end_soon() {
    let folder = tempdir().unwrap();
    let scan = folder.path().join("scan.ply");
    std::fs::write(&scan, lacuna_fixtures::SCAN).unwrap();
    let clean = lacuna_host::io::read(&scan).unwrap();
    let mut random = Random::new(1, 1);
    let mut noise = clean.clone();
    noise.points.iter_mut().for_each(|p| *p += 20.0 * random.direction() * random.normal());
    let mut shuffled = clean.clone();
    let count = clean.points.len() as f64;
    shuffled.triangles.iter_mut().flatten().for_each(|v| *v = random.range(0.0, count) as u32);
    for (name, mesh) in [("noise.ply", noise), ("shuffled.ply", shuffled)] {
        write_ply(&folder.path().join(name), &PlyOut::new(&mesh)).unwrap();
        let output = bounded(folder.path(), &["complete", name, "--no-picture"]);
        let [said, complaint] = [&output.stdout, &output.stderr].map(|bytes| String::from_utf8_lossy(bytes));
        let refused = complaint.contains("does not match the model anywhere");
        assert!(refused || said.contains("reject"), "{name}: {said}{complaint}");
    }
}
