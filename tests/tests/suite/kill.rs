//! Programs that are killed, at random moments or while they write, leave the old output or the new one, and nothing a next run would
//! trip over. `LACUNA_KILLS` sets how often (12 by default).
#![cfg(unix)]

use lacuna_tests::program::{files, lacuna, path, succeeds};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};
use tempfile::tempdir;

/// A command and the file it makes.
struct Job {
    arguments: Vec<&'static str>,
    output: &'static str,
}

fn jobs() -> Vec<Job> {
    let train =
        vec!["train", "heads", "-o", "m.lacuna", "--spacing", "12", "--align", "never", "--no-calibration"];
    let complete = vec!["complete", "--no-picture", "-o", "completed.ply", "--finer", "1"];
    let evaluate = vec![
        "evaluate",
        "--train",
        "heads",
        "--targets",
        "target",
        "--counts",
        "3",
        "--draws",
        "1",
        "--spacing",
        "12",
        "--align",
        "never",
        "-o",
        "evaluation",
    ];
    vec![
        Job { arguments: train, output: "m.lacuna" },
        Job { arguments: complete, output: "completed.ply" },
        Job { arguments: evaluate, output: "evaluation/results.csv" },
    ]
}

/// How a job is ended.
#[derive(Clone, Copy, PartialEq)]
enum End {
    Force,
    Request,
    /// As when its terminal is closed.
    Hangup,
}

/// Ways to end a job: how, and whether while a file is being written. The last one, which is also the last of a job, may leave
/// temporary files.
const WAYS: [(End, bool); 4] =
    [(End::Force, false), (End::Request, false), (End::Hangup, true), (End::Force, true)];

/// Starts a job, waits, or waits until it writes, and ends it.
fn killed(folder: &Path, job: &Job, wait: Duration, (end, writing): (End, bool)) {
    let mut child = Command::new(path())
        .args(&job.arguments)
        .current_dir(folder)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .expect("the program starts");
    if !writing {
        std::thread::sleep(wait);
    }
    loop {
        // Once it has been waited for, its number may be another program's.
        if child.try_wait().expect("it can be asked").is_some() {
            return;
        }
        if !writing || !temporary(folder).is_empty() {
            break;
        }
    }
    let signal = match end {
        End::Force => "-KILL",
        End::Request => "-TERM",
        End::Hangup => "-HUP",
    };
    let id = child.id().to_string();
    let _ = Command::new("kill").args([signal, &id]).stderr(Stdio::null()).status();
    child.wait().expect("it ends");
}

/// Temporary files in a folder and in that of the evaluation.
fn temporary(folder: &Path) -> Vec<PathBuf> {
    let folders = [folder.to_path_buf(), folder.join("evaluation")];
    let within =
        |folder: &PathBuf| files(folder).into_iter().map(|name| folder.join(name)).collect::<Vec<_>>();
    let all = folders.iter().filter(|folder| folder.is_dir()).flat_map(within);
    all.filter(|path| path.file_name().is_some_and(|name| name.to_string_lossy().starts_with(".lacuna-")))
        .collect()
}

#[test]
fn killed_programs_leave_the_old_or_the_new_output() {
    let folder = tempdir().unwrap();
    let here = folder.path();
    succeeds(here, &["synth", "heads", "heads", "--count", "4"]);
    succeeds(here, &["synth", "heads", "target", "--count", "1"]);
    let kills: usize = std::env::var("LACUNA_KILLS").ok().and_then(|n| n.parse().ok()).unwrap_or(12);
    let mut random = ChaCha8Rng::seed_from_u64(6);
    let (mut replaced, mut beside) = (0, 0);
    for job in jobs() {
        let start = Instant::now();
        succeeds(here, &job.arguments);
        let (length, file) = (start.elapsed(), here.join(job.output));
        let new = std::fs::read(&file).unwrap();
        for number in (0..kills.div_ceil(3)).rev() {
            let old = format!("old output {number}").into_bytes();
            std::fs::write(&file, &old).unwrap();
            forget_evaluation(here);
            temporary(here).iter().for_each(|path| std::fs::remove_file(path).unwrap());
            let way = WAYS[WAYS.len() - 1 - number % WAYS.len()];
            killed(here, &job, length.mul_f64(random.random_range(0.3..1.3)), way);
            let left = std::fs::read(&file).unwrap();
            assert!(left == old || left == new, "{:?}, kill {number}: {} bytes", job.arguments, left.len());
            replaced += usize::from(left == new);
            let forgotten = temporary(here);
            assert!(way.0 == End::Force || forgotten.is_empty(), "{:?}: {forgotten:?}", job.arguments);
        }
        let forgotten = temporary(here);
        assert!(lacuna(here, &job.arguments).status.success(), "the next run succeeds beside {forgotten:?}");
        assert!(std::fs::read(&file).unwrap() == new, "{:?}: the next run makes the same", job.arguments);
        beside += forgotten.len();
        temporary(here).iter().for_each(|path| std::fs::remove_file(path).unwrap());
    }
    println!("{kills} kills, {replaced} after the output was replaced, {beside} temporary files left");
}

/// Removes what an evaluation goes on from.
fn forget_evaluation(folder: &Path) {
    let folder = folder.join("evaluation");
    let entries = std::fs::read_dir(&folder).into_iter().flatten().flatten();
    let states = entries.filter(|entry| entry.file_name().to_string_lossy().starts_with("state-"));
    states.for_each(|state| std::fs::remove_file(state.path()).unwrap());
}
