//! Lacuna on QEMU's mps2-an500.
#![no_std]
#![no_main]

use lacuna_firmware::mps::{Board, Mps};

enum An {}

impl Board for An {
    const NAME: &'static str = "M7";
    const UART: usize = 0x4000_4000;
    const FPGAIO: usize = 0x4002_8000;
}

#[cortex_m_rt::entry]
fn main() -> ! {
    // SAFETY: called once, on the board this firmware is for.
    lacuna_firmware::run(unsafe { Mps::<An>::new() })
}

#[cortex_m_rt::exception]
unsafe fn HardFault(_: &cortex_m_rt::ExceptionFrame) -> ! {
    lacuna_firmware::fault()
}
