//! What a run has found so far, on disk: a stopped run goes on where it was.
//!
//! One line of JSON a result, written in one piece and flushed before the next result begins. A line that was cut
//! short is taken away when the file is opened again.

use super::Record;
use crate::io::Error;
use std::fs::{File, OpenOptions};
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// The results of one kind of run.
pub struct State {
    path: PathBuf,
    file: File,
    records: Vec<Record>,
}

impl State {
    /// Opens the results in `folder` that belong to a key, a digest of everything they depend on. The folder is
    /// made if need be.
    ///
    /// # Errors
    /// A folder or file that cannot be written.
    pub fn open(folder: &Path, key: u32) -> Result<Self, Error> {
        let path = folder.join(format!("state-{key:08x}.jsonl"));
        let failed = |cause| Error::Write { path: path.clone(), cause };
        std::fs::create_dir_all(folder).map_err(failed)?;
        let file = OpenOptions::new().read(true).append(true).create(true).open(&path);
        let mut file = file.map_err(failed)?;
        let mut text = Vec::new();
        file.read_to_end(&mut text).map_err(failed)?;
        let (records, whole) = parse(&text);
        file.set_len(whole as u64).map_err(failed)?;
        file.seek(SeekFrom::End(0)).map_err(failed)?;
        Ok(Self { path, file, records })
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

/// The records of whole lines, and the bytes they take: reading stops at the first line that is none.
fn parse(text: &[u8]) -> (Vec<Record>, usize) {
    let (mut records, mut whole) = (Vec::new(), 0);
    for line in text.split_inclusive(|&byte| byte == b'\n') {
        let record = line.strip_suffix(b"\n").and_then(|line| serde_json::from_slice(line).ok());
        let Some(record) = record else { break };
        records.push(record);
        whole += line.len();
    }
    (records, whole)
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
    fn other_settings_have_other_results() {
        let folder = tempfile::tempdir().unwrap();
        State::open(folder.path(), 5).unwrap().add(record(10)).unwrap();
        assert!(State::open(folder.path(), 6).unwrap().records().is_empty());
    }
}
