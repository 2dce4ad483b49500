//! Pipes with a name: opening one waits for a writer, who may never come.

use std::fs::{File, Metadata};
use std::io;
use std::path::Path;
use std::sync::mpsc::channel;
use std::time::Duration;

/// A pipe that nobody has opened for writing within this time is refused.
const PATIENCE: Duration = Duration::from_secs(4);

/// Opens a file; a pipe only if somebody writes into it.
pub(super) fn open(path: &Path) -> io::Result<File> {
    if !std::fs::metadata(path).is_ok_and(|metadata| is_pipe(&metadata)) {
        return File::open(path);
    }
    let (sender, receiver) = channel();
    let path = path.to_path_buf();
    // Nothing can call the thread back from its wait; it ends with the program.
    std::thread::spawn(move || sender.send(File::open(path)));
    let silent = || io::Error::new(io::ErrorKind::TimedOut, "nobody writes into this pipe");
    receiver.recv_timeout(PATIENCE).unwrap_or_else(|_| Err(silent()))
}

#[cfg(unix)]
fn is_pipe(metadata: &Metadata) -> bool {
    use std::os::unix::fs::FileTypeExt;
    metadata.file_type().is_fifo()
}

#[cfg(not(unix))]
fn is_pipe(_: &Metadata) -> bool {
    false
}
