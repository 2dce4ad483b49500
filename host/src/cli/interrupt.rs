//! Ctrl-C and a request to end: temporary files and emulators go first, then the program.

use crate::device::end_emulators;
use crate::io::atomic;

/// Watches for SIGINT and SIGTERM in a thread of its own; the exit code is 128 and the signal's number.
#[cfg(unix)]
pub fn watch() {
    use signal_hook::consts::{SIGINT, SIGTERM};
    // Without the thread the signals keep their usual effect, which leaves a temporary file at worst.
    let Ok(mut signals) = signal_hook::iterator::Signals::new([SIGINT, SIGTERM]) else { return };
    std::thread::spawn(move || {
        if let Some(signal) = signals.forever().next() {
            atomic::abandon();
            end_emulators();
            eprintln!("lacuna: stopped; no file was left half written");
            std::process::exit(128 + signal);
        }
    });
}

/// No signals to watch for here.
#[cfg(not(unix))]
pub fn watch() {
    let _ = (atomic::abandon, end_emulators);
}
