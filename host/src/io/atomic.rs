//! Files that are there completely or not at all.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf, is_separator};
use std::sync::{Mutex, MutexGuard, PoisonError};

use super::error::Error;

/// Writes a file by way of a temporary one in the same folder, so that a reader never sees half
/// of it and a failure leaves what was there before.
///
/// The result has the permissions of the file it replaces, or of any newly created one. A link is followed; a device or
/// a pipe, which cannot be replaced, is written directly, and so, at the end, is a file that is mounted by itself. A
/// write-protected file stays as it is.
///
/// # Errors
/// [`Error::Write`] if the folder is missing or closed, the disk full, or `fill` fails.
///
/// ```
/// let folder = tempfile::tempdir()?;
/// let path = folder.path().join("report.txt");
/// lacuna_host::io::atomic::write(&path, |out| out.write_all(b"0.12 mm"))?;
/// assert_eq!(std::fs::read(path)?, b"0.12 mm");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn write(path: &Path, fill: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<(), Error> {
    let result = target(path).and_then(|target| match target {
        Target::Direct => fill_directly(path, fill),
        Target::Replaced { path, permissions } => replace(&path, permissions, fill),
    });
    result.map_err(|cause| Error::Write { path: path.into(), cause })
}

/// Finds before any work is done what [`write()`] would fail for: nothing is written.
///
/// # Errors
/// [`Error::Write`] as [`write()`] has it, but for a full disk.
pub fn check(path: &Path) -> Result<(), Error> {
    let result = target(path).and_then(|target| match target {
        Target::Direct => Ok(()),
        // Without a name: an end at any moment leaves nothing.
        Target::Replaced { path, .. } => tempfile::tempfile_in(folder_of(&path)).map(drop),
    });
    result.map_err(|cause| Error::Write { path: path.into(), cause })
}

/// How a file is written.
enum Target {
    /// A device or a pipe, as it is.
    Direct,
    /// A file, there or not: it gets the permissions of the one before.
    Replaced { path: PathBuf, permissions: Option<fs::Permissions> },
}

/// Where a path leads, if that can be written.
fn target(path: &Path) -> io::Result<Target> {
    match fs::metadata(path) {
        Ok(there) if there.is_dir() => Err(io::ErrorKind::IsADirectory.into()),
        Ok(there) if there.permissions().readonly() => Err(io::ErrorKind::PermissionDenied.into()),
        Ok(there) if !there.is_file() => Ok(Target::Direct),
        Ok(there) => {
            Ok(Target::Replaced { path: fs::canonicalize(path)?, permissions: Some(there.permissions()) })
        }
        // A folder that is not there yet.
        Err(_) if path.as_os_str().as_encoded_bytes().last().is_some_and(|&end| is_separator(end.into())) => {
            Err(io::ErrorKind::IsADirectory.into())
        }
        Err(error) if error.kind() == io::ErrorKind::InvalidFilename => Err(error),
        Err(_) => Ok(Target::Replaced { path: followed(path), permissions: None }),
    }
}

/// Links that a file which is not there is reached by, at most; a ring of links has no end.
const LINKS: usize = 40;

/// The file that a path names, by way of links to it while it is not there.
pub fn followed(path: &Path) -> PathBuf {
    let mut path = path.to_path_buf();
    for _ in 0..LINKS {
        let Ok(next) = fs::read_link(&path) else { break };
        path = folder_of(&path).join(next);
    }
    path
}

fn fill_directly(path: &Path, fill: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    let mut out = BufWriter::new(File::options().write(true).open(path)?);
    fill(&mut out)?;
    out.flush()
}

fn replace(
    target: &Path,
    permissions: Option<fs::Permissions>,
    fill: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> io::Result<()> {
    // Removed on any error below.
    let mut temporary = Temporary::in_folder(&folder_of(target))?;
    if let Some(permissions) = permissions {
        temporary.allow(permissions)?;
    }
    let mut out = BufWriter::with_capacity(1 << 16, temporary.file.as_file_mut());
    fill(&mut out)?;
    out.flush()?;
    drop(out);
    temporary.file.as_file().sync_all()?;
    temporary.rename(target)
}

/// Temporary files being written now. It is locked whenever one appears or goes, so that no end on request can come
/// between a file and its entry.
static TEMPORARY: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

fn list() -> MutexGuard<'static, Vec<PathBuf>> {
    TEMPORARY.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Removes the temporary files of writes that will not be finished, before the program ends on request. No write
/// goes on afterwards.
pub fn abandon() {
    let temporary = list();
    for path in temporary.iter() {
        let _ = fs::remove_file(path);
    }
    // Kept locked: the program ends now.
    std::mem::forget(temporary);
}

/// A temporary file in the list; gone when dropped.
struct Temporary {
    file: tempfile::NamedTempFile,
}

impl Temporary {
    fn in_folder(folder: &Path) -> io::Result<Self> {
        let mut list = list();
        let file = temporary_in(folder)?;
        list.push(file.path().into());
        Ok(Self { file })
    }

    /// Gives the file these permissions. Where all files have the same there is nothing to give.
    fn allow(&self, permissions: fs::Permissions) -> io::Result<()> {
        let file = self.file.as_file();
        if file.metadata()?.permissions() == permissions { Ok(()) } else { file.set_permissions(permissions) }
    }

    /// Gives the file its name, which an end on request waits for.
    fn rename(self, target: &Path) -> io::Result<()> {
        let _waiting = list();
        match fs::rename(self.file.path(), target) {
            // A file that is mounted by itself cannot be replaced, only written.
            Err(error) if error.kind() == io::ErrorKind::ResourceBusy => {
                fs::copy(self.file.path(), target).map(drop)
            }
            renamed => renamed,
        }
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        let mut list = list();
        // Not there any more if it was renamed.
        let _ = fs::remove_file(self.file.path());
        list.retain(|path| path != self.file.path());
    }
}

fn folder_of(path: &Path) -> PathBuf {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder.into(),
        _ => ".".into(),
    }
}

#[cfg(unix)]
fn temporary_in(folder: &Path) -> io::Result<tempfile::NamedTempFile> {
    use std::os::unix::fs::PermissionsExt;
    // Less the umask, as for any new file; the default would be the owner's eyes only.
    let permissions = fs::Permissions::from_mode(0o666);
    tempfile::Builder::new()
        .prefix(".lacuna-")
        .permissions(permissions)
        .disable_cleanup(true)
        .tempfile_in(folder)
}

#[cfg(not(unix))]
fn temporary_in(folder: &Path) -> io::Result<tempfile::NamedTempFile> {
    tempfile::Builder::new().prefix(".lacuna-").disable_cleanup(true).tempfile_in(folder)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Barrier;

    fn files_in(folder: &Path) -> usize {
        fs::read_dir(folder).unwrap().count()
    }

    #[test]
    fn the_file_is_replaced_as_a_whole() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        for text in [b"long text".as_slice(), b"short"] {
            write(&path, |out| out.write_all(text)).unwrap();
            assert_eq!(fs::read(&path).unwrap(), text);
        }
        assert_eq!(files_in(folder.path()), 1);
    }

    #[test]
    fn a_failure_leaves_what_was_there_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        fs::write(&path, b"old").unwrap();
        let full = |out: &mut dyn Write| {
            out.write_all(b"new")?;
            Err(io::ErrorKind::StorageFull.into())
        };
        let message = write(&path, full).unwrap_err().to_string();
        assert!(message.contains("a.txt") && message.contains("the disk is full"), "{message}");
        assert_eq!((fs::read(&path).unwrap().as_slice(), files_in(folder.path())), (b"old".as_slice(), 1));
    }

    #[test]
    fn no_file_appears_or_goes_while_the_list_is_locked() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        let (filled, ended) = (Barrier::new(2), Barrier::new(2));
        let pause = || std::thread::sleep(std::time::Duration::from_millis(50));
        std::thread::scope(|scope| {
            let locked = list();
            let writer = scope.spawn(|| {
                let fail = |_: &mut dyn Write| {
                    filled.wait();
                    ended.wait();
                    Err(io::ErrorKind::StorageFull.into())
                };
                write(&path, fail).unwrap_err();
            });
            pause();
            assert_eq!(files_in(folder.path()), 0, "an end on request would not know of it");
            drop(locked);
            filled.wait();
            let locked = list();
            assert!(locked.iter().any(|path| path.starts_with(folder.path())));
            ended.wait();
            pause();
            assert_eq!(files_in(folder.path()), 1, "an end on request has to wait");
            drop(locked);
            writer.join().unwrap();
        });
        assert_eq!(files_in(folder.path()), 0);
    }

    #[test]
    fn a_missing_folder_is_named_as_the_cause() {
        let folder = tempfile::tempdir().unwrap();
        let message = write(&folder.path().join("no/a.txt"), |_| Ok(())).unwrap_err().to_string();
        assert!(message.ends_with("its folder does not exist; create the folder first"), "{message}");
    }

    #[test]
    fn a_folder_and_a_protected_file_are_not_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        fs::write(&path, b"old").unwrap();
        let mut permissions = fs::metadata(&path).unwrap().permissions();
        permissions.set_readonly(true);
        fs::set_permissions(&path, permissions).unwrap();
        assert!(write(&path, |_| Ok(())).unwrap_err().to_string().contains("access is denied"));
        assert!(write(folder.path(), |_| Ok(())).unwrap_err().to_string().contains("this is a folder"));
    }

    #[cfg(unix)]
    #[test]
    fn permissions_are_those_of_any_new_file_or_of_the_one_before() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let mode = |name| fs::metadata(folder.path().join(name)).unwrap().permissions().mode();
        write(&folder.path().join("ours"), |_| Ok(())).unwrap();
        File::create(folder.path().join("usual")).unwrap();
        assert_eq!(mode("ours"), mode("usual"));
        let private = fs::Permissions::from_mode(0o600);
        fs::set_permissions(folder.path().join("ours"), private).unwrap();
        write(&folder.path().join("ours"), |_| Ok(())).unwrap();
        assert_eq!(mode("ours") & 0o777, 0o600);
    }

    #[cfg(unix)]
    #[test]
    fn a_link_is_followed_and_a_device_is_not_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let (link, target) = (folder.path().join("link"), folder.path().join("target"));
        fs::write(&target, b"old").unwrap();
        std::os::unix::fs::symlink(&target, &link).unwrap();
        write(&link, |out| out.write_all(b"new")).unwrap();
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(fs::read(&target).unwrap(), b"new");
        write(Path::new("/dev/null"), |out| out.write_all(b"new")).unwrap();
        assert!(!fs::metadata("/dev/null").unwrap().is_file());
    }

    #[cfg(unix)]
    #[test]
    fn a_link_to_a_file_that_is_not_there_yet_is_followed() {
        let folder = tempfile::tempdir().unwrap();
        let [link, second, target] = ["link", "second", "target"].map(|name| folder.path().join(name));
        std::os::unix::fs::symlink("second", &link).unwrap();
        std::os::unix::fs::symlink(&target, &second).unwrap();
        check(&link).unwrap();
        assert!(!target.exists());
        write(&link, |out| out.write_all(b"new")).unwrap();
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(fs::read(&target).unwrap(), b"new");
    }

    #[test]
    fn what_cannot_be_written_is_found_before() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        check(&path).unwrap();
        assert_eq!(files_in(folder.path()), 0);
        fs::write(&path, b"old").unwrap();
        check(&path).unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"old");
        let mut permissions = fs::metadata(&path).unwrap().permissions();
        permissions.set_readonly(true);
        fs::set_permissions(&path, permissions).unwrap();
        for (path, cause) in [
            (path, "access is denied"),
            (folder.path().to_path_buf(), "this is a folder"),
            (folder.path().join("no/a.txt"), "create the folder first"),
            (folder.path().join("new/"), "this is a folder"),
            (folder.path().join("a".repeat(300)), "the name is too long"),
        ] {
            let message = check(&path).unwrap_err().to_string();
            assert!(message.contains(cause), "{message}");
        }
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_full_disk_is_named_as_the_cause() {
        let message = write(Path::new("/dev/full"), |out| out.write_all(b"x")).unwrap_err().to_string();
        assert!(message.contains("the disk is full"), "{message}");
    }
}
