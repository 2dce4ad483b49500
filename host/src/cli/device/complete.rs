//! `lacuna device complete`.

use super::line::{self, Line};
use super::{Common, Failure};
use crate::cli::{complete, say};
use crate::complete::Error;
use crate::device::Scan;
use lacuna::wire::message::{Counters, Iterations};

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
        let mut counters = Counters::default();
        self.complete.run_by(common, |model, start, options| {
            let momentum = options.schedule.momentum != 0;
            let iterations = if momentum { Iterations::Momentum } else { Iterations::Varying };
            let scan = Scan::new(start, iterations);
            let results = line::complete(&mut client, model, &scan);
            let results = results.map_err(|error| Error::Elsewhere(error.into()))?;
            counters = results.counters;
            results.into_fit(model, &scan.begin).map_err(Error::Fit)
        })?;
        if !common.json {
            say(&format!("device          {}", costs(&counters)));
            let s = client.statistics;
            say(&format!(
                "line            {} requests, {} repeated, {} sessions",
                s.sent, s.repeated, s.sessions
            ));
        }
        Ok(())
    }
}

/// What the stages cost, by the device's own counter.
pub fn costs(counters: &Counters) -> String {
    let Counters { pose, hull, global, local, distances } = counters;
    let stages =
        [("pose", pose), ("hull", hull), ("global", global), ("local", local), ("distances", distances)];
    let cost = |(name, count): (&str, &lacuna::wire::message::Count)| match count.work {
        0 => format!("{name} {} steps", count.steps),
        work => format!("{name} {:.1} M", work as f64 / 1e6),
    };
    stages.map(cost).join(", ")
}
