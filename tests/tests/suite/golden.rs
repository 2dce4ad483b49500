//! The same bits on every build. Run it in debug and release, and on every target there is: only then is it a
//! test of portability.

use lacuna_host::io;
use lacuna_tests::program::{json, succeeds};
use std::collections::BTreeSet;
use tempfile::tempdir;

#[test]
fn this_build_computes_the_golden_bits() {
    let folder = tempdir().unwrap();
    let reports = json(folder.path(), &["verify", "--json"]);
    let reports = reports.as_array().expect("a list of cases");
    assert!(reports.len() >= 4);
    for report in reports {
        let (case, digests) = (&report["case"], &report["digests"]);
        assert_eq!(digests, &report["golden"], "case {case}: not the golden digests");
    }
}

/// Repaired, without specks, and with the small pieces that belong to the shape.
#[test]
fn a_scan_is_verified_as_it_is_completed() {
    let folder = tempdir().unwrap();
    let mut scan = io::parse(io::Format::Ply, lacuna_fixtures::SCAN).unwrap();
    let away = scan.triangles[scan.triangles.len() / 2][0];
    scan.points[away as usize].x += 3000.0;
    io::write_ply(&folder.path().join("scan.ply"), &io::PlyOut::new(&scan)).unwrap();
    let verified = json(folder.path(), &["verify", "scan.ply", "--json"]);
    let completed = json(folder.path(), &["complete", "scan.ply", "--no-picture", "--json"]);
    assert_eq!(verified[0]["digests"], completed["digests"]);
}

#[test]
fn golden_cases_have_distinct_names() {
    let names: BTreeSet<&str> = lacuna_fixtures::GOLDEN.iter().map(|golden| golden.name).collect();
    assert_eq!(names.len(), lacuna_fixtures::GOLDEN.len());
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    let run = |threads: &str| {
        let folder = tempdir().unwrap();
        let report = json(folder.path(), &["complete", "--json", "--no-picture", "--threads", threads]);
        let mesh = std::fs::read(folder.path().join("completed.ply")).unwrap();
        (report["digests"].clone(), report["verdict"].clone(), mesh)
    };
    let (one, two) = (run("1"), run("2"));
    assert_eq!(one.0, two.0, "digests");
    assert_eq!(one.1, two.1, "verdict");
    assert!(one.2 == two.2, "completed.ply");
}

#[test]
fn any_number_of_threads_writes_the_same_mesh_and_picture() {
    let results = |threads: &str| {
        let folder = tempdir().unwrap();
        succeeds(folder.path(), &["complete", "--threads", threads]);
        ["completed.ply", "completed.png"].map(|name| std::fs::read(folder.path().join(name)).unwrap())
    };
    assert!(results("1") == results("7"));
}

/// With optimisation and without, overflow checks and assertions or not. The example needs the core alone, so
/// that building it in the other profile takes seconds.
#[test]
fn optimised_or_not_a_build_computes_the_golden_bits() {
    let golden = lacuna_fixtures::GOLDEN.iter().find(|golden| golden.name == "built-in").expect("a case");
    let stages = [golden.pose, golden.hull, golden.global, golden.local, golden.distances];
    for profile in ["plain", "release"] {
        let output = std::process::Command::new(env!("CARGO"))
            .args([
                "run",
                "--quiet",
                "--package",
                "lacuna-fixtures",
                "--example",
                "digests",
                "--profile",
                profile,
            ])
            .current_dir(env!("CARGO_MANIFEST_DIR"))
            .output()
            .expect("cargo");
        assert!(output.status.success(), "{profile}: {}", String::from_utf8_lossy(&output.stderr));
        let text = String::from_utf8(output.stdout).expect("digits");
        assert_eq!(text.trim(), stages.map(|digest| format!("{digest:08x}")).join(" "), "{profile}");
    }
}
