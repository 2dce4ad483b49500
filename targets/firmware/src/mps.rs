//! The peripherals that Arm's MPS2 and MPS3 boards share: the CMSDK serial port and the FPGA's free counter.

use crate::Machine;
use core::ops::Range;
use core::ptr::{read_volatile, write_volatile};

/// Where a board has them.
pub trait Board {
    /// As [`Machine::NAME`].
    const NAME: &'static str;
    /// CMSDK UART0.
    const UART: usize;
    /// FPGAIO.
    const FPGAIO: usize;
}

/// A board that has been set up.
pub struct Mps<B: Board>(core::marker::PhantomData<B>);

const DATA: usize = 0x0;
const STATE: usize = 0x4;
const CONTROL: usize = 0x8;
const BAUD_DIVIDER: usize = 0x10;
const SEND_FULL: u32 = 1;
const RECEIVED: u32 = 2;
const COUNTER: usize = 0x18;
const PRESCALE: usize = 0x1c;

impl<B: Board> Mps<B> {
    /// Enables the serial line and the counter.
    ///
    /// # Safety
    /// To be called once, on this board.
    pub unsafe fn new() -> Self {
        write(B::FPGAIO + PRESCALE, 0);
        write(B::UART + BAUD_DIVIDER, 16);
        write(B::UART + CONTROL, 3);
        Self(core::marker::PhantomData)
    }
}

fn read(address: usize) -> u32 {
    // SAFETY: a register of the board, which whoever called `Mps::new` has vouched for.
    unsafe { read_volatile(address as *const u32) }
}

fn write(address: usize, value: u32) {
    // SAFETY: as for `read`.
    unsafe { write_volatile(address as *mut u32, value) }
}

unsafe extern "C" {
    static _stack_start: u32;
    static _stack_end: u32;
}

impl<B: Board> Machine for Mps<B> {
    const NAME: &'static str = B::NAME;

    fn ticks() -> u32 {
        read(B::FPGAIO + COUNTER)
    }

    fn spin(rounds: u32) -> u32 {
        // SAFETY: counts a register down.
        unsafe {
            core::arch::asm!(
                "1:", "subs {n}, {n}, #1",
                ".rept 13", "nop", ".endr",
                "bne 1b",
                n = inout(reg) rounds => _, options(nomem, nostack),
            );
        }
        rounds * 15
    }

    fn receive(&mut self) -> Option<u8> {
        (read(B::UART + STATE) & RECEIVED != 0).then(|| read(B::UART + DATA) as u8)
    }

    fn send(&mut self, byte: u8) {
        while read(B::UART + STATE) & SEND_FULL != 0 {}
        write(B::UART + DATA, u32::from(byte));
    }

    fn stack(&self) -> Range<usize> {
        (&raw const _stack_end) as usize..(&raw const _stack_start) as usize
    }
}

/// The program of a board: its processor's name, and where its serial port and FPGAIO lie. The crate that asks for it depends
/// on cortex-m-rt.
#[macro_export]
macro_rules! mps_firmware {
    ($name:literal, uart: $uart:literal, fpgaio: $fpgaio:literal) => {
        enum An {}

        impl $crate::mps::Board for An {
            const NAME: &'static str = $name;
            const UART: usize = $uart;
            const FPGAIO: usize = $fpgaio;
        }

        #[cortex_m_rt::entry]
        fn main() -> ! {
            // SAFETY: called once, on the board this firmware is for.
            $crate::run(unsafe { $crate::mps::Mps::<An>::new() })
        }

        #[cortex_m_rt::exception]
        unsafe fn HardFault(_: &cortex_m_rt::ExceptionFrame) -> ! {
            $crate::fault()
        }
    };
}
