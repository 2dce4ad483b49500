//! `lacuna device info`.

use super::line::Line;
use super::{Common, Failure};
use crate::cli::say;
use crate::device::refusal;
use crate::unit::symbol;
use lacuna::wire::Refusal;
use lacuna::wire::message;
use serde_json::{Value, json};

/// Show what the device is and what model it holds.
#[derive(clap::Args)]
pub struct Info {
    #[command(flatten)]
    line: Line,
}

impl Info {
    /// Runs the subcommand.
    pub fn run(&self, common: &Common) -> Result<(), Failure> {
        let mut client = self.line.open()?;
        let info = client.info()?;
        if common.json {
            say(&serde_json::to_string_pretty(&told(&info))?);
            return Ok(());
        }
        say(&format!("machine         {}, core {}", info.machine, info.core));
        say(&format!("scans           up to {} points", info.max_points));
        say(&format!("memory          {} KiB lent to points, fit and protocol", info.ram / 1024));
        say(&format!("messages        up to {} bytes", info.max_message));
        match info.model {
            Ok(model) => say(&format!(
                "model           {} ({:08x}): {} modes, {} voxels of {} {}, {} KiB",
                model.class,
                model.checksum,
                model.modes,
                model.voxels,
                model.spacing,
                symbol(model.unit),
                info.flash / 1024
            )),
            Err(error) => say(&format!("model           none: {}", refusal(&Refusal::Core(error)))),
        }
        Ok(())
    }
}

/// The same as one object; checksum and unit as `inspect --json` has them. Without a model it is null, and `refused` tells why.
fn told(info: &message::Info<'_>) -> Value {
    let model = info.model.ok().map(|model| {
        json!({
            "class": model.class,
            "checksum": format!("{:08x}", model.checksum),
            "modes": model.modes,
            "spacing": model.spacing,
            "unit": symbol(model.unit),
            "voxels": model.voxels,
        })
    });
    json!({
        "machine": info.machine,
        "core": info.core,
        "max_points": info.max_points,
        "ram": info.ram,
        "flash": info.flash,
        "max_message": info.max_message,
        "model": model,
        "refused": info.model.err().map(|error| refusal(&Refusal::Core(error))),
    })
}
