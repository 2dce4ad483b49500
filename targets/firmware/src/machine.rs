//! What a machine must tell.

use core::ops::Range;

/// A machine's registers.
pub trait Machine {
    /// Its name, as in the tables.
    const NAME: &'static str;

    /// A counter that advances with the instructions executed; it may wrap.
    fn ticks() -> u32;

    /// Runs a loop of known length: instructions executed, fifteen a round.
    fn spin(rounds: u32) -> u32;

    /// The next byte from the serial line, if one has come.
    fn receive(&mut self) -> Option<u8>;

    /// Sends a byte over the serial line.
    fn send(&mut self, byte: u8);

    /// The memory the stack may grow into, lowest address first.
    fn stack(&self) -> Range<usize>;
}
