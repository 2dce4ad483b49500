//! A line between a host and a device in one process: frames get lost, damaged and repeated, the device is reset.
//!
//! Time stands still: a host's patience ends exactly when the device waits and nothing is under way, so that a
//! test of thousands of lost frames takes no time and no number in it depends on the machine.

use crate::device_memory::DeviceMemory;
use embedded_io::{ErrorKind, ErrorType, Read, ReadReady, Write};
use lacuna_host::device::Link;
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::collections::VecDeque;
use std::io;
use std::sync::{Arc, Condvar, Mutex, MutexGuard};
use std::thread::JoinHandle;
use std::time::Duration;

/// What happens to frames, as probabilities for each.
#[derive(Clone, Debug, Default)]
pub struct Faults {
    /// One byte becomes another.
    pub damage: f64,
    /// The frame is lost.
    pub loss: f64,
    /// The frame arrives twice.
    pub repetition: f64,
    /// The device is reset after so many frames, ascending.
    pub resets: Vec<u64>,
}

/// What both ends share.
struct Wire {
    to_device: VecDeque<u8>,
    to_host: VecDeque<u8>,
    /// The device sits in `read` and nothing is there.
    waits: bool,
    /// The device is to lose its memory.
    reset: bool,
    /// The host has gone.
    closed: bool,
    /// The device has gone.
    dead: bool,
    frames: u64,
    faults: Faults,
    rng: ChaCha8Rng,
}

type Shared = Arc<(Mutex<Wire>, Condvar)>;

/// The host's end; the device ends with it.
pub struct HostEnd {
    shared: Shared,
    device: Option<JoinHandle<()>>,
}

struct DeviceEnd(Shared);

fn lock(shared: &Shared) -> MutexGuard<'_, Wire> {
    shared.0.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
}

impl Wire {
    /// What arrives of a frame.
    fn spoiled(&mut self, frame: &[u8]) -> Vec<u8> {
        self.frames += 1;
        if self.faults.resets.first().is_some_and(|&at| self.frames >= at) {
            self.faults.resets.remove(0);
            self.reset = true;
        }
        let mut frame = frame.to_vec();
        if self.rng.random_bool(self.faults.loss) {
            return vec![];
        }
        if self.rng.random_bool(self.faults.damage) {
            let at = self.rng.random_range(0..frame.len());
            frame[at] = self.rng.next_u32() as u8;
        }
        if self.rng.random_bool(self.faults.repetition) { frame.repeat(2) } else { frame }
    }
}

impl HostEnd {
    /// Starts a device with this model and room for `points`.
    pub fn start(model: Vec<u8>, points: usize, faults: Faults, seed: u64) -> Self {
        let memory = DeviceMemory::new(&model, points);
        Self::serving(model, memory, faults, seed)
    }

    /// Starts a device with this model and memory.
    pub fn serving(model: Vec<u8>, memory: DeviceMemory, faults: Faults, seed: u64) -> Self {
        let wire = Wire {
            to_device: VecDeque::new(),
            to_host: VecDeque::new(),
            waits: false,
            reset: false,
            closed: false,
            dead: false,
            frames: 0,
            faults,
            rng: ChaCha8Rng::seed_from_u64(seed),
        };
        let shared: Shared = Arc::new((Mutex::new(wire), Condvar::new()));
        let end = DeviceEnd(shared.clone());
        let device = std::thread::spawn(move || end.live(&model, memory));
        Self { shared, device: Some(device) }
    }

    /// Frames sent so far, both ways.
    pub fn frames(&self) -> u64 {
        lock(&self.shared).frames
    }

    /// Resets still to come.
    pub fn resets_left(&self) -> usize {
        lock(&self.shared).faults.resets.len()
    }

    /// Whether the device's thread is alive.
    pub fn is_alive(&self) -> bool {
        !lock(&self.shared).dead
    }
}

impl Drop for HostEnd {
    fn drop(&mut self) {
        lock(&self.shared).closed = true;
        self.shared.1.notify_all();
        let ended = self.device.take().map(JoinHandle::join);
        assert!(std::thread::panicking() || matches!(ended, Some(Ok(()))), "the device panicked");
    }
}

impl Link for &HostEnd {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        let mut wire = lock(&self.shared);
        let bytes = wire.spoiled(bytes);
        wire.to_device.extend(bytes);
        self.shared.1.notify_all();
        Ok(())
    }

    fn receive(&mut self, bytes: &mut [u8], _: Duration) -> io::Result<usize> {
        let mut wire = lock(&self.shared);
        loop {
            if wire.dead {
                return Err(io::ErrorKind::BrokenPipe.into());
            }
            let count = wire.to_host.len().min(bytes.len());
            let silent = wire.waits && wire.to_device.is_empty() && !wire.reset;
            if count > 0 || silent {
                bytes.iter_mut().zip(wire.to_host.drain(..count)).for_each(|(to, from)| *to = from);
                return Ok(count);
            }
            wire = self.shared.1.wait(wire).unwrap_or_else(std::sync::PoisonError::into_inner);
        }
    }
}

impl DeviceEnd {
    /// Serves until the host has gone; a reset is a start with other rubbish in the memory.
    fn live(mut self, model: &[u8], mut memory: DeviceMemory) {
        let _obituary = Obituary(self.0.clone());
        loop {
            memory.serve(&mut self, model);
            let mut wire = lock(&self.0);
            if wire.closed {
                return;
            }
            wire.reset = false;
            wire.to_device.clear();
            drop(wire);
            memory.points.fill([0x5555; 6]);
        }
    }
}

/// Tells the host when the device's thread ends, even by a panic.
struct Obituary(Shared);

impl Drop for Obituary {
    fn drop(&mut self) {
        lock(&self.0).dead = true;
        self.0.1.notify_all();
    }
}

impl ErrorType for DeviceEnd {
    type Error = ErrorKind;
}

impl Read for DeviceEnd {
    fn read(&mut self, bytes: &mut [u8]) -> Result<usize, ErrorKind> {
        let mut wire = lock(&self.0);
        loop {
            if wire.reset {
                return Err(ErrorKind::ConnectionReset);
            }
            let count = wire.to_device.len().min(bytes.len());
            if count > 0 || wire.closed {
                bytes.iter_mut().zip(wire.to_device.drain(..count)).for_each(|(to, from)| *to = from);
                return Ok(count);
            }
            wire.waits = true;
            self.0.1.notify_all();
            wire = self.0.1.wait(wire).unwrap_or_else(std::sync::PoisonError::into_inner);
            wire.waits = false;
        }
    }
}

impl ReadReady for DeviceEnd {
    fn read_ready(&mut self) -> Result<bool, ErrorKind> {
        let wire = lock(&self.0);
        if wire.reset {
            Err(ErrorKind::ConnectionReset)
        } else {
            Ok(wire.closed || !wire.to_device.is_empty())
        }
    }
}

impl Write for DeviceEnd {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, ErrorKind> {
        let mut wire = lock(&self.0);
        if wire.reset {
            return Err(ErrorKind::ConnectionReset);
        }
        let arriving = wire.spoiled(bytes);
        wire.to_host.extend(arriving);
        self.0.1.notify_all();
        Ok(bytes.len())
    }

    fn flush(&mut self) -> Result<(), ErrorKind> {
        Ok(())
    }
}
