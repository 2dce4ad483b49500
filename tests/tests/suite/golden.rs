//! The same bits from every build on this computer: the program on all cases, with any number of threads, and the core
//! optimised or not. `on_target` asks the same of other processors.

use lacuna_host::io;
use lacuna_tests::program::json;
use tempfile::tempdir;

#[test]
fn this_build_computes_the_golden_bits() {
    let folder = tempdir().unwrap();
    let reports = json(folder.path(), &["verify", "--json"]);
    let reports = reports.as_array().expect("a list of cases");
    let cases = |names: &mut dyn Iterator<Item = &str>| {
        let mut names: Vec<String> = names.map(str::to_owned).collect();
        names.sort();
        names
    };
    // Lists, not sets: a name that is there twice hides a case.
    let verified = cases(&mut reports.iter().filter_map(|report| report["case"].as_str()));
    assert_eq!(verified, cases(&mut lacuna_fixtures::GOLDEN.iter().map(|golden| golden.name)));
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
fn the_number_of_threads_changes_no_bit_of_what_is_told_and_written() {
    let run = |threads: &str| {
        let folder = tempdir().unwrap();
        let report = json(folder.path(), &["complete", "--json", "--threads", threads]);
        let written =
            ["completed.ply", "completed.png"].map(|name| std::fs::read(folder.path().join(name)).unwrap());
        (report["digests"].clone(), report["verdict"].clone(), written)
    };
    let (one, seven) = (run("1"), run("7"));
    assert_eq!(one.0, seven.0, "digests");
    assert_eq!(one.1, seven.1, "verdict");
    assert!(one.2[0] == seven.2[0], "completed.ply");
    assert!(one.2[1] == seven.2[1], "completed.png");
}

/// With optimisation and without, overflow checks and assertions or not. The example needs the core alone, so
/// that building it in the other profile takes seconds.
#[test]
fn optimised_or_not_a_build_computes_the_golden_bits() {
    let stages = lacuna_fixtures::golden("built-in").expect("a case").stages();
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
        assert_eq!(text.trim(), stages.map(|(_, digest)| format!("{digest:08x}")).join(" "), "{profile}");
    }
}
