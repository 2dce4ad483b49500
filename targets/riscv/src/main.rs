//! Lacuna on QEMU's RISC-V board virt.
#![no_std]
#![no_main]

use core::arch::asm;
use core::ops::Range;
use core::ptr::{read_volatile, write_volatile};
use lacuna_firmware::Machine;

/// The board: a 16550 serial port, and the processor's own counter of instructions.
struct Virt;

const UART: usize = 0x1000_0000;
const LINE_STATUS: usize = UART + 5;
const RECEIVED: u8 = 1;
const SEND_EMPTY: u8 = 0x20;

unsafe extern "C" {
    static __sstack: u32;
    static __estack: u32;
}

impl Machine for Virt {
    const NAME: &'static str = "RISC-V";

    fn ticks() -> u32 {
        let count: u32;
        // SAFETY: reads a counter.
        unsafe { asm!("csrr {}, minstret", out(reg) count, options(nomem, nostack)) };
        count
    }

    fn spin(rounds: u32) -> u32 {
        // SAFETY: counts a register down.
        unsafe {
            asm!(
                "1:", "addi {n}, {n}, -1",
                ".rept 13", "nop", ".endr",
                "bnez {n}, 1b",
                n = inout(reg) rounds => _, options(nomem, nostack),
            );
        }
        rounds * 15
    }

    fn receive(&mut self) -> Option<u8> {
        // SAFETY: registers of the serial port.
        unsafe {
            let status = read_volatile(LINE_STATUS as *const u8);
            (status & RECEIVED != 0).then(|| read_volatile(UART as *const u8))
        }
    }

    fn send(&mut self, byte: u8) {
        // SAFETY: registers of the serial port.
        unsafe {
            while read_volatile(LINE_STATUS as *const u8) & SEND_EMPTY == 0 {}
            write_volatile(UART as *mut u8, byte);
        }
    }

    fn stack(&self) -> Range<usize> {
        (&raw const __estack) as usize..(&raw const __sstack) as usize
    }
}

#[riscv_rt::entry]
fn main() -> ! {
    lacuna_firmware::run(Virt)
}

// SAFETY: the runtime asks for a function of this name and type.
#[unsafe(export_name = "ExceptionHandler")]
extern "C" fn exception(_: &riscv_rt::TrapFrame) -> ! {
    lacuna_firmware::fault()
}
