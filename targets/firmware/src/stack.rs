//! How deep the stack has been: its free part is painted at the start, and the paint that is left counts.

use crate::Machine;
use core::ops::Range;
use core::ptr::{read_volatile, write_volatile};

const PAINT: u32 = 0xcccc_cccc;
/// Bytes below the current frame that are not painted: the painter itself lives there.
const MARGIN: usize = 256;

/// Paints what is free of the stack.
#[inline(never)]
pub fn paint<M: Machine>(machine: &M) {
    let here = 0u32;
    let end = (&raw const here as usize).saturating_sub(MARGIN);
    for address in (machine.stack().start..end).step_by(4) {
        // SAFETY: between the end of the statics and the painter's own frame nothing lives.
        unsafe { write_volatile(address as *mut u32, PAINT) };
    }
}

/// Most bytes of stack in use since [`paint`].
pub fn high_water<M: Machine>(machine: &M) -> usize {
    let Range { start, end } = machine.stack();
    // SAFETY: the stack's memory is always readable.
    let painted = |&address: &usize| unsafe { read_volatile(address as *const u32) } == PAINT;
    end - (start..end).step_by(4).take_while(painted).last().unwrap_or(start)
}
