//! `lacuna device`: the same completions on a device.

mod complete;
mod info;
mod line;
mod verify;

use super::{Common, Failure};

/// Let a device complete scans: over a serial port, TCP, or in QEMU.
#[derive(clap::Args)]
pub struct Device {
    #[command(subcommand)]
    command: Command,
}

#[derive(clap::Subcommand)]
enum Command {
    /// Show what the device is and what model it holds
    Info(info::Info),
    /// Complete a scan on the device: the same mesh as `lacuna complete`, byte for byte
    Complete(complete::Complete),
    /// Complete scans here and on the device, and compare the bits of every stage
    Verify(verify::Verify),
}

impl Device {
    /// Runs the subcommand.
    pub fn run(&self, common: &Common) -> Result<(), Failure> {
        match &self.command {
            Command::Info(args) => args.run(common),
            Command::Complete(args) => args.run(common),
            Command::Verify(args) => args.run(common),
        }
    }
}
