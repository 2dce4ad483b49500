//! What the program does with data it cannot use: a sentence that names the file, exit code 1, no file left.

use lacuna::Model;
use lacuna::format::{CHECKSUM_AT, PREFIX, checksum};
use lacuna_host::io::{Format, PlyOut, parse, write_ply};
use lacuna_host::mesh::Vector;
use lacuna_tests::program::{files, json, lacuna, path, refuses, succeeds};
use std::path::Path;
use tempfile::{TempDir, tempdir};

/// A folder with one file in it.
fn folder_with(name: &str, bytes: &[u8]) -> TempDir {
    let folder = tempdir().unwrap();
    std::fs::write(folder.path().join(name), bytes).unwrap();
    folder
}

fn assert_says(complaint: &str, words: &[&str]) {
    for word in words {
        assert!(complaint.contains(word), "no \"{word}\" in: {complaint}");
    }
}

/// The example scan times a factor.
fn scaled_scan(folder: &Path, factor: f64) {
    let mut mesh = parse(Format::Ply, lacuna_fixtures::SCAN).unwrap();
    mesh.points.iter_mut().for_each(|p| *p *= factor);
    write_ply(&folder.join("scan.ply"), &PlyOut::new(&mesh)).unwrap();
}

fn ply(vertices: &[&str], faces: &[&str]) -> String {
    let header = format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n\
         element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        vertices.len(),
        faces.len()
    );
    [&[header.trim_end()], vertices, faces].concat().join("\n") + "\n"
}

#[test]
fn a_missing_scan_is_named() {
    let folder = tempdir().unwrap();
    assert_says(&refuses(folder.path(), &["complete", "nowhere.ply"]), &["nowhere.ply"]);
    assert_says(&refuses(folder.path(), &["register", "nowhere.ply"]), &["nowhere.ply"]);
}

#[test]
fn a_missing_model_is_named() {
    let folder = tempdir().unwrap();
    assert_says(&refuses(folder.path(), &["complete", "--model", "nowhere.lacuna"]), &["nowhere.lacuna"]);
    assert_says(&refuses(folder.path(), &["inspect", "nowhere.lacuna"]), &["nowhere.lacuna"]);
}

#[test]
fn an_empty_mesh_is_refused() {
    let folder = folder_with("empty.ply", ply(&[], &[]).as_bytes());
    assert_says(&refuses(folder.path(), &["complete", "empty.ply"]), &["empty.ply"]);
    std::fs::write(folder.path().join("nothing.ply"), b"").unwrap();
    assert_says(&refuses(folder.path(), &["complete", "nothing.ply"]), &["nothing.ply"]);
}

#[test]
fn a_vertex_that_is_not_a_number_is_refused() {
    let folder = folder_with("nan.ply", ply(&["0 0 0", "1 nan 0", "0 1 0"], &["3 0 1 2"]).as_bytes());
    assert_says(&refuses(folder.path(), &["complete", "nan.ply"]), &["nan.ply"]);
    assert_says(&refuses(folder.path(), &["train", "nan.ply", "nan.ply", "-o", "m.lacuna"]), &["nan.ply"]);
}

#[test]
fn a_scan_is_not_a_model() {
    let folder = folder_with("scan.ply", lacuna_fixtures::SCAN);
    let complaint = refuses(folder.path(), &["complete", "--model", "scan.ply"]);
    assert_says(&complaint, &["scan.ply", "not a Lacuna model"]);
    refuses(folder.path(), &["inspect", "scan.ply"]);
}

#[test]
fn a_truncated_model_is_refused() {
    for length in [0, 7, 20, 5000, lacuna_fixtures::MODEL.len() - 1] {
        let folder = folder_with("short.lacuna", &lacuna_fixtures::MODEL[..length]);
        assert_says(&refuses(folder.path(), &["complete", "-m", "short.lacuna"]), &["short.lacuna"]);
    }
}

#[test]
fn a_model_with_a_flipped_bit_is_refused() {
    let mut bytes = lacuna_fixtures::MODEL.to_vec();
    bytes[100_000] ^= 4;
    let folder = folder_with("flipped.lacuna", &bytes);
    assert_says(
        &refuses(folder.path(), &["complete", "-m", "flipped.lacuna"]),
        &["flipped.lacuna", "damaged"],
    );
}

#[test]
fn a_model_whose_length_scale_does_not_belong_to_its_shape_is_refused() {
    let mut bytes = lacuna_fixtures::MODEL.to_vec();
    let scales = Model::from_bytes(lacuna_fixtures::MODEL).unwrap().header().scales;
    let own = scales.millimetre.to_le_bytes();
    let at = bytes.windows(4).position(|window| window == own).unwrap();
    bytes[at..at + 4].copy_from_slice(&0.05f32.to_le_bytes());
    let sum = checksum(&bytes);
    bytes[CHECKSUM_AT..PREFIX].copy_from_slice(&sum.to_le_bytes());
    assert_eq!(Model::from_bytes(&bytes).unwrap().header().scales.millimetre, 0.05);
    let folder = folder_with("scaled.lacuna", &bytes);
    for command in ["complete", "register"] {
        assert_says(
            &refuses(folder.path(), &[command, "-m", "scaled.lacuna"]),
            &["scaled.lacuna", "length scale"],
        );
    }
    let little = ["complete", "--max-memory", "1M", "--no-picture"];
    assert_says(&refuses(folder.path(), &little), &["--max-memory allows 1048576"]);
}

#[test]
fn a_scan_of_another_unit_is_refused_with_its_size() {
    for (factor, unit) in [(1e3, "micrometres"), (1e-3, "metres")] {
        let folder = tempdir().unwrap();
        scaled_scan(folder.path(), factor);
        let complaint = refuses(folder.path(), &["complete", "scan.ply"]);
        assert_says(&complaint, &["scan.ply", "long", unit, "--unit"]);
    }
}

#[test]
fn a_pose_of_another_unit_is_refused_with_its_size() {
    let folder = tempdir().unwrap();
    for (scale, option) in [(1e3, "--pose-hint"), (1e-3, "--pose"), (1e17, "--pose-hint")] {
        let row = |i: usize| std::array::from_fn::<f64, 4, _>(|j| if i == j { scale } else { 0.0 });
        let matrix = [row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]];
        std::fs::write(folder.path().join("pose.json"), format!("{matrix:?}")).unwrap();
        let complaint = refuses(folder.path(), &["complete", option, "pose.json"]);
        assert_says(&complaint, &["pose.json", "times as large", "--unit"]);
    }
}

#[test]
fn a_matrix_that_is_no_similarity_of_columns_is_refused_and_its_multiples_are_the_same() {
    let folder = tempdir().unwrap();
    let register = json(folder.path(), &["register", "--json"]);
    let number = |value: &serde_json::Value| value.as_f64().unwrap();
    let rows: [[f64; 4]; 4] =
        std::array::from_fn(|i| std::array::from_fn(|j| number(&register["scan_to_model"][i][j])));
    let write = |rows: [[f64; 4]; 4]| {
        std::fs::write(folder.path().join("pose.json"), serde_json::to_string(&rows).unwrap()).unwrap();
    };
    let arguments = ["complete", "--pose-hint", "pose.json", "--no-picture", "--json"];
    let digests = || json(folder.path(), &arguments)["digests"].clone();
    write(rows);
    let plain = digests();
    write(rows.map(|row| row.map(|value| 2.0 * value)));
    assert_eq!(digests(), plain);
    let [x, y, z, _] = rows;
    write([x, y, z, [1.0, 2.0, 3.0, 1.0]]);
    assert_says(&refuses(folder.path(), &arguments), &["pose.json", "1 2 3 1", "transpose"]);
}

#[test]
fn the_unit_asked_for_is_accepted() {
    let folder = tempdir().unwrap();
    scaled_scan(folder.path(), 1e-3);
    let output = lacuna(folder.path(), &["complete", "scan.ply", "--unit", "m", "--no-picture"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let mesh = lacuna_host::io::read(&folder.path().join("completed.ply")).unwrap();
    let (low, high) = mesh.bounds().unwrap();
    assert!((high - low).max() < 1.0, "the result is in the scan's unit");
    let found = json(folder.path(), &["register", "scan.ply", "--unit", "m", "--json"]);
    let first = |row: usize| found["scan_to_model"][row][0].as_f64().unwrap();
    let scale = (0..3).map(|row| first(row) * first(row)).sum::<f64>().sqrt();
    assert!((scale / 1000.0 - 1.0).abs() < 0.3, "the matrix is for the file as it is: {scale}");
    std::fs::write(folder.path().join("pose.json"), found["scan_to_model"].to_string()).unwrap();
    let hinted =
        ["complete", "scan.ply", "--unit", "m", "--no-picture", "--pose-hint", "pose.json", "--json"];
    assert_eq!(json(folder.path(), &hinted)["verdict"]["grade"], "good");
}

#[test]
fn a_scan_millions_of_its_lengths_away_is_completed() {
    let folder = tempdir().unwrap();
    let mut mesh = parse(Format::Ply, lacuna_fixtures::SCAN).unwrap();
    mesh.points.iter_mut().for_each(|p| *p += Vector::new(4e8, -5e9, 1e8));
    let vertices: Vec<String> = mesh.points.iter().map(|p| format!("v {} {} {}", p.x, p.y, p.z)).collect();
    let faces = mesh.triangles.iter().map(|t| t.map(|v| (v + 1).to_string()).join(" "));
    let faces: Vec<String> = faces.map(|corners| format!("f {corners}")).collect();
    std::fs::write(folder.path().join("scan.obj"), [vertices, faces].concat().join("\n")).unwrap();
    let said = json(folder.path(), &["complete", "scan.obj", "--no-picture", "--json"]);
    assert_eq!(said["verdict"]["grade"], "good", "{said}");
}

#[test]
fn a_missing_output_folder_is_named() {
    let folder = tempdir().unwrap();
    let complaint = refuses(folder.path(), &["complete", "-o", "no/such/folder/completed.ply"]);
    assert_says(&complaint, &["no/such/folder/completed.ply"]);
    // Before any work is done: two shapes far too coarse for a model would be the reason otherwise.
    assert!(lacuna(folder.path(), &["synth", "heads", "heads", "-c", "2"]).status.success());
    let train = ["train", "heads", "--spacing", "300", "-o", "no/head.lacuna"];
    assert_says(&refuses(folder.path(), &train), &["no/head.lacuna", "does not exist"]);
    assert_says(&refuses(folder.path(), &["inspect", "--modes", "no/modes.png"]), &["does not exist"]);
}

/// Each command would find something else wrong with its data first, if it looked at them.
#[test]
fn an_output_that_cannot_be_written_is_found_before_any_work() {
    let folder = folder_with("kept.ply", b"an older result");
    let here = folder.path();
    assert!(lacuna(here, &["synth", "heads", "heads", "-c", "2"]).status.success());
    let kept = here.join("kept.ply");
    let mut permissions = std::fs::metadata(&kept).unwrap().permissions();
    permissions.set_readonly(true);
    std::fs::set_permissions(&kept, permissions).unwrap();
    std::fs::copy(&kept, here.join("kept.lacuna")).unwrap();
    std::fs::create_dir_all(here.join("reports/new.html")).unwrap();
    let long = format!("{}.lacuna", "x".repeat(300));
    let wrong: [(&[&str], &str); 7] = [
        (&["complete", "nowhere.ply", "-o", "kept.ply"], "kept.ply: access is denied"),
        (&["complete", "nowhere.ply", "-o", "new/"], "new/: this is a folder"),
        (&["train", "heads", "-o", &long], "the name is too long"),
        (
            &["complete", "nowhere.ply", "-o", "new.ply", "--local-surface", "kept.ply"],
            "kept.ply: access is denied",
        ),
        (&["complete", "nowhere.ply", "-o", "new.ply", "--report", "reports"], "new.html: this is a folder"),
        (&["train", "heads", "--spacing", "300", "-o", "kept.lacuna"], "kept.lacuna: access is denied"),
        (&["evaluate", "--train", "nowhere", "--targets", "heads", "-o", "kept.ply"], "kept.ply is a file"),
    ];
    for (arguments, reason) in wrong {
        assert_says(&refuses(here, arguments), &[reason]);
    }
    assert_eq!(std::fs::read(&kept).unwrap(), b"an older result");
}

#[test]
fn what_something_else_made_is_not_replaced_by_a_file_that_nobody_named() {
    let folder = folder_with("done.html", b"somebody's page");
    let here = folder.path();
    succeeds(here, &["synth", "scan", "a", "--small"]);
    succeeds(here, &["synth", "scan", "a", "--small"]);
    let depth = std::fs::read(here.join("a/depth.png")).unwrap();
    // The mesh beside it is a completed one.
    succeeds(here, &["complete", "a", "-o", "a/depth.ply", "--no-picture"]);
    let without = succeeds(here, &["complete", "-o", "a/depth.ply"]);
    assert_says(&without, &["no picture", "a/depth.png may be something else's", "--picture"]);
    assert_eq!(std::fs::read(here.join("a/depth.png")).unwrap(), depth);
    let page = ["complete", "-o", "done.ply", "--no-picture", "--report", "."];
    assert_says(&refuses(here, &page), &["done.html is there", "another folder"]);
    assert_eq!(std::fs::read(here.join("done.html")).unwrap(), b"somebody's page");
    std::fs::create_dir(here.join("mine")).unwrap();
    std::fs::copy(here.join("a/mesh.ply"), here.join("mine/mesh.ply")).unwrap();
    assert_says(&refuses(here, &["synth", "scan", "mine"]), &["mesh.ply is there", "another folder"]);
    let mine = ["complete", "-o", "mine.ply", "--report", "reports"];
    succeeds(here, &mine);
    succeeds(here, &mine);
}

#[test]
fn one_left_out_needs_enough_others() {
    let folder = tempdir().unwrap();
    assert!(lacuna(folder.path(), &["synth", "heads", "heads", "-c", "3"]).status.success());
    let output = lacuna(folder.path(), &["train", "heads", "-o", "m.lacuna", "--leave-one-out"]);
    assert_eq!(output.status.code(), Some(2), "{output:?}");
    assert_says(&String::from_utf8_lossy(&output.stderr), &["needs 4 shapes or more, here are 3"]);
}

#[test]
fn a_scan_that_cannot_be_verified_is_named_and_those_before_it_are_told() {
    let folder = folder_with("good.ply", lacuna_fixtures::SCAN);
    let flat = ply(&["0 0 0", "200 0 0", "0 200 0"], &["3 0 1 2"]);
    std::fs::write(folder.path().join("flat.ply"), flat).unwrap();
    let output = lacuna(folder.path(), &["verify", "good.ply", "flat.ply", "--json"]);
    assert_eq!(output.status.code(), Some(1));
    assert_says(&String::from_utf8_lossy(&output.stderr), &["flat.ply: "]);
    let told: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((told[0]["case"].as_str(), told.as_array().map(Vec::len)), (Some("good.ply"), Some(1)));
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_told() {
    let folder = tempdir().unwrap();
    let complaint = refuses(folder.path(), &["complete", "--no-picture", "-o", "/dev/full"]);
    assert_says(&complaint, &["/dev/full", "full"]);
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_told_of_what_is_printed_too() {
    let full = std::fs::File::options().write(true).open("/dev/full").unwrap();
    let output =
        std::process::Command::new(path()).args(["inspect", "--json"]).stdout(full).output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    assert_says(&String::from_utf8_lossy(&output.stderr), &["standard output"]);
}

#[test]
fn an_older_result_survives_a_failure() {
    let folder = folder_with("completed.ply", b"an older result");
    refuses(folder.path(), &["complete", "nowhere.ply"]);
    assert_eq!(std::fs::read(folder.path().join("completed.ply")).unwrap(), b"an older result");
    assert_eq!(files(folder.path()), ["completed.ply"]);
}

#[test]
fn nothing_that_is_read_is_overwritten_and_no_result_by_another_one() {
    let folder = folder_with("scan.ply", lacuna_fixtures::SCAN);
    std::fs::write(folder.path().join("head.lacuna"), lacuna_fixtures::MODEL).unwrap();
    let wrong: [&[&str]; 7] = [
        &["complete", "scan.ply", "-o", "./scan.ply"],
        &["complete", "scan.ply", "-m", "head.lacuna", "-o", "x.ply", "-p", "head.lacuna"],
        &["complete", "scan.ply", "-o", "x.ply", "--local-surface", "x.ply"],
        &["complete", "scan.ply", "-o", "x.obj"],
        &["complete", "scan.ply", "-o", "x.ply", "-p", "x.jpg"],
        &["inspect", "head.lacuna", "--modes", "head.lacuna"],
        &["register", "scan.ply", "--pack", "scan.ply"],
    ];
    for arguments in wrong {
        let output = lacuna(folder.path(), arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {output:?}");
        let left: Vec<String> = files(folder.path());
        assert_eq!(left, ["head.lacuna", "scan.ply"], "{arguments:?}");
        assert!(std::fs::read(folder.path().join("scan.ply")).unwrap() == lacuna_fixtures::SCAN);
        assert!(std::fs::read(folder.path().join("head.lacuna")).unwrap() == lacuna_fixtures::MODEL);
    }
    let null = lacuna(folder.path(), &["complete", "scan.ply", "-o", "/dev/null"]);
    assert!(null.status.success(), "{null:?}");
}

#[test]
fn images_that_a_description_names_poses_and_meshes_to_be_scanned_are_not_overwritten() {
    let folder = tempdir().unwrap();
    assert!(lacuna(folder.path(), &["synth", "scan", "a", "--small"]).status.success());
    let kept = |name: &str| std::fs::read(folder.path().join("a").join(name)).unwrap();
    let before = ["depth.png", "scan.json", "mesh.ply", "truth.ply"].map(kept);
    std::fs::copy(folder.path().join("a/scan.json"), folder.path().join("pose.ply")).unwrap();
    let without = succeeds(folder.path(), &["complete", "a/mesh.ply", "-o", "a/done.ply"]);
    assert!(!without.contains("no picture"), "{without}");
    assert_eq!(["depth.png", "scan.json", "mesh.ply", "truth.ply"].map(kept), before);
    let wrong: [&[&str]; 7] = [
        &["complete", "a/scan.json", "-o", "x.ply", "-p", "a/mesh.ply"],
        &["complete", "a", "-o", "x.ply", "-p", "a/depth.png"],
        &["complete", "a/depth.png", "-o", "x.ply", "-p", "a/depth.png"],
        &["complete", "a", "--pose-hint", "pose.ply", "-o", "pose.ply"],
        &["complete", "a", "--pose", "pose.ply", "-o", "pose.ply"],
        &["synth", "scan", "a", "--mesh", "a/mesh.ply"],
        &["synth", "scan", "a", "--mesh", "a/truth.ply"],
    ];
    for arguments in wrong {
        let output = lacuna(folder.path(), arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {output:?}");
        assert_eq!(["depth.png", "scan.json", "mesh.ply", "truth.ply"].map(kept), before, "{arguments:?}");
        assert_eq!(std::fs::read(folder.path().join("pose.ply")).unwrap(), before[1]);
    }
}
