//! What tests need and a machine may lack: emulators, a browser, real data.

use std::io::Write;

/// Says that something is not tested, and why; a failure where `LACUNA_REQUIRE_` with the name of what is missing is 1.
///
/// # Panics
/// There.
pub fn lacks(what: &str, reason: &str) {
    let name = format!("LACUNA_REQUIRE_{what}");
    let required = std::env::var_os(&name).is_some_and(|value| value == "1");
    assert!(!required, "{name}=1, and {reason}");
    // Not by `println!`: what a test that passes prints is not shown.
    let _ = writeln!(std::io::stderr(), "NOT TESTED: {reason}");
}
