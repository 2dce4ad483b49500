//! What the example firmwares of all machines share.
//!
//! A machine brings its registers ([`Machine`]); everything else is here: [`memory`] in statics whose sizes
//! the build asks the model for, the [`example`] scan, [`count`]s of instructions.
#![no_std]

pub mod count;
pub mod example;
pub mod machine;
pub mod memory;
#[cfg(target_arch = "arm")]
pub mod mps;
pub mod stack;
pub mod text;

pub use machine::Machine;

/// The model this firmware was linked with, read in place.
#[unsafe(link_section = ".blob")]
static MODEL: [u8; include_bytes!(concat!(env!("OUT_DIR"), "/model.lacuna")).len()] =
    *include_bytes!(concat!(env!("OUT_DIR"), "/model.lacuna"));

/// The scan it carries.
#[unsafe(link_section = ".blob")]
static SCAN: [u8; include_bytes!(concat!(env!("OUT_DIR"), "/scan.cloud")).len()] =
    *include_bytes!(concat!(env!("OUT_DIR"), "/scan.cloud"));

/// Runs the example and ends the emulation: 0 for success, 1 for a refusal.
pub fn run<M: Machine>(mut machine: M) -> ! {
    stack::paint(&machine);
    let code = i32::from(example::run(&mut machine).is_err());
    semihosting::process::exit(code)
}

/// Ends the emulation after a fault of the processor.
pub fn fault() -> ! {
    semihosting::process::exit(2)
}

/// Any panic path that is linked is a call of this function, which does not exist: the link fails.
#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    unsafe extern "C" {
        safe fn lacuna_panic_path_linked() -> !;
    }
    lacuna_panic_path_linked()
}
