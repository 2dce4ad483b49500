//! Builds the firmware and runs it in QEMU, where the tools for that are there.

use crate::required::lacks;
use std::collections::BTreeMap;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::thread::JoinHandle;
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
    /// Of which the longest step takes so many.
    pub longest: BTreeMap<String, u64>,
    /// Bytes of stack used.
    pub stack: u64,
    /// Standard error: the log of firmware that writes one.
    pub log: Vec<u8>,
}

/// A program of the toolchain for a machine: where its firmware is built, without what a Cargo around this test has set.
fn tool(name: &str, machine: &str) -> Command {
    let mut command = Command::new(name);
    // Cargo tells its children which toolchain it is; this one is another.
    for variable in
        ["RUSTUP_TOOLCHAIN", "CARGO", "RUSTC", "RUSTFLAGS", "CARGO_TARGET_DIR", "CARGO_ENCODED_RUSTFLAGS"]
    {
        command.env_remove(variable);
    }
    // Another model, or another scan, is linked when a test gives it.
    command.env_remove("LACUNA_MODEL").env_remove("LACUNA_CLOUD");
    command.current_dir(folder().join(machine));
    command
}

/// The Cargo toolchain argument that has the target, if any: a toolchain called `bare`, or the usual one.
fn toolchain(machine: &str, triple: &str) -> Option<Vec<String>> {
    let has = |arguments: &[&str]| {
        let sysroot = tool("rustc", machine).args(arguments).args(["--print", "sysroot"]).output().ok()?;
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
    let reason = match (toolchain(machine, triple), has_qemu(qemu)) {
        (None, _) => {
            format!("no Rust toolchain has {triple} for {machine} (rustup target add {triple})")
        }
        (_, false) => format!("{qemu} is not there for {machine}"),
        _ => return None,
    };
    lacks("TARGETS", &reason);
    Some(reason)
}

/// Builds a machine's firmware as it is: the ELF file.
///
/// # Panics
/// A build that fails.
pub fn build(machine: &str, triple: &str) -> PathBuf {
    finish(cargo(machine, triple), machine);
    elf(machine, triple)
}

/// Builds a machine's firmware with another model and scan, and with defmt's log if it `logs`: an ELF file of its own.
///
/// # Panics
/// A build that fails.
pub fn build_with(machine: &str, triple: &str, [model, cloud]: [&Path; 2], logs: bool) -> PathBuf {
    let mut command = cargo(machine, triple);
    command.env("LACUNA_MODEL", model).env("LACUNA_CLOUD", cloud);
    if logs {
        command.args(["--features", "defmt"]).env("DEFMT_LOG", "info");
    }
    beside(command, machine, triple, if logs { "defmt" } else { "other" })
}

/// Builds another firmware where the usual one is built, so that what they share is compiled once, and leaves the usual
/// one, or none, under its name: `lacuna device --qemu` starts what it finds there.
fn beside(command: Command, machine: &str, triple: &str, extension: &str) -> PathBuf {
    let usual = elf(machine, triple);
    let [built, kept] = [extension, "kept"].map(|extension| usual.with_extension(extension));
    let was_there = std::fs::copy(&usual, &kept).is_ok();
    finish(command, machine);
    std::fs::rename(&usual, &built).expect("the firmware");
    if was_there {
        std::fs::rename(&kept, &usual).expect("the firmware that was there before");
    }
    built
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
    let mut command = tool("cargo", machine);
    let toolchain = toolchain(machine, triple).unwrap_or_default();
    command.args(toolchain).args(["build", "--release", "--quiet"]);
    command
}

/// A firmware's example takes less than this, or it never ends: seconds on a slow computer.
const LONGEST: Duration = Duration::from_secs(300);

/// Everything from a pipe, read while the program at its other end goes on.
fn drained(mut pipe: impl Read + Send + 'static) -> JoinHandle<Vec<u8>> {
    std::thread::spawn(move || {
        let mut bytes = Vec::new();
        pipe.read_to_end(&mut bytes).expect("what it printed");
        bytes
    })
}

/// Runs a firmware's example.
///
/// # Panics
/// A firmware that ends with an error, or not at all.
pub fn run(machine: &str, elf: &Path) -> Run {
    let mut command = Command::new(folder().join("qemu.sh"));
    command.arg(machine).arg(elf).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().expect("qemu.sh");
    let output = drained(child.stdout.take().expect("a pipe"));
    let log = drained(child.stderr.take().expect("a pipe"));
    let end = Instant::now() + LONGEST;
    let status = loop {
        if let Some(status) = child.try_wait().expect("a child") {
            break status;
        }
        assert!(Instant::now() < end || child.kill().is_err(), "{machine} does not come to an end");
        std::thread::sleep(Duration::from_millis(20));
    };
    let [output, log] = [output, log].map(|pipe| pipe.join().expect("what it printed"));
    let text = String::from_utf8_lossy(&output);
    assert!(status.success(), "{machine}: {text}{}", String::from_utf8_lossy(&log));
    Run { log, ..printed(&text) }
}

/// What a firmware's lines say.
fn printed(text: &str) -> Run {
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
                let name = words[1..at].join(" ");
                if let ["steps", _, "longest", longest] = words[at + 1..] {
                    run.longest.insert(name.clone(), longest.parse().expect("a count"));
                }
                run.counts.insert(name, words[at].parse().expect("a count"));
            }
            _ => {}
        }
    }
    run
}
