//! Serves scans over the machine's serial line.

use crate::count::Scale;
use crate::{MODEL, Machine, memory};
use core::convert::Infallible;
use core::marker::PhantomData;
use embedded_io::{ErrorType, Read, ReadReady, Write};
use lacuna::wire::{Buffers, Device, serve};
use static_cell::ConstStaticCell;

// What the core's documentation says of these processors.
const _: () = assert!(size_of::<Buffers>() <= 5148);

static WIRE: ConstStaticCell<Buffers> = ConstStaticCell::new(Buffers::new());

/// The serial line.
struct Line<'m, M: Machine> {
    machine: &'m mut M,
    /// A byte that has been received and not read.
    waiting: Option<u8>,
}

/// The machine's ticks as instructions that do not wrap.
struct Counter<M: Machine> {
    scale: Scale,
    /// Ticks when they were read last, and all before.
    last: u32,
    ticks: u64,
    machine: PhantomData<M>,
}

impl<M: Machine> Counter<M> {
    fn new() -> Self {
        Self { scale: Scale::measure::<M>(), last: M::ticks(), ticks: 0, machine: PhantomData }
    }

    fn instructions(&mut self) -> u64 {
        let now = M::ticks();
        self.ticks += u64::from(now.wrapping_sub(self.last));
        self.last = now;
        self.scale.instructions(self.ticks)
    }
}

impl<M: Machine> ErrorType for Line<'_, M> {
    type Error = Infallible;
}

impl<M: Machine> Read for Line<'_, M> {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Infallible> {
        while !self.read_ready()? {}
        let mut count = 0;
        for slot in buffer {
            let Some(byte) = self.waiting.take().or_else(|| self.machine.receive()) else { break };
            *slot = byte;
            count += 1;
        }
        Ok(count)
    }
}

impl<M: Machine> ReadReady for Line<'_, M> {
    fn read_ready(&mut self) -> Result<bool, Infallible> {
        self.waiting = self.waiting.or_else(|| self.machine.receive());
        Ok(self.waiting.is_some())
    }
}

impl<M: Machine> Write for Line<'_, M> {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        bytes.iter().for_each(|&byte| self.machine.send(byte));
        Ok(bytes.len())
    }

    fn flush(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}

/// Serves for ever; returns only where the static memory has been handed out before.
pub fn run<M: Machine>(machine: &mut M) {
    let (Some((scan, memory)), Some(wire)) = (memory::take(), WIRE.try_take()) else { return };
    let mut line = Line { machine, waiting: None };
    let mut counter = Counter::<M>::new();
    let memory::Scan { points, rows } = scan;
    let device = Device { machine: M::NAME, model: &MODEL, points, rows, memory };
    serve(&mut line, device, || counter.instructions(), wire);
}
