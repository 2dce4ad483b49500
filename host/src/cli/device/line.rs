//! Which device: options, and the client for it.

use super::Failure;
use crate::cli::bar;
use crate::device::{Client, Error, Link, Machine, Progress, Qemu, Results, Scan, Timing, run, serial, tcp};
use indicatif::ProgressBar;
use lacuna::Model;
use std::path::PathBuf;

/// A device's address; exactly one.
#[derive(clap::Args)]
#[group(required = true, multiple = false)]
struct Address {
    /// The serial port it is at
    #[arg(long, value_name = "PATH")]
    serial: Option<String>,
    /// The TCP address it is at
    #[arg(long, value_name = "HOST:PORT")]
    tcp: Option<String>,
    /// Start this machine's firmware in QEMU
    #[arg(long, value_name = "MACHINE")]
    qemu: Option<Machine>,
}

/// How to reach a device.
#[derive(clap::Args)]
pub struct Line {
    #[command(flatten)]
    address: Address,
    /// Bits per second of the serial port
    #[arg(long, default_value_t = 115_200, conflicts_with_all = ["tcp", "qemu"])]
    baud: u32,
    /// The firmware for QEMU [default: the one built in targets/]
    #[arg(long, value_name = "ELF", conflicts_with_all = ["tcp", "serial"])]
    firmware: Option<PathBuf>,
}

/// A client for any kind of line.
pub type AnyClient = Client<Box<dyn Link + Send>>;

impl Line {
    /// Reaches the device and says hello.
    ///
    /// # Errors
    /// No line, or no device on it.
    pub fn open(&self) -> Result<AnyClient, Failure> {
        let mut client = Client::new(self.link()?, Timing::default());
        client.hello()?;
        Ok(client)
    }

    fn link(&self) -> Result<Box<dyn Link + Send>, Failure> {
        let Address { serial: path, tcp: address, qemu } = &self.address;
        if let Some(path) = path {
            let port = serial(path, self.baud);
            return Ok(Box::new(
                port.map_err(|error| format!("cannot open the serial port {path}: {error}"))?,
            ));
        }
        if let Some(address) = address {
            let stream = tcp(address);
            return Ok(Box::new(stream.map_err(|error| format!("cannot reach {address}: {error}"))?));
        }
        let Some(machine) = *qemu else { return Err("give --serial, --tcp or --qemu".into()) };
        Ok(Box::new(Qemu::start(machine, self.firmware.as_deref())?))
    }
}

/// Completes a scan on the device with a progress bar, after a look at the device's model.
///
/// # Errors
/// Another model, a refusal, or a lost device.
pub fn complete(client: &mut AnyClient, model: &Model<'_>, scan: &Scan) -> Result<Results, Error> {
    check_model(client, model)?;
    let progress = bar(1, "");
    let results = run(client, model, scan, &mut |stage| show(&progress, stage));
    progress.finish_and_clear();
    results
}

fn check_model(client: &mut AnyClient, model: &Model<'_>) -> Result<(), Error> {
    let held = client.info()?.model.map_err(|error| Error::Refused(lacuna::wire::Refusal::Core(error)))?;
    if held.checksum == model.checksum() {
        return Ok(());
    }
    Err(Error::OtherModel {
        held: held.class.into(),
        held_checksum: held.checksum,
        given: model.header().class.into(),
        given_checksum: model.checksum(),
    })
}

fn show(bar: &ProgressBar, progress: Progress) {
    let (what, done, total) = match progress {
        Progress::Sending(done, total) => ("sending".to_owned(), done, total),
        Progress::Fitting(stage, done, total) => (format!("{stage:?}").to_lowercase(), done, total),
        Progress::Fetching(done, total) => ("fetching".to_owned(), done, total),
    };
    bar.set_message(what);
    bar.set_length(u64::from(total));
    bar.set_position(u64::from(done));
}
