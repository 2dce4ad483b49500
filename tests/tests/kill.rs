//! Programs that are killed at random moments leave the old output or the new one, and nothing a next run would
//! trip over. `LACUNA_KILLS` sets how often (30 by default).
#![cfg(unix)]

use lacuna_tests::program::{files, lacuna, path, succeeds};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::path::Path;
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

/// Starts a job, waits, and ends it: by force, or by a request.
fn killed(folder: &Path, job: &Job, wait: Duration, by_force: bool) {
    let mut child = Command::new(path())
        .args(&job.arguments)
        .current_dir(folder)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .expect("the program starts");
    std::thread::sleep(wait);
    if by_force {
        let _ = child.kill();
    } else {
        let id = child.id().to_string();
        let _ = Command::new("kill").args(["-TERM", &id]).stderr(Stdio::null()).status();
    }
    child.wait().expect("it ends");
}

fn temporary(folder: &Path) -> Vec<String> {
    files(folder).into_iter().filter(|name| name.starts_with(".lacuna-")).collect()
}

#[test]
fn killed_programs_leave_the_old_or_the_new_output() {
    let folder = tempdir().unwrap();
    let here = folder.path();
    succeeds(here, &["synth", "heads", "heads", "--count", "4"]);
    succeeds(here, &["synth", "heads", "target", "--count", "1"]);
    let kills: usize = std::env::var("LACUNA_KILLS").ok().and_then(|n| n.parse().ok()).unwrap_or(30);
    let mut random = ChaCha8Rng::seed_from_u64(6);
    let mut replaced = 0;
    for job in jobs() {
        let start = Instant::now();
        succeeds(here, &job.arguments);
        let (length, file) = (start.elapsed(), here.join(job.output));
        let new = std::fs::read(&file).unwrap();
        for number in 0..kills.div_ceil(3) {
            let old = format!("old output {number}").into_bytes();
            std::fs::write(&file, &old).unwrap();
            if job.arguments[0] == "evaluate" {
                let state =
                    files(&here.join("evaluation")).into_iter().filter(|name| name.starts_with("state-"));
                state.for_each(|name| std::fs::remove_file(here.join("evaluation").join(name)).unwrap());
            }
            let by_force = number % 2 == 0;
            killed(here, &job, length.mul_f64(random.random_range(0.3..1.3)), by_force);
            let left = std::fs::read(&file).unwrap();
            assert!(left == old || left == new, "{:?}, kill {number}: {} bytes", job.arguments, left.len());
            replaced += usize::from(left == new);
            let folders = [here.to_path_buf(), here.join("evaluation")];
            let forgotten: Vec<String> =
                folders.iter().filter(|f| f.is_dir()).flat_map(|f| temporary(f)).collect();
            assert!(by_force || forgotten.is_empty(), "{:?}: {forgotten:?}", job.arguments);
            for (folder, name) in folders.iter().flat_map(|f| forgotten.iter().map(move |name| (f, name))) {
                let _ = std::fs::remove_file(folder.join(name));
            }
        }
        assert!(lacuna(here, &job.arguments).status.success(), "the next run succeeds");
        assert!(std::fs::read(&file).unwrap() == new, "{:?}: the next run makes the same", job.arguments);
    }
    println!("{kills} kills, {replaced} after the output was replaced");
}
