//! What a run has found so far, on disk: a stopped run goes on where it was.
//!
//! One line of JSON a result, written in one piece and flushed before the next result begins. A last line that was cut
//! short is taken away when the file is opened again; other lines that are no results stay and count for nothing. One
//! run at a time has the file.

use super::Record;
use crate::io::Error;
use std::collections::BTreeSet;
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{ErrorKind, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// The results of one kind of run.
pub struct State {
    path: PathBuf,
    surfaces: PathBuf,
    file: File,
    records: Vec<Record>,
}

impl State {
    /// Opens the results in `folder` that belong to a key, a digest of everything they depend on. The folder is
    /// made if need be.
    ///
    /// # Errors
    /// A folder or file that cannot be written, or that another run has open.
    pub fn open(folder: &Path, key: u32) -> Result<Self, Error> {
        let path = folder.join(format!("state-{key:08x}.jsonl"));
        let failed = |cause| Error::Write { path: path.clone(), cause };
        std::fs::create_dir_all(folder).map_err(failed)?;
        let file = OpenOptions::new().read(true).append(true).create(true).open(&path);
        let mut file = file.map_err(failed)?;
        // Where files cannot be locked at all, nobody is kept out.
        if let Err(TryLockError::WouldBlock) = file.try_lock() {
            return Err(failed(ErrorKind::WouldBlock.into()));
        }
        let mut text = Vec::new();
        file.read_to_end(&mut text).map_err(failed)?;
        let (records, whole) = parse(&text);
        file.set_len(whole as u64).map_err(failed)?;
        file.seek(SeekFrom::End(0)).map_err(failed)?;
        let surfaces = folder.join(format!("surfaces-{key:08x}"));
        Ok(Self { path, surfaces, file, records })
    }

    /// The folder of the surfaces that belong to the results, made if need be.
    ///
    /// # Errors
    /// A folder that cannot be written.
    pub fn surfaces(&self) -> Result<PathBuf, Error> {
        let path = self.surfaces.clone();
        match std::fs::create_dir_all(&path) {
            Ok(()) => Ok(path),
            Err(cause) => Err(Error::Write { path, cause }),
        }
    }

    /// Results so far.
    pub fn records(&self) -> &[Record] {
        &self.records
    }

    /// Whether a result is there already.
    pub fn holds(&self, count: usize, draw: usize, target: &str, digest: u32) -> bool {
        let same = |r: &Record| (r.count, r.draw, r.digest) == (count, draw, digest) && r.target == target;
        self.records.iter().any(same)
    }

    /// Adds a result, on disk first.
    ///
    /// # Errors
    /// A full disk or a file that has become unwritable.
    pub fn add(&mut self, record: Record) -> Result<(), Error> {
        let failed = |cause| Error::Write { path: self.path.clone(), cause };
        let mut line = serde_json::to_vec(&record).map_err(|error| failed(error.into()))?;
        line.push(b'\n');
        self.file.write_all(&line).and_then(|()| self.file.sync_data()).map_err(failed)?;
        self.records.push(record);
        Ok(())
    }
}

/// The records, the first one of each result, and the bytes that whole lines take.
fn parse(text: &[u8]) -> (Vec<Record>, usize) {
    let whole = text.iter().rposition(|&byte| byte == b'\n').map_or(0, |end| end + 1);
    let lines = text[..whole].split(|&byte| byte == b'\n');
    let mut known = BTreeSet::new();
    let first = |r: &Record| known.insert((r.count, r.draw, r.digest, r.target.clone()));
    let records = lines.filter_map(|line| serde_json::from_slice(line).ok()).filter(first);
    (records.collect(), whole)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate::{Approximation, Score, Scores};

    fn record(count: usize) -> Record {
        let scores = Scores::from([(Approximation::Local, Score { rms: 0.125, p95: 0.5 })]);
        Record { count, draw: 1, target: "head".into(), digest: 7, scores }
    }

    #[test]
    fn results_survive_and_a_cut_line_does_not() {
        let folder = tempfile::tempdir().unwrap();
        let mut state = State::open(folder.path(), 5).unwrap();
        state.add(record(10)).unwrap();
        state.add(record(30)).unwrap();
        drop(state);
        let path = folder.path().join("state-00000005.jsonl");
        let text = std::fs::read(&path).unwrap();
        std::fs::write(&path, &text[..text.len() - 9]).unwrap();
        let mut state = State::open(folder.path(), 5).unwrap();
        assert_eq!(state.records(), [record(10)]);
        state.add(record(50)).unwrap();
        drop(state);
        let state = State::open(folder.path(), 5).unwrap();
        assert_eq!(state.records(), [record(10), record(50)]);
        assert!(state.holds(50, 1, "head", 7) && !state.holds(50, 1, "head", 8));
    }

    #[test]
    fn a_damaged_line_and_a_repeated_one_count_for_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("state-00000005.jsonl");
        let line = |count| serde_json::to_string(&record(count)).unwrap();
        let text = format!("{}\n{{\"count\": 3, \n\n{}\n{}\n", line(10), line(30), line(10));
        std::fs::write(&path, &text).unwrap();
        let state = State::open(folder.path(), 5).unwrap();
        assert_eq!(state.records(), [record(10), record(30)]);
        assert_eq!(std::fs::read_to_string(&path).unwrap(), text);
    }

    #[test]
    fn one_run_at_a_time_has_the_results() {
        let folder = tempfile::tempdir().unwrap();
        let first = State::open(folder.path(), 5).unwrap();
        let refused = State::open(folder.path(), 5).err().expect("two at a time").to_string();
        assert!(
            refused.ends_with("another run writes into it; wait for its end, or choose another folder"),
            "{refused}"
        );
        drop(first);
        State::open(folder.path(), 5).unwrap();
    }

    #[test]
    fn other_settings_have_other_results() {
        let folder = tempfile::tempdir().unwrap();
        State::open(folder.path(), 5).unwrap().add(record(10)).unwrap();
        assert!(State::open(folder.path(), 6).unwrap().records().is_empty());
    }
}
