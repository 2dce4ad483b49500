//! `lacuna device verify`.

use super::line::{self, AnyClient, Line};
use super::{Common, Failure};
use crate::cli::completed::costs;
use crate::cli::{inputs, say};
use crate::complete::start::Known;
use crate::complete::{Options, Start, fit_here, prepare};
use crate::device::Scan;
use crate::fit::Digests;
use crate::mesh::Mesh;
use crate::synth::{Head, Kind, ScannerSettings, scan};
use lacuna::pose_fit;
use lacuna::wire::message::{Counters, Iterations};
use lacuna::{Fixed, Model, Schedule};
use std::path::PathBuf;

/// Complete scans here and on the device, and compare the bits of every stage.
#[derive(clap::Args)]
pub struct Verify {
    /// The scans [default: the example scan, and scans of the built-in class from other sides]
    scans: Vec<PathBuf>,
    /// The model of these scans, which the device must hold [default: the built-in one]
    #[arg(short, long, requires = "scans")]
    model: Option<PathBuf>,
    #[command(flatten)]
    line: Line,
}

#[derive(serde::Serialize)]
struct Report {
    scan: String,
    points: usize,
    host: Digests,
    device: Digests,
    counters: Counters,
    seconds: f64,
}

impl Report {
    /// The first stage whose bits differ.
    fn difference(&self) -> Option<&'static str> {
        let pairs = self.host.named().into_iter().zip(self.device.named());
        pairs.into_iter().find(|(host, device)| host != device).map(|((stage, _), _)| stage)
    }
}

const fn name_of(hint: pose_fit::Hint) -> &'static str {
    match hint {
        pose_fit::Hint::Rough => "rough",
        pose_fit::Hint::Exact => "exact",
        pose_fit::Hint::Settled => "settled",
    }
}

impl Verify {
    /// Runs the subcommand.
    pub fn run(&self, common: &Common) -> Result<(), Failure> {
        let mut client = self.line.open()?;
        let bytes = inputs::model_bytes(self.model.as_deref())?;
        let model = inputs::model(&bytes, self.model.as_deref())?;
        let mut reports = vec![];
        let compared = self.compare(&mut client, &model, &mut |report| {
            if !common.json {
                tell(&report);
            }
            reports.push(report);
        });
        if common.json {
            say(&serde_json::to_string_pretty(&reports)?);
        }
        compared?;
        let differing = |r: &Report| r.difference().map(|stage| format!("{} ({stage})", r.scan));
        let different: Vec<String> = reports.iter().filter_map(differing).collect();
        if different.is_empty() {
            return Ok(());
        }
        let list = different.join("; ");
        Err(format!("the device does not compute the host's bits; first stage that differs: {list}").into())
    }

    /// Completes every scan from the pose that is found and from the same as an exact one, and hands out each report.
    fn compare(
        &self,
        client: &mut AnyClient,
        model: &Model<'_>,
        heard: &mut dyn FnMut(Report),
    ) -> Result<(), Failure> {
        let schedule = Schedule::of(model);
        for (name, mesh) in self.meshes(model)? {
            let named = |error: &dyn std::fmt::Display| -> Failure { format!("{name}: {error}").into() };
            let start = prepare(model, &mesh, &Options::of(model)).map_err(|error| named(&error))?.start;
            let known = Known { hint: pose_fit::Hint::Exact, ..start.known.clone() };
            let exact = Start { thinned: start.thinned.clone(), known, depth: None };
            for start in [&start, &exact] {
                let what = format!("{name}, {} pose", name_of(start.known.hint));
                heard(compare(client, model, what, start, schedule).map_err(|error| named(&error))?);
            }
        }
        Ok(())
    }

    /// Scans by name.
    fn meshes(&self, model: &Model<'_>) -> Result<Vec<(String, Mesh)>, Failure> {
        if self.scans.is_empty() {
            let example = ("the example scan".to_owned(), inputs::usable_scan(None, model)?);
            let sides = [("front", Kind::Front), ("side", Kind::Side)];
            return Ok(std::iter::once(example)
                .chain(sides.map(|(name, kind)| synthetic(name, kind)))
                .collect());
        }
        let read = |path: &PathBuf| Ok((path.display().to_string(), inputs::usable_scan(Some(path), model)?));
        self.scans.iter().map(read).collect()
    }
}

/// A scan of a head of the built-in class that is not among the training shapes.
fn synthetic(name: &str, kind: Kind) -> (String, Mesh) {
    const HEAD: (u64, u64) = (1, 1001);
    let head = Head::sample(HEAD.0, HEAD.1).mesh();
    (format!("head {} from the {name}", HEAD.1), scan(&head, kind, &ScannerSettings::small(), HEAD.1).mesh)
}

fn compare(
    client: &mut AnyClient,
    model: &Model<'_>,
    name: String,
    start: &Start,
    schedule: Schedule<'_>,
) -> Result<Report, Failure> {
    let host = fit_here::<Fixed>(model, start, schedule)?.digests;
    let scan = Scan::new(start, Iterations::Varying);
    let begun = std::time::Instant::now();
    let results = line::complete(client, model, &scan)?;
    let (seconds, counters) = (begun.elapsed().as_secs_f64(), results.counters);
    let device = results.into_fit(model, &scan.begin).map_err(crate::complete::Error::Fit)?.digests;
    Ok(Report { scan: name, points: scan.points.len(), host, device, counters, seconds })
}

fn tell(report: &Report) {
    let judgement = report
        .difference()
        .map_or("the host's bits".into(), |stage| format!("differs from stage {stage} on"));
    say(&format!("{}: {} points, {:.1} s, {judgement}", report.scan, report.points, report.seconds));
    say(&format!("  digests       {}", report.device));
    say(&format!("  device        {}", costs(&report.counters)));
}
