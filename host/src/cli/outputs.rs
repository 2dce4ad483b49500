//! Where a command writes: nothing that it reads, no two results in one file, no result under the name of another format.

use super::Failure;
use crate::io::atomic;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

/// Wrong usage, which ends with exit code 2.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct Usage(pub String);

/// A file that a command writes.
pub struct Output<'a> {
    /// The option that names it.
    pub option: &'static str,
    /// Where it goes.
    pub path: &'a Path,
    /// The extension of its format.
    pub format: &'static str,
}

/// Extensions of formats that are read or written somewhere, and of pictures.
const KNOWN: [&str; 14] =
    ["ply", "obj", "stl", "pcd", "xyz", "png", "jpg", "jpeg", "svg", "json", "html", "csv", "lacuna", "gltf"];

/// As [`apart`], and refuses before any work is done what cannot be written.
pub fn check(inputs: &[impl AsRef<Path>], outputs: &[Output<'_>]) -> Result<(), Failure> {
    apart(inputs, outputs)?;
    Ok(outputs.iter().try_for_each(|output| atomic::check(output.path))?)
}

/// Finds before any work is done that files cannot be written into a folder, which is made if need be.
pub fn check_folder(folder: &Path, files: &[&str]) -> Result<(), Failure> {
    if folder.is_dir() {
        return Ok(files.iter().try_for_each(|file| atomic::check(&folder.join(file)))?);
    }
    // The folder without a name is where the program runs.
    let is_there = |path: &&Path| path.as_os_str().is_empty() || path.exists();
    let there = folder.ancestors().find(is_there).filter(|there| !there.as_os_str().is_empty());
    if let Some(file) = there.filter(|there| !there.is_dir()) {
        return Err(format!("cannot write into {}: {} is a file", folder.display(), file.display()).into());
    }
    // What would be made is written into the lowest folder that is there.
    let made = folder.ancestors().take_while(|path| !is_there(path)).last();
    Ok(made.map_or(Ok(()), atomic::check)?)
}

/// Bytes at the beginning of a file that tell what made it.
const HEAD: u64 = 4096;

/// Refuses to replace a file that is there and does not say, by the `mark` of such files, that a run before this one made it.
/// `instead` is what to do.
pub fn own(path: &Path, mark: &str, instead: &str) -> Result<(), Failure> {
    if is_own(path, mark) {
        return Ok(());
    }
    let name = path.display();
    Err(format!("{name} is there and may be something else's; it would be replaced: delete it, or {instead}")
        .into())
}

/// Whether nothing is there to be replaced, or what a run before this one made, which says so by `mark`.
pub fn is_own(path: &Path, mark: &str) -> bool {
    // Opening a pipe would wait for its other end.
    let marked = || path.is_file() && head_of(path).windows(mark.len()).any(|part| part == mark.as_bytes());
    // A link that leads nowhere is somebody's, too.
    path.symlink_metadata().is_err() || marked()
}

/// The first bytes of a file; none of one that cannot be read.
fn head_of(path: &Path) -> Vec<u8> {
    let mut head = Vec::new();
    // What came before a failure is looked at, too.
    let _ = File::open(path).and_then(|file| file.take(HEAD).read_to_end(&mut head));
    head
}

/// Refuses outputs that would overwrite one of the inputs or each other, or whose names say another format.
pub fn apart(inputs: &[impl AsRef<Path>], outputs: &[Output<'_>]) -> Result<(), Failure> {
    let inputs: Vec<PathBuf> = inputs.iter().filter_map(|path| identity(path.as_ref())).collect();
    for (number, output) in outputs.iter().enumerate() {
        let (option, name) = (output.option, output.path.display());
        if is_standard_output(output.path) {
            let format = output.format;
            return usage(format!(
                "{option} {name}: results are files, none goes to the standard output: give a name with .{format}"
            ));
        }
        if let Some(other) = other_format(output) {
            let format = output.format.to_uppercase();
            return usage(format!(
                "{option} {name}: {format} is written, not {other}: give a name with .{}",
                output.format
            ));
        }
        let Some(own) = identity(output.path) else { continue };
        if inputs.contains(&own) {
            return usage(format!("{option} {name} would overwrite what is read: give another name"));
        }
        if let Some(same) = outputs[..number].iter().find(|o| identity(o.path).as_ref() == Some(&own)) {
            return usage(format!("{option} and {} are both {name}: give them different names", same.option));
        }
    }
    Ok(())
}

/// Whether a path stands for what is printed: between the lines of a report no file would be one.
fn is_standard_output(path: &Path) -> bool {
    let names = ["-", "/dev/stdout", "/dev/stderr", "/dev/tty"];
    // Others are pipes and files of the caller's.
    let streams =
        ["/dev/fd", "/proc/self/fd"].map(|folder| ["1", "2"].map(|stream| Path::new(folder).join(stream)));
    names.iter().any(|name| path == Path::new(name)) || streams.iter().flatten().any(|stream| path == stream)
}

fn usage(text: String) -> Result<(), Failure> {
    Err(Usage(text).into())
}

/// The format that the name of an output says, if it is another one.
fn other_format(output: &Output<'_>) -> Option<String> {
    let extension = output.path.extension()?.to_str()?.to_lowercase();
    (KNOWN.contains(&extension.as_str()) && extension != output.format).then_some(extension)
}

/// The file that a path leads to, there or not; none for devices and pipes, which may be read and written at once.
fn identity(path: &Path) -> Option<PathBuf> {
    match path.canonicalize() {
        Ok(there) => (there.is_file() || there.is_dir()).then_some(there),
        Err(_) => {
            let path = atomic::followed(path);
            let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
            Some(folder.unwrap_or(Path::new(".")).canonicalize().ok()?.join(path.file_name()?))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn output<'a>(option: &'static str, path: &'a Path, format: &'static str) -> Output<'a> {
        Output { option, path, format }
    }

    #[test]
    fn inputs_other_outputs_and_other_formats_are_not_overwritten() {
        let folder = tempfile::tempdir().unwrap();
        let [scan, result] = ["scan.ply", "result.ply"].map(|name| folder.path().join(name));
        std::fs::write(&scan, b"ply").unwrap();
        let around = folder.path().join(".").join("scan.ply");
        let said = |outputs: &[Output<'_>]| check(&[&scan], outputs).map_err(|e| e.to_string());
        assert!(said(&[output("--output", &result, "ply")]).is_ok());
        assert!(said(&[output("--output", Path::new("/dev/null"), "ply")]).is_ok());
        assert!(said(&[output("--output", &around, "ply")]).unwrap_err().contains("overwrite"));
        let twice = [output("--output", &result, "ply"), output("--local-surface", &result, "ply")];
        assert!(said(&twice).unwrap_err().contains("--local-surface and --output are both"));
        assert!(said(&[output("--picture", &result, "png")]).unwrap_err().contains(".png"));
        assert!(said(&[output("--output", Path::new("-"), "ply")]).unwrap_err().contains("standard output"));
        for printed in ["/dev/stdout", "/dev/fd/1", "/proc/self/fd/1"] {
            let printed = [output("--output", Path::new(printed), "ply")];
            assert!(said(&printed).unwrap_err().contains("standard output"));
        }
        let nowhere = folder.path().join("no").join("result.ply");
        assert!(said(&[output("--output", &nowhere, "ply")]).unwrap_err().contains("does not exist"));
        assert!(said(&[output("--output", folder.path(), "ply")]).unwrap_err().contains("is a folder"));
    }

    #[test]
    fn a_folder_that_cannot_be_made_is_found_before_any_work() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("file");
        std::fs::write(&file, b"").unwrap();
        let said = |folder: &Path| check_folder(folder, &["report.html"]).map_err(|e| e.to_string());
        for fine in [folder.path().to_owned(), folder.path().join("new"), folder.path().join("new/below")] {
            assert_eq!(said(&fine), Ok(()));
            assert_eq!(fine.is_dir(), fine == folder.path(), "nothing is made");
        }
        assert_eq!(said(Path::new("not-there")), Ok(()));
        for file in [file.clone(), file.join("below")] {
            assert!(said(&file).unwrap_err().contains("is a file"), "{}", file.display());
        }
        #[cfg(target_os = "linux")]
        for closed in ["/proc/new", "/proc/new/below"] {
            assert!(said(Path::new(closed)).unwrap_err().contains("/proc/new"), "{closed}");
        }
    }

    #[test]
    fn what_something_else_made_is_not_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("picture.png");
        let said = || own(&file, "a mark", "name another").map_err(|e| e.to_string());
        assert_eq!(said(), Ok(()));
        std::fs::write(&file, b"\x89PNG with a mark in it").unwrap();
        assert_eq!(said(), Ok(()));
        for other in [b"\x89PNG of a camera".as_slice(), b""] {
            std::fs::write(&file, other).unwrap();
            assert!(
                said().unwrap_err().ends_with("it would be replaced: delete it, or name another"),
                "{other:?}"
            );
        }
        assert!(own(folder.path(), "a mark", "").is_err());
        #[cfg(unix)]
        {
            let link = folder.path().join("link.png");
            std::os::unix::fs::symlink("nowhere.png", &link).unwrap();
            assert!(own(&link, "a mark", "").is_err() && own(Path::new("/dev/null"), "a mark", "").is_err());
        }
    }

    #[cfg(unix)]
    #[test]
    fn a_link_leads_to_its_file() {
        let folder = tempfile::tempdir().unwrap();
        let [scan, link] = ["scan.ply", "link.ply"].map(|name| folder.path().join(name));
        std::fs::write(&scan, b"ply").unwrap();
        std::os::unix::fs::symlink(&scan, &link).unwrap();
        assert!(check(&[&scan], &[output("--output", &link, "ply")]).is_err());
        let [result, link] = ["result.ply", "later.ply"].map(|name| folder.path().join(name));
        std::os::unix::fs::symlink(&result, &link).unwrap();
        let both = [output("--output", &result, "ply"), output("--local-surface", &link, "ply")];
        assert!(check(&[&scan], &both).is_err());
    }
}
