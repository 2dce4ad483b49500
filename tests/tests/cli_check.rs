//! `lacuna check` of several files and of folders.

use lacuna_tests::program::{lacuna, succeeds};
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
    let said = succeeds(folder.path(), &["check", "heads"]);
    let lines: Vec<&str> = said.lines().filter(|line| !line.starts_with(' ')).collect();
    assert_eq!(lines.len(), 2, "{said}");
    for (line, name) in lines.iter().zip(["head_000.ply: ", "head_001.ply: "]) {
        assert!(line.contains(name) && line.contains(" triangles"), "{line}");
    }
}

#[test]
fn a_folder_without_a_mesh_says_so() {
    let folder = tempdir().unwrap();
    std::fs::create_dir(folder.path().join("empty")).unwrap();
    let (_, said, code) = check(folder.path(), &["empty"]);
    let sentence = "lacuna: empty: there is no mesh (ply, obj, stl) and no scan.json in this folder\n";
    assert_eq!((said.as_str(), code), (sentence, Some(1)));
}
