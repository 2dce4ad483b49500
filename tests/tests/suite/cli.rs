//! What the program does when all is well: files, numbers, exit code 0.

use lacuna_tests::program::{files, json, lacuna, succeeds};
use lacuna_tests::{degrees_between, model};
use serde_json::Value;
use std::path::Path;
use tempfile::tempdir;

fn matrix(value: &Value) -> [[f64; 4]; 4] {
    serde_json::from_value(value.clone()).expect("a 4 x 4 matrix")
}

fn scan(folder: &Path, head: &str, view: &str) -> Value {
    json(folder, &["synth", "scan", "scan", "--head", head, "--view", view, "--small", "--json"])
}

#[test]
fn complete_without_arguments_writes_mesh_and_picture() {
    let folder = tempdir().unwrap();
    let text = succeeds(folder.path(), &["complete"]);
    assert_eq!(files(folder.path()), ["completed.ply", "completed.png"]);
    let mesh = lacuna_host::io::read(&folder.path().join("completed.ply")).unwrap();
    assert!(mesh.triangles.len() > 1000);
    let picture = std::fs::read(folder.path().join("completed.png")).unwrap();
    assert!(picture.starts_with(b"\x89PNG\r\n\x1a\n"));
    for word in ["verdict", "fitted surface", "seen part", "inferred part", "expected error", "weights"] {
        assert!(text.contains(word), "{word} is not reported:\n{text}");
    }
}

#[test]
fn complete_tells_the_verdict_and_labels_every_vertex_measured_or_inferred() {
    let folder = tempdir().unwrap();
    let report = json(folder.path(), &["complete", "--json", "--no-picture"]);
    assert_eq!(report["verdict"]["grade"], "good", "{report:#}");
    for number in ["inlier_share", "seen_rms", "inferred_share", "weight_norm", "expected"] {
        assert!(report["verdict"][number].is_number(), "{number}: {report:#}");
    }
    assert_eq!(report["output"], "completed.ply");
    let file = std::fs::read(folder.path().join("completed.ply")).unwrap();
    let end = file.windows(11).position(|w| w == b"end_header\n").expect("a PLY header");
    let header = String::from_utf8_lossy(&file[..end]);
    for property in ["red", "label", "distance", "expected_error"] {
        assert!(header.contains(&format!(" {property}\n")), "{property} is missing:\n{header}");
    }
    let (measured, all) = (&report["measured_vertices"], &report["vertices"]);
    assert!(0 < measured.as_u64().unwrap() && measured.as_u64() < all.as_u64());
}

#[test]
fn complete_tells_the_noise_that_it_takes_out_and_keeps_it_when_asked() {
    let folder = tempdir().unwrap();
    let run = |more: &[&str]| {
        json(folder.path(), &[&["complete", "--no-picture", "--json", "-o", "c.ply"], more].concat())
    };
    let noise = &run(&[])["noise"];
    let [before, after] = ["before", "after"].map(|name| noise[name].as_f64().unwrap());
    assert!(before > 0.02 && before < 0.3 && after < before, "{before} {after}");
    assert_eq!(run(&["--keep-noise"])["noise"], Value::Null);
    let text = succeeds(folder.path(), &["complete", "--no-picture", "-o", "c.ply"]);
    assert!(text.contains("after smoothing (--keep-noise keeps it)"), "{text}");
}

#[test]
fn heads_are_scanned_among_hair_and_clothes_and_with_more_noise() {
    let folder = tempdir().unwrap();
    let path = folder.path();
    let base = ["synth", "scan", "scan", "--view", "stitched", "--small", "--json"];
    let points = |more: &[&str]| {
        let info = json(path, &[base.as_slice(), more].concat());
        (info["with"].clone(), lacuna_host::io::read(&path.join("scan/points.ply")).unwrap().points)
    };
    let ((none, alone), (with, among)) = (points(&[]), points(&["--with", "hair,collar,table"]));
    assert_eq!((none, with), (serde_json::json!([]), serde_json::json!(["hair", "collar", "table"])));
    assert!(among.len() > alone.len() + alone.len() / 5, "{} {}", among.len(), alone.len());
    assert_ne!(points(&["--noise", "1"]).1, alone);
    for bad in [["--with", "hat"], ["--noise", "-1"], ["--noise", "NaN"]] {
        let output = lacuna(path, &[base.as_slice(), &bad].concat());
        let text = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.code() == Some(2) && text.contains(bad[0]), "{text}");
    }
}

#[test]
fn numbers_that_no_head_has_are_refused() {
    let folder = tempdir().unwrap();
    for wrong in
        [["--first", "18446744073709551615"], ["--relief", "300"], ["--relief", "-1"], ["--relief", "nan"]]
    {
        let output = lacuna(folder.path(), &[&["synth", "heads", "a", "-c", "1"][..], &wrong].concat());
        assert_eq!(output.status.code(), Some(2), "{wrong:?}: {output:?}");
    }
}

#[test]
fn a_mesh_of_the_users_is_scanned_as_a_head_is() {
    let folder = tempdir().unwrap();
    let path = folder.path();
    succeeds(path, &["synth", "heads", "heads", "--count", "1"]);
    let mesh = "heads/head_000.ply";
    let info =
        json(path, &["synth", "scan", "scan", "--mesh", mesh, "--view", "stitched", "--small", "--json"]);
    assert_eq!((&info["name"], info["views"].as_array().map(Vec::len)), (&mesh.into(), Some(3)));
    let read = |name: &str| lacuna_host::io::read(&path.join(name)).unwrap();
    assert_eq!(read("scan/truth.ply").points, read(mesh).points);
    assert!(read("scan/mesh.ply").triangles.len() > 10_000);
    // Several views are off beside each other without showing it.
    succeeds(path, &["synth", "scan", "front", "--mesh", mesh, "--small"]);
    let hidden = |scan: &str| {
        let report = json(path, &["complete", scan, "--no-picture", "--json"]);
        report["expected_error"]["hidden"].as_f64().expect("a number")
    };
    assert_eq!(hidden("front/mesh.ply"), 0.0);
    assert!((0.09..0.13).contains(&hidden("scan/mesh.ply")));
    // A cloud has no surface that a ray could meet.
    let refused = lacuna(path, &["synth", "scan", "other", "--mesh", "scan/points.ply"]);
    let complaint = String::from_utf8_lossy(&refused.stderr);
    assert!(
        !refused.status.success() && complaint.contains("sees nothing of scan/points.ply"),
        "{complaint}"
    );
    assert!(!path.join("other").exists());
}

#[test]
fn a_simulated_scan_names_its_truth_from_the_folder_above() {
    let folder = tempdir().unwrap();
    scan(folder.path(), "3", "front");
    let sample = lacuna_tests::sample::real(&folder.path().join("scan"));
    assert_eq!(sample.missing.len(), sample.truth.points.len());
}

#[test]
fn a_pipe_gets_no_progress_bars() {
    let folder = tempdir().unwrap();
    succeeds(folder.path(), &["synth", "heads", "heads", "--count", "4"]);
    let arguments = ["train", "heads", "-o", "m.lacuna", "--spacing", "18"];
    let output = lacuna(folder.path(), &arguments);
    for stream in [&output.stdout, &output.stderr] {
        assert!(!stream.contains(&0x1b) && !stream.contains(&b'\r'), "{}", String::from_utf8_lossy(stream));
    }
    assert!(output.status.success() && output.stderr.is_empty());
}

#[test]
fn wrong_usage_exits_with_2() {
    let folder = tempdir().unwrap();
    let wrong: [&[&str]; 7] = [
        &[],
        &["compete"],
        &["complete", "--no-such-option"],
        &["complete", "--threads", "0"],
        &["complete", "--unit", "ell"],
        &["complete", "--finer", "9"],
        &["train", "-o", "m.lacuna"],
    ];
    for arguments in wrong {
        let output = lacuna(folder.path(), arguments);
        assert_eq!(output.status.code(), Some(2), "lacuna {arguments:?}");
        assert!(!output.stderr.is_empty());
    }
    assert!(files(folder.path()).is_empty());
}

#[test]
fn inspect_json_describes_the_built_in_model() {
    let folder = tempdir().unwrap();
    let report = json(folder.path(), &["inspect", "--json"]);
    let model = model();
    assert_eq!(report["checksum"], format!("{:08x}", model.checksum()));
    assert_eq!(report["modes"], model.modes());
    assert_eq!(report["voxels"], model.voxels());
    assert_eq!((&report["shapes"], &report["unit"]), (&30.into(), &"mm".into()));
}

#[test]
fn a_scan_is_registered_from_front_and_side_and_from_its_mesh_points_and_depth_image_alike() {
    let folder = tempdir().unwrap();
    let scans: [(&str, &str, &[&str]); 2] = [
        ("1001", "side", &["scan/mesh.ply"]),
        ("1002", "front", &["scan/mesh.ply", "scan/points.ply", "scan/scan.json", "scan"]),
    ];
    for (head, view, files) in scans {
        let truth = matrix(&scan(folder.path(), head, view)["truth"]["scan_to_model"]);
        for file in files {
            let found = json(folder.path(), &["register", file, "--json"]);
            let degrees = degrees_between(&truth, &matrix(&found["scan_to_model"]));
            assert!(degrees < 5.0, "head {head} from the {view}, {file}: {degrees:.1} degrees off");
            assert!(found["inlier_share"].as_f64().unwrap() > 0.5, "{file}: {found}");
        }
    }
}

#[test]
fn inspect_writes_the_constants_that_firmware_is_built_with() {
    let folder = tempdir().unwrap();
    succeeds(folder.path(), &["inspect", "--rust", "sizes.rs"]);
    let text = std::fs::read_to_string(folder.path().join("sizes.rs")).unwrap();
    let sizes = lacuna::Sizes::required(&model(), &lacuna::Schedule::of(&model())).unwrap();
    for (name, value) in
        [("TARGETS", sizes.targets), ("NODE_WEIGHTS", sizes.node_weights), ("GLOBAL", sizes.global)]
    {
        assert!(text.contains(&format!("pub const {name}: usize = {value};\n")), "{name} in {text}");
    }
    assert_eq!(text.lines().filter(|line| line.starts_with("pub const")).count(), sizes.named().len());
}

#[test]
fn of_a_wrong_pose_that_was_given_the_first_reason_is_that() {
    let folder = tempdir().unwrap();
    let turned = "[[1, 0, 0, 0], [0, 0.6, -0.8, 0], [0, 0.8, 0.6, 0], [0, 0, 0, 1]]";
    std::fs::write(folder.path().join("pose.json"), turned).unwrap();
    for option in ["--pose", "--pose-hint"] {
        let report = json(folder.path(), &["complete", option, "pose.json", "--no-picture", "--json"]);
        let reason = &report["verdict"]["reasons"][0];
        let told = format!("the pose was given: is {option} right?");
        assert!(reason.as_str().is_some_and(|reason| reason.starts_with(&told)), "{option}: {report}");
    }
}
