//! Runs the `lacuna` program and looks at what it leaves behind.

use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::OnceLock;

/// The program, built with the profile of the test that asks.
///
/// It belongs to another package, so Cargo does not hand out its path. It is built here even where one is there
/// already: that one may be yesterday's.
pub fn path() -> &'static Path {
    static PATH: OnceLock<PathBuf> = OnceLock::new();
    PATH.get_or_init(|| {
        let test = std::env::current_exe().expect("path of the test");
        let profile_folder = test.ancestors().nth(2).expect("target/profile/deps/test");
        build(profile_folder, test_name(&test));
        profile_folder.join(format!("lacuna{}", std::env::consts::EXE_SUFFIX))
    })
}

/// The name of the integration test that an executable is.
fn test_name(executable: &Path) -> Option<String> {
    let (name, _) = executable.file_stem()?.to_str()?.rsplit_once('-')?;
    let sources = ["", "/main"].map(|end| format!("{}/tests/{name}{end}.rs", env!("CARGO_MANIFEST_DIR")));
    sources.iter().any(|source| Path::new(source).exists()).then(|| name.into())
}

fn build(profile_folder: &Path, test: Option<String>) {
    let profile = profile_folder.file_name().map_or("debug".into(), |name| name.to_string_lossy());
    let profile = if profile == "debug" { "dev".into() } else { profile };
    let target = profile_folder.parent().expect("target folder");
    let status = Command::new(env!("CARGO"))
        .args(["build", "--quiet", "--workspace", "--bin", "lacuna", "--profile", &profile])
        // With the development dependencies of the test that asks, crates have the features they were built with for it,
        // and are not compiled once more.
        .args(test.iter().flat_map(|test| ["--test", test]))
        .arg("--target-dir")
        .arg(target)
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .status()
        .expect("cargo");
    assert!(status.success(), "lacuna-host does not build");
}

/// Runs the program in `folder`, its output in pipes.
pub fn lacuna(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(path()).args(arguments).current_dir(folder).output().expect("the program starts")
}

/// Runs the program, which must succeed and say nothing on standard error: its standard output.
pub fn succeeds(folder: &Path, arguments: &[&str]) -> String {
    let output = lacuna(folder, arguments);
    let complaint = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "lacuna {arguments:?}: {complaint}");
    assert_eq!(complaint, "", "lacuna {arguments:?}");
    String::from_utf8(output.stdout).expect("UTF-8")
}

/// The same for a run with `--json`.
pub fn json(folder: &Path, arguments: &[&str]) -> Value {
    let text = succeeds(folder, arguments);
    serde_json::from_str(&text).unwrap_or_else(|error| panic!("lacuna {arguments:?}: {error}\n{text}"))
}

/// Runs the program, which must refuse its data with exit code 1 and leave no file behind: its sentence.
pub fn refuses(folder: &Path, arguments: &[&str]) -> String {
    let before = files(folder);
    let output = lacuna(folder, arguments);
    let complaint = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1), "lacuna {arguments:?}: {complaint}");
    assert_eq!(String::from_utf8_lossy(&output.stdout), "", "lacuna {arguments:?}");
    assert_eq!(files(folder), before, "lacuna {arguments:?} left a file behind: {complaint}");
    assert!(!complaint.contains("panicked"), "{complaint}");
    complaint
}

/// Names of the files in a folder, sorted.
pub fn files(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).expect("folder").flatten();
    let mut names: Vec<String> = entries.map(|e| e.file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}
