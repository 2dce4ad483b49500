//! `lacuna check` of several files and of folders.

use lacuna_host::io::{Format, PlyOut, parse, write_ply};
use lacuna_host::mesh::{Point, Vector};
use lacuna_host::surface::boundary_edges;
use lacuna_host::synth::Head;
use lacuna_tests::program::{files, json, lacuna, refuses, succeeds};
use std::path::Path;
use tempfile::tempdir;

/// What the program says on standard output and on standard error, and its exit code.
fn check(folder: &Path, arguments: &[&str]) -> (String, String, Option<i32>) {
    let output = lacuna(folder, &[&["check"], arguments].concat());
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (text(&output.stdout), text(&output.stderr), output.status.code())
}

#[test]
fn all_meshes_of_a_folder_are_checked() {
    let folder = tempdir().unwrap();
    succeeds(folder.path(), &["synth", "heads", "heads", "--count", "2"]);
    std::fs::write(folder.path().join("heads/remarks.txt"), "no mesh").unwrap();
    std::fs::write(folder.path().join("heads/cloud.pcd"), "no cloud").unwrap();
    let (said, _, code) = check(folder.path(), &["heads"]);
    let lines: Vec<&str> = said.lines().filter(|line| !line.starts_with(' ')).collect();
    assert_eq!((lines.len(), code), (3, Some(1)), "{said}");
    assert!(lines[0].contains("cloud.pcd: cannot be used"), "{said}");
    for (line, name) in lines[1..].iter().zip(["head_000.ply: ", "head_001.ply: "]) {
        assert!(line.contains(name) && line.contains(" triangles"), "{line}");
    }
}

#[test]
fn a_mesh_of_a_folder_that_is_in_another_unit_is_told() {
    let folder = tempdir().unwrap();
    succeeds(folder.path(), &["synth", "heads", "heads", "--count", "2"]);
    let mut metres = Head::sample(1, 5).mesh();
    metres.points.iter_mut().for_each(|p| *p /= 1000.0);
    write_ply(&folder.path().join("heads/head_005.ply"), &PlyOut::new(&metres)).unwrap();
    let told = |said: &str| said.matches("another unit than the others (0.00").count();
    let (said, _, code) = check(folder.path(), &["heads"]);
    assert_eq!((told(&said), code), (1, Some(0)), "{said}");
    let singly = ["heads/head_000.ply", "heads/head_001.ply", "heads/head_005.ply"];
    assert_eq!(told(&check(folder.path(), &singly).0), 0, "files need not be one set");
}

#[test]
fn a_folder_without_a_mesh_says_so() {
    let folder = tempdir().unwrap();
    std::fs::create_dir(folder.path().join("empty")).unwrap();
    let (_, said, code) = check(folder.path(), &["empty"]);
    let sentence = "lacuna: empty: there is no mesh or cloud (ply, obj, stl, pcd, xyz, pts) and no scan.json in this folder\n";
    assert_eq!((said.as_str(), code), (sentence, Some(1)));
}

#[test]
fn every_file_that_cannot_be_used_has_its_reason() {
    let folder = tempdir().unwrap();
    let here = folder.path();
    std::fs::write(here.join("good.ply"), lacuna_fixtures::SCAN).unwrap();
    std::fs::write(here.join("empty.ply"), "").unwrap();
    std::fs::write(here.join("picture.png.ply"), b"\x89PNG\r\n").unwrap();
    let (said, complaint, code) = check(here, &["empty.ply", "good.ply", "nowhere.ply", "picture.png.ply"]);
    for (name, reason) in [
        ("empty.ply", "the file is empty"),
        ("nowhere.ply", "cannot read nowhere.ply: there is no such file"),
        ("picture.png.ply", "this is a picture"),
    ] {
        assert!(said.contains(&format!("{name}: cannot be used\n  {reason}")), "{name}: {said}");
    }
    assert_eq!((complaint.as_str(), code), ("lacuna: 3 of 4 files cannot be used\n", Some(1)));
}

#[test]
fn a_single_file_has_its_reason_in_the_complaint() {
    let folder = tempdir().unwrap();
    std::fs::write(folder.path().join("empty.ply"), "").unwrap();
    let (said, complaint, _) = check(folder.path(), &["empty.ply"]);
    assert_eq!(said, "empty.ply: cannot be used\n");
    assert_eq!(complaint, "lacuna: empty.ply: the file is empty; export it again\n");
}

#[test]
fn a_sparse_cloud_is_told_how_little_it_measures() {
    let folder = tempdir().unwrap();
    let here = folder.path();
    std::fs::write(here.join("heads.lacuna"), lacuna_fixtures::MODEL).unwrap();
    let scan = parse(Format::Ply, lacuna_fixtures::SCAN).unwrap();
    for (count, sparse) in [(150, true), (2000, false)] {
        let every = scan.points.len() / count;
        let line = |p: &nalgebra::Point3<f64>| format!("{} {} {}\n", p.x, p.y, p.z);
        let text: String = scan.points.iter().step_by(every).take(count).map(line).collect();
        std::fs::write(here.join("cloud.xyz"), text).unwrap();
        let (said, complaint, _) = check(here, &["cloud.xyz", "--model", "heads.lacuna"]);
        assert_eq!(said.contains(&format!("{count} points measure at most")), sparse, "{said}{complaint}");
    }
}

#[test]
fn a_closed_surface_that_faces_outwards_is_not_flipped_and_that_is_told() {
    let folder = tempdir().unwrap();
    let mut closed = Head::sample(1, 1000).mesh();
    // A fan over the neck.
    let (middle, rim) = (closed.points.len() as u32, boundary_edges(&closed));
    let sum = rim.iter().fold(Vector::zeros(), |sum, edge| sum + closed.points[edge[0] as usize].coords);
    closed.points.push(Point::from(sum / rim.len() as f64));
    closed.triangles.extend(rim.iter().map(|&[from, to]| [to, from, middle]));
    write_ply(&folder.path().join("head.ply"), &PlyOut::new(&closed)).unwrap();
    let found = json(folder.path(), &["register", "head.ply", "--flip", "--json"]);
    let notes = found["notes"].to_string();
    assert!(notes.contains("--flip was left out") && !notes.contains("turned round"), "{notes}");
}

#[test]
fn a_surface_too_fine_for_the_memory_allowed_is_refused_before_the_work() {
    let folder = tempdir().unwrap();
    let sentence = refuses(folder.path(), &["complete", "--finer", "4", "--max-memory", "200M"]);
    assert!(sentence.contains("4 times as fine") && sentence.contains("lower --finer"), "{sentence}");
    assert!(files(folder.path()).is_empty());
}
