//! `lacuna device complete`.

use super::line::{self, Line};
use super::{Common, Failure};
use crate::cli::complete;
use crate::cli::completed::OnDevice;
use crate::complete::Error;
use crate::device::Scan;
use lacuna::wire::message::Iterations;

/// Complete a scan on the device: the same mesh as `lacuna complete`, byte for byte.
#[derive(clap::Args)]
pub struct Complete {
    #[command(flatten)]
    complete: complete::Complete,
    #[command(flatten)]
    line: Line,
}

impl Complete {
    /// Runs the subcommand.
    pub fn run(&self, common: &Common) -> Result<(), Failure> {
        let mut client = self.line.open()?;
        self.complete.run_by(common, |model, start, options| {
            let momentum = options.schedule.momentum != 0;
            let iterations = if momentum { Iterations::Momentum } else { Iterations::Varying };
            let scan = Scan::new(start, iterations);
            let results = line::complete(&mut client, model, &scan);
            let results = results.map_err(|error| Error::Elsewhere(error.into()))?;
            let told = OnDevice { counters: results.counters, line: client.statistics };
            Ok((results.into_fit(model, &scan.begin).map_err(Error::Fit)?, Some(told)))
        })
    }
}
