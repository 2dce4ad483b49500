//! A firmware in QEMU, started on the spot.

use super::Link;
use clap::ValueEnum;
use std::fs::File;
use std::io::{self, ErrorKind, Read};
use std::net::{TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Machines that there is a firmware for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Machine {
    /// Cortex-M4F: mps2-an386.
    #[value(alias = "m4f")]
    M4,
    /// Cortex-M7: mps2-an500.
    M7,
    /// Cortex-M55: mps3-an547.
    M55,
    /// RISC-V, riscv32imac: virt.
    Riscv,
}

/// Why there is no emulated device.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// Nothing to run.
    #[error(
        "there is no firmware at {}: build it with `cargo build --release` in targets/{folder}, or give --firmware", .path.display()
    )]
    NoFirmware {
        /// Where it was looked for.
        path: PathBuf,
        /// Its package.
        folder: &'static str,
    },
    /// A file that is no program, or one for other processors.
    #[error("{} is no firmware for {folder}: give the ELF file that is built in targets/{folder}", .path.display())]
    OtherFirmware {
        /// The file.
        path: PathBuf,
        /// Its package.
        folder: &'static str,
    },
    /// No emulator.
    #[error("{0} is not in PATH: install QEMU for Arm and RISC-V")]
    NoQemu(&'static str),
    /// It does not start.
    #[error("QEMU did not start: {0}")]
    Start(#[from] io::Error),
}

/// An emulated device; it ends with this value, or with [`end_all`].
#[derive(Debug)]
pub struct Qemu {
    #[expect(dead_code, reason = "it ends the emulator when it is dropped")]
    started: Started,
    line: TcpStream,
}

/// A process that ends with this value.
#[derive(Debug)]
struct Started(Arc<Mutex<Child>>);

/// Emulators that run.
static RUNNING: Mutex<Vec<Arc<Mutex<Child>>>> = Mutex::new(Vec::new());

/// Ends all emulators, before the program ends on request.
pub fn end_all() {
    let mut running = lock(&RUNNING);
    running.drain(..).for_each(|child| end(&mut lock(&child)));
    // Kept locked: none is started any more.
    std::mem::forget(running);
}

fn lock<T>(shared: &Mutex<T>) -> MutexGuard<'_, T> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Machine {
    /// Its package in targets/.
    const fn folder(self) -> &'static str {
        match self {
            Self::M4 => "m4f",
            Self::M7 => "m7",
            Self::M55 => "m55",
            Self::Riscv => "riscv",
        }
    }

    const fn target(self) -> &'static str {
        match self {
            Self::M4 | Self::M7 => "thumbv7em-none-eabihf",
            Self::M55 => "thumbv8m.main-none-eabihf",
            Self::Riscv => "riscv32imac-unknown-none-elf",
        }
    }

    const fn emulator(self) -> (&'static str, &'static [&'static str]) {
        match self {
            Self::M4 => ("qemu-system-arm", &["-M", "mps2-an386"]),
            Self::M7 => ("qemu-system-arm", &["-M", "mps2-an500"]),
            Self::M55 => ("qemu-system-arm", &["-M", "mps3-an547"]),
            Self::Riscv => ("qemu-system-riscv32", &["-M", "virt", "-bios", "none"]),
        }
    }

    /// Whether a file is a program for its kind of processor, by the head of the ELF format, and, as far as its symbols tell,
    /// not one of the other machines'.
    fn runs(self, path: &Path) -> io::Result<bool> {
        const ARM: u16 = 40;
        const RISCV: u16 = 243;
        let mut file = File::open(path)?;
        let mut program = Vec::new();
        (&mut file).take(20).read_to_end(&mut program)?;
        let processor = if matches!(self, Self::Riscv) { RISCV } else { ARM };
        if !program.starts_with(b"\x7fELF") || !program.ends_with(&processor.to_le_bytes()) {
            return Ok(false);
        }
        file.read_to_end(&mut program)?;
        let others = Self::value_variants().iter().any(|other| *other != self && other.is_named_in(&program));
        Ok(self.is_named_in(&program) || !others)
    }

    /// Whether the symbols of a program name its package: its firmware's do unless they were stripped.
    fn is_named_in(self, program: &[u8]) -> bool {
        let name = format!("lacuna_{}::", self.folder());
        program.windows(name.len()).any(|part| part == name.as_bytes())
    }

    /// Where its firmware is built, from the workspace's folder.
    fn firmware(self) -> PathBuf {
        let family = if matches!(self, Self::Riscv) { "riscv" } else { "cortex" };
        let built = Path::new("targets/target").join(family).join(self.target()).join("release");
        built.join(format!("lacuna-{}", self.folder()))
    }
}

impl Qemu {
    /// Starts a firmware, by default the one that was built in targets/, and waits for its serial line.
    ///
    /// # Errors
    /// No firmware, no emulator, or one that ends at once.
    pub fn start(machine: Machine, firmware: Option<&Path>) -> Result<Self, Error> {
        let path = firmware.map_or_else(|| machine.firmware(), Path::to_path_buf);
        if !path.is_file() {
            return Err(Error::NoFirmware { path, folder: machine.folder() });
        }
        if !machine.runs(&path)? {
            return Err(Error::OtherFirmware { path, folder: machine.folder() });
        }
        let (program, board) = machine.emulator();
        let program = find(program).ok_or(Error::NoQemu(program))?;
        let listener = TcpListener::bind("127.0.0.1:0")?;
        let serial = format!("tcp:{}", listener.local_addr()?);
        // Locked until it is in the list: none is left running by a request to end in between.
        let mut running = lock(&RUNNING);
        // One instruction takes 512 ns of the emulated time, so that the firmware's counters count instructions.
        let child = Command::new(program)
            .args(board)
            .args(["-display", "none", "-monitor", "none", "-icount", "shift=9"])
            .args(["-semihosting-config", "enable=on,target=native,arg=lacuna,arg=serve"])
            .args(["-serial", &serial])
            .arg("-kernel")
            .arg(path)
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .spawn()?;
        let child = Arc::new(Mutex::new(child));
        running.push(Arc::clone(&child));
        drop(running);
        // Dropped, and ended, where there is no line.
        let started = Started(child);
        let line = accept(&listener, &started.0)?;
        Ok(Self { started, line })
    }
}

impl Drop for Started {
    fn drop(&mut self) {
        end(&mut lock(&self.0));
        lock(&RUNNING).retain(|child| !Arc::ptr_eq(child, &self.0));
    }
}

impl Link for Qemu {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.line.send(bytes)
    }

    fn receive(&mut self, bytes: &mut [u8], patience: Duration) -> io::Result<usize> {
        self.line.receive(bytes, patience)
    }
}

/// Ends a process; that it has ended already is no error.
fn end(child: &mut Child) {
    let _ = child.kill();
    let _ = child.wait();
}

/// Waits until QEMU connects its serial line.
fn accept(listener: &TcpListener, child: &Mutex<Child>) -> io::Result<TcpStream> {
    listener.set_nonblocking(true)?;
    let deadline = Instant::now() + Duration::from_secs(10);
    loop {
        match listener.accept() {
            Ok((line, _)) => {
                line.set_nonblocking(false)?;
                line.set_nodelay(true)?;
                return Ok(line);
            }
            Err(error) if error.kind() != ErrorKind::WouldBlock => return Err(error),
            Err(_) if lock(child).try_wait()?.is_some() => return Err(io::Error::other("it ended at once")),
            Err(_) if Instant::now() > deadline => return Err(ErrorKind::TimedOut.into()),
            Err(_) => std::thread::sleep(Duration::from_millis(5)),
        }
    }
}

/// A program in PATH or where the toolchain for bare machines keeps it.
fn find(program: &str) -> Option<PathBuf> {
    let path = std::env::var_os("PATH").unwrap_or_default();
    let home = std::env::home_dir().map(|home| home.join(".local/share/bare/bin"));
    std::env::split_paths(&path).chain(home).map(|folder| folder.join(program)).find(|path| path.is_file())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_program_for_another_processor_or_machine_is_told_from_one_without_a_name() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("firmware");
        let runs = |program: &[u8]| {
            std::fs::write(&path, program).unwrap();
            Machine::value_variants().iter().map(|machine| machine.runs(&path).unwrap()).collect::<Vec<_>>()
        };
        let elf = |processor: u8, symbols: &str| {
            let head = [b"\x7fELF".as_slice(), &[0; 14], &[processor, 0]].concat();
            [&head, symbols.as_bytes()].concat()
        };
        assert_eq!(runs(&elf(40, "main")), [true, true, true, false]);
        assert_eq!(runs(&elf(40, "serve<lacuna_m7::An>")), [false, true, false, false]);
        assert_eq!(runs(&elf(243, "serve<lacuna_riscv::An>")), [false, false, false, true]);
        assert_eq!(runs(&elf(62, "main")), [false; 4]);
        assert_eq!(runs(b"#!/bin/sh"), [false; 4]);
    }
}
