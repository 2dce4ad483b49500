//! How much memory reading may take, known before any is taken.

use std::fs::Metadata;
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use super::error::{Error, Problem};
use super::pipe;

/// Bytes of memory that reading and checking take for one byte of a mesh file, at most.
pub const PER_BYTE: u64 = 64;
/// The same for one pixel of a depth image.
pub const PER_PIXEL: u64 = 64;
/// Bytes of a mesh that is kept for one byte of its file, at most.
const KEPT: u64 = 8;
/// Most bytes taken from something without a length, such as a pipe.
const UNKNOWN: u64 = 1 << 28;

static LIMIT: AtomicU64 = AtomicU64::new(u64::MAX);

/// Sets the limit for this process, bytes.
pub fn set(bytes: u64) {
    LIMIT.store(bytes, Ordering::Relaxed);
}

/// The limit of this process, bytes.
pub fn get() -> u64 {
    LIMIT.load(Ordering::Relaxed)
}

/// Refuses meshes that would together need more memory than allowed: one a thread is being read and checked, all
/// of them are kept.
///
/// # Errors
/// [`Problem::Memory`] at the largest of them. Files that cannot be looked at are left to the reader.
pub fn check_all(paths: &[PathBuf]) -> Result<(), Error> {
    let length = |path: &PathBuf| std::fs::metadata(path).ok().filter(Metadata::is_file).map(|m| m.len());
    let lengths: Vec<u64> = paths.iter().map(|path| length(path).unwrap_or(0)).collect();
    let Some((largest, path)) = lengths.iter().zip(paths).max_by_key(|(length, _)| **length) else {
        return Ok(());
    };
    let busy = rayon::current_num_threads().min(paths.len()) as u64;
    let kept = lengths.iter().fold(0u64, |sum, &length| sum.saturating_add(length)).saturating_mul(KEPT);
    let needed = largest.saturating_mul(PER_BYTE).saturating_mul(busy).saturating_add(kept);
    check(needed).map_err(|problem| problem.in_whole().in_file(path))
}

/// Refuses what would need more memory than allowed.
pub(super) fn check(needed: u64) -> Result<(), Problem> {
    let limit = get();
    if needed > limit { Err(Problem::Memory { needed, limit }) } else { Ok(()) }
}

/// The bytes of a file whose size allows it; for one of them `per_byte` bytes of memory may be needed.
///
/// # Errors
/// What cannot be read, has no end, or would need more memory than allowed.
pub fn load(path: &Path, per_byte: u64) -> Result<Vec<u8>, Error> {
    let failed = |cause| Error::Read { path: path.into(), cause };
    let file = pipe::open(path).map_err(failed)?;
    let metadata = file.metadata().map_err(failed)?;
    if metadata.is_dir() {
        return Err(failed(io::ErrorKind::IsADirectory.into()));
    }
    if is_endless(&metadata) {
        return Err(Problem::Device.in_whole().in_file(path));
    }
    let length = if metadata.is_file() { metadata.len() } else { 0 };
    check(length.saturating_mul(per_byte)).map_err(|problem| problem.in_whole().in_file(path))?;
    let mut bytes = Vec::new();
    let reserved = usize::try_from(length).is_ok_and(|length| bytes.try_reserve_exact(length).is_ok());
    if !reserved {
        return Err(failed(io::ErrorKind::OutOfMemory.into()));
    }
    let most = if metadata.is_file() { length } else { UNKNOWN };
    file.take(most.saturating_add(1)).read_to_end(&mut bytes).map_err(failed)?;
    if bytes.len() as u64 > most {
        let what = format!("more than {most} bytes came while it was read; save it to a file first");
        return Err(Problem::Other(what).in_whole().in_file(path));
    }
    Ok(bytes)
}

#[cfg(unix)]
fn is_endless(metadata: &Metadata) -> bool {
    use std::os::unix::fs::FileTypeExt;
    let kind = metadata.file_type();
    kind.is_char_device() || kind.is_block_device()
}

#[cfg(not(unix))]
fn is_endless(_: &Metadata) -> bool {
    false
}

/// What [`parse`] takes.
const BYTES: &str = "use bytes, or a number with K, M or G";

/// A number of bytes, or with K, M or G, of which there may be parts: 1.5M.
///
/// # Errors
/// Anything else, in words.
pub fn parse(text: &str) -> Result<u64, String> {
    let digits = text.trim_end_matches(['K', 'M', 'G', 'k', 'm', 'g']);
    let factor: u64 = match text[digits.len()..].to_ascii_uppercase().as_str() {
        "" => 1,
        "K" => 1 << 10,
        "M" => 1 << 20,
        "G" => 1 << 30,
        _ => return Err(BYTES.into()),
    };
    let (whole, part) = digits.split_once('.').unwrap_or((digits, "0"));
    let number = |digits: &str| {
        let all = !digits.is_empty() && digits.bytes().all(|digit| digit.is_ascii_digit());
        all.then(|| digits.parse::<u64>().ok())
    };
    let (Some(whole), Some(_), true) = (number(whole), number(part), factor > 1 || whole == digits) else {
        return Err(BYTES.into());
    };
    let part: f64 = format!("0.{part}").parse().unwrap_or(0.0);
    let bytes = whole.and_then(|whole| whole.checked_mul(factor)?.checked_add((part * factor as f64) as u64));
    bytes.filter(|&bytes| bytes > 0).ok_or_else(|| "out of range".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_have_suffixes() {
        assert_eq!((parse("7"), parse("2k"), parse("3G")), (Ok(7), Ok(2048), Ok(3 << 30)));
        assert_eq!((parse("1.5M"), parse("0.25k"), parse("2.0G")), (Ok(3 << 19), Ok(256), Ok(2 << 30)));
        let wrong = ["", "G", ".5G", "1.G", "1.5", "1.5.5K", "1e3K", "+1K", "2KB", "-1"];
        for wrong in wrong.into_iter().chain(["0", "0.0001K", "99999999999999999999", "9999999999999G"]) {
            assert!(parse(wrong).is_err(), "{wrong}");
        }
    }
}
