//! Lacuna on QEMU's mps2-an386.
#![no_std]
#![no_main]

lacuna_firmware::mps_firmware!("M4F", uart: 0x4000_4000, fpgaio: 0x4002_8000);
