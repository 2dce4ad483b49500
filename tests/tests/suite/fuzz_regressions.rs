//! The fuzz targets without a fuzzer: cases once found, the seeds, and as many changed seeds as time allows.
//!
//! `LACUNA_FUZZ_SECONDS` sets the seconds a target; a case that fails is printed with its number, which makes it
//! again, and written to `tests/fuzz/artifacts`.

use lacuna_tests::fuzz::mutate::mutated;
use lacuna_tests::fuzz::{TARGETS, Target};
use lacuna_tests::program::files;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz")
}

/// Runs a case; one that fails is kept and named.
fn survives(target: &Target, name: &str, bytes: &[u8]) {
    if catch_unwind(AssertUnwindSafe(|| (target.run)(bytes))).is_ok() {
        return;
    }
    let kept = folder().join("artifacts").join(target.name);
    let path = kept.join(name);
    let written = std::fs::create_dir_all(&kept).and_then(|()| std::fs::write(&path, bytes));
    panic!("{}: {name} fails, {} bytes, kept as {} ({written:?})", target.name, bytes.len(), path.display());
}

/// Names in a folder of the fuzz package, sorted.
fn names(within: &str) -> Vec<String> {
    files(&folder().join(within))
}

#[test]
fn every_target_has_a_program_of_its_name_and_no_program_lacks_a_target() {
    let mut known = TARGETS.each_ref().map(|target| format!("{}.rs", target.name));
    known.sort();
    assert_eq!(names("fuzz_targets"), known);
}

#[test]
fn cases_once_found_stay_mended() {
    let mut replayed = 0;
    for name in names("regressions") {
        let target = TARGETS.iter().find(|target| target.name == name);
        let target = target.unwrap_or_else(|| panic!("regressions/{name}: no target has this name"));
        let within = format!("regressions/{name}");
        for case in names(&within) {
            let bytes = std::fs::read(folder().join(&within).join(&case)).expect("a file of the repository");
            survives(target, &case, &bytes);
            replayed += 1;
        }
    }
    assert!(replayed > 0, "no case was found in {}", folder().join("regressions").display());
}

#[test]
fn seeds_and_changed_seeds_break_nothing() {
    let seconds = std::env::var("LACUNA_FUZZ_SECONDS").ok().and_then(|text| text.parse().ok()).unwrap_or(1);
    for target in &TARGETS {
        let seeds = (target.seeds)();
        for (number, seed) in seeds.iter().enumerate() {
            survives(target, &format!("seed-{number}"), seed);
        }
        let deadline = Instant::now() + Duration::from_secs(seconds);
        let mut number = 0;
        while Instant::now() < deadline {
            survives(target, &format!("number-{number}"), &mutated(&seeds, number));
            number += 1;
        }
        println!("{}: {} seeds, {number} changed ones", target.name, seeds.len());
        assert!(number > 0);
    }
}
