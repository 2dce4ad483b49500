//! Lacuna on QEMU's mps3-an547.
#![no_std]
#![no_main]

lacuna_firmware::mps_firmware!("M55", uart: 0x5930_3000, fpgaio: 0x5930_2000);
