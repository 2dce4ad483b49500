//! Lacuna on QEMU's mps2-an500.
#![no_std]
#![no_main]

lacuna_firmware::mps_firmware!("M7", uart: 0x4000_4000, fpgaio: 0x4002_8000);
