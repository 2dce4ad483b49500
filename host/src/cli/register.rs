//! `lacuna register`.

use super::{Common, Failure, inputs, say};
use crate::complete::clean::clean;
use crate::register;
use lacuna::format::Unit;
use std::path::PathBuf;

/// Find the pose of a scan in a model's frame.
#[derive(clap::Args)]
pub struct Register {
    /// The scan [default: the example scan]
    scan: Option<PathBuf>,
    /// The shape model [default: the built-in one]
    #[arg(short, long)]
    model: Option<PathBuf>,
    /// Unit of the scan, if it is not the model's: mm, m, in, um
    #[arg(long, value_parser = inputs::unit)]
    unit: Option<Unit>,
    /// Seed of the search
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

#[derive(serde::Serialize)]
struct Report {
    /// Row by row; scan (in the model's unit) to model.
    scan_to_model: [[f64; 4]; 4],
    scale: f64,
    inlier_share: f64,
    runner_up: f64,
    seconds: f64,
}

impl Register {
    /// Runs the subcommand.
    pub fn run(&self, common: &Common) -> Result<(), Failure> {
        let bytes = inputs::model_bytes(self.model.as_deref())?;
        let model = inputs::model(&bytes, self.model.as_deref())?;
        let unit = self.unit.unwrap_or(model.header().unit);
        let factor = inputs::millimetres(unit) / inputs::millimetres(model.header().unit);
        let (scan, _) = clean(&inputs::scaled(inputs::scan(self.scan.as_deref())?, factor));
        let start = std::time::Instant::now();
        let found = register::register(&model, &scan, self.seed)
            .map_err(|error| inputs::named(self.scan.as_deref(), &error))?;
        let report = Report {
            scan_to_model: inputs::matrix(&found.placed, &model),
            scale: 1.0 / (f64::from(found.placed.pose.scale) * f64::from(model.header().spacing)),
            inlier_share: found.inliers,
            runner_up: found.runner_up,
            seconds: start.elapsed().as_secs_f64(),
        };
        if common.json {
            say(&serde_json::to_string_pretty(&report)?);
            return Ok(());
        }
        say("scan to model");
        for row in report.scan_to_model {
            say(&row.map(|c| format!("{c:12.6}")).join(" "));
        }
        say(&format!("scale           {:.4} of the class", report.scale));
        say(&format!(
            "inliers         {:.1} %, next best pose {:.1} %",
            100.0 * report.inlier_share,
            100.0 * report.runner_up
        ));
        say(&format!("time            {:.2} s", report.seconds));
        Ok(())
    }
}
