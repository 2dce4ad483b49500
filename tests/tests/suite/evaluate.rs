//! Figure 2 on small synthetic classes: what comes out, that a stopped run goes on, what is refused.

use lacuna_host::io::{PlyOut, write_ply};
use lacuna_host::synth::Head;
use lacuna_tests::program::{files, json, lacuna, refuses, succeeds};
use serde_json::Value;
use std::path::Path;
use tempfile::{TempDir, tempdir};

/// Folders `train` with six heads and `targets` with two others.
fn heads() -> TempDir {
    let folder = tempdir().unwrap();
    for (number, place) in (0..8).map(|i| (i, if i < 6 { "train" } else { "targets" })) {
        save(folder.path(), place, number, &Head::sample(3, number).mesh());
    }
    folder
}

/// Folders with bent copies of one head, which share its connectivity.
fn bent() -> TempDir {
    let folder = tempdir().unwrap();
    for i in 0..6 {
        let (a, b) = (0.03 * i as f64, 0.02 * ((i * i) % 5) as f64);
        let bend = |p: lacuna_host::mesh::Point| [p.x * (1.0 + a), p.y + b * p.x, p.z - a * p.y].into();
        let mut mesh = Head::sample(3, 0).mesh();
        mesh.normals.clear();
        mesh.points.iter_mut().for_each(|p| *p = bend(*p));
        save(folder.path(), if i < 4 { "train" } else { "targets" }, i, &mesh);
    }
    folder
}

fn save(folder: &Path, place: &str, number: u64, mesh: &lacuna_host::mesh::Mesh) {
    let folder = folder.join(place);
    std::fs::create_dir_all(&folder).unwrap();
    write_ply(&folder.join(format!("shape_{number}.ply")), &PlyOut::new(mesh)).unwrap();
}

const COMMON: [&str; 7] = ["evaluate", "--train", "train", "--targets", "targets", "--align", "never"];

/// Coarse, where the numbers do not matter.
fn with<'a>(more: &[&'a str]) -> Vec<&'a str> {
    [&COMMON[..], &["--spacing", "14"], more].concat()
}

/// Fine enough for the local model to be what it is.
fn finer<'a>(more: &[&'a str]) -> Vec<&'a str> {
    [&COMMON[..], &["--spacing", "8"], more].concat()
}

fn median(result: &Value, count: &str, model: &str) -> f64 {
    result["counts"][count][model]["rms"]["median"]
        .as_f64()
        .unwrap_or_else(|| panic!("{count} {model}: {result}"))
}

/// The file with the results so far.
fn state(folder: &Path) -> std::path::PathBuf {
    let name = files(&folder.join("evaluation")).into_iter().find(|name| name.ends_with(".jsonl")).unwrap();
    folder.join("evaluation").join(name)
}

#[test]
fn the_local_model_is_nearest_and_more_shapes_help() {
    let folder = heads();
    let result = json(folder.path(), &finer(&["--counts", "3,6", "--draws", "2", "--json"]));
    for count in ["3", "6"] {
        let [local, global, eq9, floor] =
            ["local", "global", "eq9", "floor"].map(|model| median(&result, count, model));
        assert!(floor < local && local < 0.5 * global && local < 0.5 * eq9, "{count}: {result}");
        let row = &result["counts"][count]["local"];
        assert!(row["rms"]["q1"].as_f64() <= row["rms"]["q3"].as_f64() && row["p95"]["median"].is_f64());
        assert!(result["counts"][count].get("correspondence").is_none(), "heads have triangles of their own");
    }
    assert!(median(&result, "6", "local") < median(&result, "3", "local"));
    let made = files(&folder.path().join("evaluation"));
    assert!(made.contains(&"figure2.svg".into()) && made.contains(&"results.csv".into()), "{made:?}");
    let table = std::fs::read_to_string(folder.path().join("evaluation/results.csv")).unwrap();
    // Two draws of three shapes and the only one of six, two targets, four models, and the head line.
    assert_eq!(table.lines().count(), 3 * 2 * 4 + 1);
}

#[test]
fn a_stopped_run_goes_on_where_it_was() {
    let folder = heads();
    let arguments = with(&["--counts", "3", "--draws", "2", "--json"]);
    let whole = succeeds(folder.path(), &arguments);
    let state = state(folder.path());
    let text = std::fs::read_to_string(&state).unwrap();
    assert_eq!(text.lines().count(), 4);
    // Stopped in the middle of the third line.
    let kept: usize = text.split_inclusive('\n').take(2).map(str::len).sum();
    std::fs::write(&state, &text[..kept + 20]).unwrap();
    assert_eq!(succeeds(folder.path(), &arguments), whole);
    let again = std::fs::read_to_string(&state).unwrap();
    assert!(again.starts_with(&text[..kept]) && again.lines().count() == 4, "{again}");
    // Nothing left to do: the results are there without the work.
    std::fs::write(&state, again.replace("\"rms\":", "\"rms\":7")).unwrap();
    assert_ne!(succeeds(folder.path(), &arguments), whole);
}

#[test]
fn meshes_of_one_connectivity_have_the_correspondence_model_too() {
    let folder = bent();
    let result =
        json(folder.path(), &with(&["--counts", "4", "--draws", "1", "--json", "--pose", "identity"]));
    // The bends are linear in two numbers: two modes explain all of them.
    assert!(median(&result, "4", "correspondence") < 1e-3, "{result}");
}

#[test]
fn the_papers_scheme_and_its_single_steps_run() {
    let folder = heads();
    let run = |more: &[&str]| {
        let counted = [&["--counts", "4", "--draws", "1", "--json"], more].concat();
        json(folder.path(), &with(&counted))
    };
    let (ours, paper) = (run(&[]), run(&["--method", "paper"]));
    assert!(median(&paper, "4", "local") < median(&paper, "4", "global"), "{paper}");
    assert!(median(&ours, "4", "local") < median(&paper, "4", "local"), "{ours} {paper}");
    // The fixed point arrives where the direct solution is, but for the ridge.
    let iterated = run(&["--solver", "fixed-point"]);
    let (direct, fixed) = (median(&ours, "4", "global"), median(&iterated, "4", "global"));
    assert!((direct - fixed).abs() < 0.1 * direct, "{direct} {fixed}");
    let small = run(&["--radius", "0.5"]);
    assert!(median(&small, "4", "global") > direct, "a small hyper-ellipse keeps weights near the mean");
}

#[test]
fn without_counts_as_many_shapes_are_taken_as_there_are() {
    let folder = heads();
    let result = json(folder.path(), &with(&["--draws", "1", "--json", "--pose", "identity"]));
    assert_eq!(
        result["counts"].as_object().map(|counts| counts.keys().cloned().collect()),
        Some(vec!["6".to_owned()])
    );
    let settings = std::fs::read_to_string(folder.path().join("evaluation/settings.json")).unwrap();
    let settings: Value = serde_json::from_str(&settings).unwrap();
    assert_eq!(
        (&settings["counts"], &settings["pose of the training shapes"]),
        (&"6".into(), &"never".into())
    );
}

#[test]
fn surfaces_are_written_on_request() {
    let folder = heads();
    succeeds(folder.path(), &with(&["--counts", "2", "--draws", "1", "--surfaces", "-o", "out"]));
    let surfaces = |output: &str| {
        let all = files(&folder.path().join(output));
        let folders = all.into_iter().filter(|name| name.starts_with("surfaces-"));
        folders.map(|name| files(&folder.path().join(output).join(name))).collect::<Vec<_>>()
    };
    let [names] = surfaces("out").try_into().expect("one folder");
    assert!(names.contains(&"2-0-shape_6-local.ply".into()), "{names:?}");
    assert_eq!(names.len(), 2 * 4);
    // Results that are there already get theirs, and each method has its own.
    let run = ["--counts", "2", "--draws", "1", "-o", "later"];
    succeeds(folder.path(), &with(&run));
    assert!(surfaces("later").is_empty());
    let before = std::fs::read(folder.path().join("later/results.csv")).unwrap();
    succeeds(folder.path(), &with(&[&run[..], &["--surfaces"]].concat()));
    assert_eq!(surfaces("later"), [names]);
    assert!(std::fs::read(folder.path().join("later/results.csv")).unwrap() == before, "no result twice");
    succeeds(folder.path(), &with(&[&run[..], &["--surfaces", "--stride", "1"]].concat()));
    assert_eq!(surfaces("later").len(), 2);
}

#[test]
fn a_target_that_cannot_be_approximated_does_not_end_the_others() {
    let folder = heads();
    let mut away = Head::sample(3, 9).mesh();
    away.points.iter_mut().for_each(|p| p.x += 1000.0);
    save(folder.path(), "targets", 9, &away);
    let output = lacuna(
        folder.path(),
        &with(&["--counts", "3", "--draws", "1", "--pose", "identity", "--json", "--report", "out"]),
    );
    let complaint = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{complaint}");
    assert!(complaint.contains("a target could not be approximated"), "{complaint}");
    let result: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert!(median(&result, "3", "floor") < median(&result, "3", "local"), "{result}");
    let note = |note: &Value| note.as_str().is_some_and(|note| note.starts_with("target shape_9: "));
    assert!(result["notes"].as_array().is_some_and(|notes| notes.iter().any(note)), "{result}");
    let written = |name: &str| std::fs::read_to_string(folder.path().join(name)).unwrap();
    let table = written("evaluation/results.csv");
    assert!(table.lines().count() == 2 * 4 + 1 && !table.contains("shape_9"), "{table}");
    assert!(written("out/evaluation.html").contains("<li>target shape_9: "));
    let settings: Value = serde_json::from_str(&written("evaluation/settings.json")).unwrap();
    assert_eq!(settings["program"], concat!("lacuna ", env!("CARGO_PKG_VERSION")));
    assert_eq!(settings["pose of the targets"], "identity");
}

#[test]
fn tables_of_something_else_are_not_replaced() {
    let folder = heads();
    let runs = [("results.csv", &[][..]), ("settings.json", &[]), ("ablation.csv", &["--ablation"])];
    for (name, switches) in runs {
        let file = folder.path().join(name);
        std::fs::write(&file, "{}").unwrap();
        let sentence = refuses(folder.path(), &with(&[switches, &["-o", "."]].concat()));
        assert!(sentence.contains(&format!("{name} is there without the settings")), "{sentence}");
        assert_eq!(std::fs::read(&file).unwrap(), b"{}");
        std::fs::remove_file(file).unwrap();
    }
}

#[test]
fn what_cannot_be_evaluated_is_refused() {
    let folder = heads();
    let sentence = refuses(folder.path(), &with(&["--counts", "7", "-o", "."]));
    assert!(sentence.contains("7 training shapes were asked for and 6 are there"), "{sentence}");
    let usages = [
        &["--counts", "1"][..],
        &["--pose", "upright"],
        &["--ablation", "--method", "paper"],
        &["--smooth", "field", "--stride", "2"],
    ];
    for usage in usages {
        assert_eq!(lacuna(folder.path(), &with(usage)).status.code(), Some(2), "{usage:?}");
    }
}

#[test]
fn a_target_by_two_names_is_one() {
    let folder = heads();
    let targets = ["targets/shape_6.ply", "targets/../targets/shape_6.ply"];
    let said =
        refuses(folder.path(), &[&["evaluate", "--train", "train", "--targets"], &targets[..]].concat());
    assert!(said.contains("targets/../targets/shape_6.ply: given twice"), "{said}");
}
