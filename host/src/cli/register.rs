//! `lacuna register`.

use super::inputs::{self, Subject};
use super::outputs::{self, Output};
use super::{Common, Failure, say};
use crate::check::alternatives;
use crate::complete::clean::clean;
use crate::complete::noise::widest;
use crate::complete::prepared::Prepared;
use crate::complete::start::{Known, Start};
use crate::complete::verdict;
use crate::{io, register};
use std::path::PathBuf;

/// Find the pose of a scan in a model's frame: the best that a search finds, which `complete` goes on from.
#[derive(clap::Args)]
pub struct Register {
    #[command(flatten)]
    subject: Subject,
    /// Also write the thinned scan with this pose as a device takes it, for firmware that carries a scan
    #[arg(long, value_name = "FILE")]
    pack: Option<PathBuf>,
}

#[derive(serde::Serialize)]
struct Report {
    /// Row by row; from the scan as it is in its file to the model.
    scan_to_model: [[f64; 4]; 4],
    scale: f64,
    inlier_share: f64,
    runner_up: f64,
    seconds: f64,
    /// What is odd about the scan.
    notes: Vec<String>,
}

impl Register {
    /// Runs the subcommand.
    pub fn run(&self, common: &Common) -> Result<(), Failure> {
        let pack = self.pack.iter().map(|path| Output { option: "--pack", path, format: "cloud" });
        outputs::check(&self.subject.files(), &pack.collect::<Vec<_>>())?;
        let bytes = self.subject.model_bytes()?;
        let model = self.subject.model(&bytes)?;
        let (mesh, notes) = self.subject.mesh(&model)?;
        let cleaned = clean(&mesh, widest(&model));
        let begun = std::time::Instant::now();
        let found = register::register(&model, &cleaned.scan, self.subject.seed).map_err(|error| {
            let told = alternatives::told(&model, &cleaned.scan, self.subject.seed, &error.into());
            self.subject.named(&told)
        })?;
        let seconds = begun.elapsed().as_secs_f64();
        let scale = found.placed.size(&model);
        let odd = verdict::of_pose(&found, scale).map(|(_, text)| text);
        let advice = alternatives::advice_on(&model, &cleaned.scan, self.subject.seed, &found);
        if let Some(path) = &self.pack {
            let start = Start::new(&model, &cleaned.scan, Known::found(found.clone()));
            let start = Prepared::new(&model, cleaned, start).start;
            let bytes = start.packed().to_bytes(&start.thinned.rough.pose, start.known.hint);
            io::atomic::write(path, |file| file.write_all(&bytes))?;
        }
        let report = Report {
            scan_to_model: inputs::matrix(&found.placed, &model, self.subject.factor(&model)),
            scale,
            inlier_share: found.inliers,
            runner_up: found.runner_up,
            seconds,
            notes: notes.into_iter().chain(odd).chain(advice).collect(),
        };
        if common.json {
            say(&serde_json::to_string_pretty(&report)?);
            return Ok(());
        }
        say("scan to model");
        for row in report.scan_to_model {
            say(&row.map(|c| format!("{c:>24}")).join(" "));
        }
        say(&format!("scale           {:.4} of the class", report.scale));
        say(&format!(
            "pose            explains {:.1} % of the scan, the next best {:.1} %",
            100.0 * report.inlier_share,
            100.0 * report.runner_up
        ));
        report.notes.iter().for_each(|note| say(&format!("note            {note}")));
        say(&format!("time            {:.2} s for the search", report.seconds));
        Ok(())
    }
}
