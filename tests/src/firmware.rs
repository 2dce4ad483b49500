//! Builds the firmware and runs it in QEMU, where the tools for that are there.

use crate::required::lacks;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// The machines: folder, target triple.
pub const MACHINES: [(&str, &str); 4] = [
    ("m4f", "thumbv7em-none-eabihf"),
    ("m7", "thumbv7em-none-eabihf"),
    ("m55", "thumbv8m.main-none-eabihf"),
    ("riscv", "riscv32imac-unknown-none-elf"),
];

/// The folder of the firmware workspace.
pub fn folder() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../targets")
}

/// What a run printed.
#[derive(Debug, Default)]
pub struct Run {
    /// CRC-32 of each stage.
    pub digests: BTreeMap<String, u32>,
    /// Instructions of each kind of work.
    pub counts: BTreeMap<String, u64>,
    /// Bytes of stack used.
    pub stack: u64,
}

/// The Cargo toolchain argument that has the target, if any: a toolchain called `bare`, or the usual one.
fn toolchain(triple: &str) -> Option<Vec<String>> {
    let has = |arguments: &[&str]| {
        let sysroot = Command::new("rustc").args(arguments).args(["--print", "sysroot"]).output().ok()?;
        let path = PathBuf::from(String::from_utf8(sysroot.stdout).ok()?.trim());
        (sysroot.status.success() && path.join("lib/rustlib").join(triple).join("lib").is_dir()).then_some(())
    };
    if has(&["+bare"]).is_some() {
        return Some(vec!["+bare".into()]);
    }
    has(&[]).map(|()| Vec::new())
}

/// Whether QEMU is there, in the path or in the usual folder of unpacked tools.
fn has_qemu(name: &str) -> bool {
    let home = std::env::var_os("HOME").map(PathBuf::from).unwrap_or_default();
    let folders = std::env::var_os("PATH").unwrap_or_default();
    let mut folders: Vec<PathBuf> = std::env::split_paths(&folders).collect();
    folders.push(home.join(".local/share/bare/bin"));
    folders.iter().any(|folder| folder.join(name).is_file())
}

/// Why a machine cannot be tried here; `None` where it can.
///
/// # Panics
/// Where `LACUNA_REQUIRE_TARGETS=1` and something is missing.
pub fn missing(machine: &str, triple: &str) -> Option<String> {
    let qemu = if machine == "riscv" { "qemu-system-riscv32" } else { "qemu-system-arm" };
    let reason = match (toolchain(triple), has_qemu(qemu)) {
        (None, _) => {
            format!("no Rust toolchain has {triple} for {machine} (rustup target add {triple})")
        }
        (_, false) => format!("{qemu} is not there for {machine}"),
        _ => return None,
    };
    lacks("TARGETS", &reason);
    Some(reason)
}

/// Builds a machine's firmware, with another model and scan if they are given: the ELF file.
///
/// # Panics
/// A build that fails.
pub fn build(machine: &str, triple: &str, inputs: Option<(&Path, &Path)>) -> PathBuf {
    let mut command = cargo(machine, triple);
    if let Some((model, cloud)) = inputs {
        command.env("LACUNA_MODEL", model).env("LACUNA_CLOUD", cloud);
    }
    finish(command, machine);
    elf(machine, triple)
}

/// Builds a machine's firmware with defmt's log: an ELF file of its own.
///
/// # Panics
/// A build that fails.
pub fn build_logging(machine: &str, triple: &str) -> PathBuf {
    let mut command = cargo(machine, triple);
    command.args(["--features", "defmt"]).env("DEFMT_LOG", "info");
    finish(command, machine);
    let (built, kept) = (elf(machine, triple), elf(machine, triple).with_extension("defmt"));
    std::fs::copy(built, &kept).expect("a copy of the firmware");
    kept
}

/// Whether a machine has the Cortex-M folder of built files; otherwise it has that of RISC-V.
pub fn is_cortex(machine: &str) -> bool {
    machine != "riscv"
}

fn elf(machine: &str, triple: &str) -> PathBuf {
    let family = if is_cortex(machine) { "cortex" } else { "riscv" };
    folder().join("target").join(family).join(triple).join("release").join(format!("lacuna-{machine}"))
}

fn finish(mut command: Command, machine: &str) {
    let output = command.output().expect("cargo");
    assert!(output.status.success(), "{machine}: {}", String::from_utf8_lossy(&output.stderr));
}

/// Cargo, about to build a machine's firmware.
fn cargo(machine: &str, triple: &str) -> Command {
    let mut command = Command::new("cargo");
    command.args(toolchain(triple).unwrap_or_default()).args(["build", "--release", "--quiet"]);
    // Cargo tells its children which toolchain it is; this one is another.
    for variable in
        ["RUSTUP_TOOLCHAIN", "CARGO", "RUSTC", "RUSTFLAGS", "CARGO_TARGET_DIR", "CARGO_ENCODED_RUSTFLAGS"]
    {
        command.env_remove(variable);
    }
    command.current_dir(folder().join(machine));
    command
}

/// A firmware's example takes less than this, or it never ends: seconds on a slow computer.
const LONGEST: Duration = Duration::from_secs(300);

/// Runs a firmware's example.
///
/// # Panics
/// A firmware that ends with an error, or not at all.
pub fn run(machine: &str, elf: &Path) -> Run {
    let mut command = Command::new(folder().join("qemu.sh"));
    command.arg(machine).arg(elf).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().expect("qemu.sh");
    let end = Instant::now() + LONGEST;
    while child.try_wait().expect("a child").is_none() {
        assert!(Instant::now() < end || child.kill().is_err(), "{machine} does not come to an end");
        std::thread::sleep(Duration::from_millis(20));
    }
    let output = child.wait_with_output().expect("what it printed");
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{machine}: {text}{}", String::from_utf8_lossy(&output.stderr));
    let mut run = Run::default();
    for line in text.lines() {
        let words: Vec<&str> = line.split_whitespace().collect();
        match words[..] {
            ["digest", stage, value] => {
                run.digests.insert(stage.into(), u32::from_str_radix(value, 16).expect("a digest"));
            }
            ["stack", bytes] => run.stack = bytes.parse().expect("bytes"),
            ["count", ..] => {
                let at = words.iter().position(|w| w.parse::<u64>().is_ok()).expect("a count");
                run.counts.insert(words[1..at].join(" "), words[at].parse().expect("a count"));
            }
            _ => {}
        }
    }
    run
}
