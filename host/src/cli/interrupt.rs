//! Ctrl-C and a request to end: temporary files and emulators go first, then the program.

use crate::device::end_emulators;
use crate::io::atomic;
#[cfg(unix)]
use std::sync::Arc;

/// Watches for SIGINT, SIGTERM and SIGHUP in a thread of its own; the exit code is 128 and the signal's number. A terminal
/// that is closed ends no run that was started to go on without it (nohup), as far as the system tells. A file that grows
/// beyond what the system allows is an error of writing as others are, no end.
#[cfg(unix)]
pub fn watch() {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGXFSZ};
    let _ = signal_hook::flag::register(SIGXFSZ, Arc::default());
    let watched = [SIGINT, SIGTERM, SIGHUP]
        .into_iter()
        .filter(|&signal| !is_ignored(signal).unwrap_or(signal == SIGHUP));
    // Without the thread the signals keep their usual effect, which leaves a temporary file at worst.
    let Ok(mut signals) = signal_hook::iterator::Signals::new(watched) else { return };
    std::thread::spawn(move || {
        if let Some(signal) = signals.forever().next() {
            atomic::abandon();
            end_emulators();
            eprintln!("lacuna: stopped; no file was left half written");
            std::process::exit(128 + signal);
        }
    });
}

/// Whether the program was started with a signal ignored; none where the system does not tell.
#[cfg(unix)]
fn is_ignored(signal: i32) -> Option<bool> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"))?;
    let mask = u64::from_str_radix(mask.trim(), 16).ok()?;
    Some(mask >> (signal - 1) & 1 == 1)
}

/// No signals to watch for here.
#[cfg(not(unix))]
pub fn watch() {
    let _ = (atomic::abandon, end_emulators);
}
