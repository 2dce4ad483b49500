//! What the example firmwares of all machines share.
//!
//! A machine brings its registers ([`Machine`]); everything else is here: [`memory`] in statics whose sizes
//! the build asks the model for, the [`example`] scan, [`count`]s of instructions, and [`serve`] for scans that
//! come over the wire.
#![no_std]

pub mod count;
pub mod example;
#[cfg(feature = "defmt")]
mod log;
pub mod machine;
pub mod memory;
#[cfg(target_arch = "arm")]
pub mod mps;
pub mod serve;
pub mod stack;
pub mod text;

pub use machine::Machine;
use semihosting::sys::arm_compat::CommandLine;

/// The model this firmware was linked with, read in place.
#[unsafe(link_section = ".blob")]
static MODEL: [u8; include_bytes!(concat!(env!("OUT_DIR"), "/model.lacuna")).len()] =
    *include_bytes!(concat!(env!("OUT_DIR"), "/model.lacuna"));

/// The scan it carries.
#[unsafe(link_section = ".blob")]
static SCAN: [u8; include_bytes!(concat!(env!("OUT_DIR"), "/scan.cloud")).len()] =
    *include_bytes!(concat!(env!("OUT_DIR"), "/scan.cloud"));

/// Serves the wire if the emulator's argument is `serve`; otherwise runs the example and ends the emulation, with
/// 0 for success and 1 for a refusal.
pub fn run<M: Machine>(mut machine: M) -> ! {
    stack::paint(&machine);
    let code = if is_asked_to_serve() {
        serve::run(&mut machine);
        1
    } else {
        i32::from(example::run(&mut machine).is_err())
    };
    semihosting::process::exit(code)
}

/// Whether the last of the emulator's arguments is `serve`.
// The newer function cuts its buffer with an index, which is a panic path.
#[allow(deprecated)]
fn is_asked_to_serve() -> bool {
    let mut buffer = [0u8; 64];
    let mut line = CommandLine { ptr: buffer.as_mut_ptr(), size: buffer.len() };
    // SAFETY: pointer and size are those of the buffer, which outlives the call.
    let answer = unsafe { semihosting::sys::arm_compat::sys_get_cmdline(&mut line) };
    answer.is_ok() && buffer.windows(6).any(|word| word == b"serve\0")
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
