//! defmt's frames on the emulator's standard error: `defmt-print -e ELF` reads them there. On a board the same few
//! lines write to RTT or a UART instead.

use core::ptr::addr_of_mut;
use semihosting::io::{self, Write};

#[defmt::global_logger]
struct Logger;

static mut ENCODER: defmt::Encoder = defmt::Encoder::new();

// SAFETY: one core, and nothing is logged in interrupts: a frame is never begun within another.
unsafe impl defmt::Logger for Logger {
    fn acquire() {
        // SAFETY: nobody else holds the encoder, see above.
        unsafe { (*addr_of_mut!(ENCODER)).start_frame(send) }
    }

    unsafe fn flush() {}

    unsafe fn release() {
        // SAFETY: as for `acquire`.
        unsafe { (*addr_of_mut!(ENCODER)).end_frame(send) }
    }

    unsafe fn write(bytes: &[u8]) {
        // SAFETY: as for `acquire`.
        unsafe { (*addr_of_mut!(ENCODER)).write(bytes, send) }
    }
}

fn send(bytes: &[u8]) {
    if let Ok(mut out) = io::stderr() {
        let _ = out.write_all(bytes);
    }
}
