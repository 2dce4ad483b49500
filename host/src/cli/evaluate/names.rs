//! What targets are called in tables and file names.

use std::collections::BTreeSet;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

/// The names of files, each given once, without their endings; where these are not enough to tell the files apart, with as
/// many folders in front as are, and with the endings if nothing else differs; numbered where even these are no help.
pub(super) fn of(paths: &[PathBuf]) -> Vec<String> {
    let most = paths.iter().map(|path| path.components().count()).max().unwrap_or(1);
    let tries = (1..=most).map(|parts| (parts, false)).chain((1..=most).map(|parts| (parts, true)));
    let named = |(parts, ending)| paths.iter().map(|path| name(path, parts, ending)).collect::<Vec<_>>();
    tries.map(named).find(|names| are_apart(names)).unwrap_or_else(|| numbered(named((most, true))))
}

fn numbered(names: Vec<String>) -> Vec<String> {
    names.into_iter().enumerate().map(|(number, name)| format!("{}-{name}", number + 1)).collect()
}

/// The last parts of a path, joined so that they can be a file's name.
fn name(path: &Path, parts: usize, ending: bool) -> String {
    let path = if ending { path.to_path_buf() } else { path.with_extension("") };
    let words: Vec<&OsStr> = path.iter().filter(|part| *part != "/").collect();
    let last: Vec<_> =
        words[words.len().saturating_sub(parts)..].iter().map(|word| word.to_string_lossy()).collect();
    last.join("-")
}

fn are_apart(names: &[String]) -> bool {
    let different: BTreeSet<&String> = names.iter().collect();
    different.len() == names.len()
}

#[cfg(test)]
mod tests {
    use super::of;
    use std::path::PathBuf;

    fn names(paths: &[&str]) -> Vec<String> {
        of(&paths.iter().map(PathBuf::from).collect::<Vec<_>>())
    }

    #[test]
    fn folders_and_endings_are_named_where_they_are_needed() {
        assert_eq!(names(&["/a/one.ply", "/b/two.ply"]), ["one", "two"]);
        assert_eq!(names(&["/d/in/one.ply", "/d/off/one.ply"]), ["in-one", "off-one"]);
        assert_eq!(names(&["a/x/one.ply", "b/x/one.ply", "two.ply"]), ["a-x-one", "b-x-one", "two"]);
        assert_eq!(names(&["one.ply", "one.obj"]), ["one.ply", "one.obj"]);
        let same = ["a-b/c.ply", "a/b-c.ply", "c.ply"];
        assert_eq!(names(&same), ["1-a-b-c.ply", "2-a-b-c.ply", "3-c.ply"]);
        assert!(names(&[]).is_empty());
    }
}
