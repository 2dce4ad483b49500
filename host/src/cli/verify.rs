//! `lacuna verify`.

use super::{Common, Failure, bar, inputs, say};
use crate::complete::clean::clean;
use crate::complete::noise::widest;
use crate::complete::start::Thinned;
use crate::complete::{Options, Start, prepare, start};
use crate::fit::Digests;
use crate::sentence::sentence;
use crate::verify::{CLASSES, Case, Report, verify, verify_core};
use lacuna::{Model, Schedule};
use std::path::{Path, PathBuf};

/// Check this build: reference against float against fixed point, digests against the golden ones.
#[derive(clap::Args)]
pub struct Verify {
    /// Compare float and fixed point on these scans instead of the fixtures
    scans: Vec<PathBuf>,
    /// The model of these scans [default: the built-in one]
    #[arg(short, long, requires = "scans")]
    model: Option<PathBuf>,
}

/// What the table means: a build is right if its digests are golden; the distances say why it is not.
const LEGEND: &str = "\
rungs: 1 reference on the training volumes, 1f reference on the model file's numbers and the core's hull, 2 core in double
precision, 3 core in fixed point; differences near the surface in mm, of weights in standard deviations (sd). 1-2 is what
band, model and hull quantisation cost, 1f-2 the core's arithmetic, 2-3 rounding.";

/// Name of the case with the built-in model and the example scan.
pub const BUILT_IN: &str = "built-in";

impl Verify {
    /// Runs the subcommand.
    pub fn run(&self, common: &Common) -> Result<(), Failure> {
        let (reports, failed) = if self.scans.is_empty() { (fixtures()?, None) } else { self.compare()? };
        if common.json {
            say(&serde_json::to_string_pretty(&reports)?);
        } else {
            reports.iter().for_each(|report| say(&report.to_string()));
        }
        if let Some(failure) = failed {
            return Err(failure);
        }
        let fixtures = self.scans.is_empty();
        let changed: Vec<String> = reports
            .iter()
            .filter_map(|report| match report.golden {
                None if fixtures => Some(format!("{} (no golden digests)", report.case)),
                _ => report.changed().first().map(|stage| format!("{} ({stage})", report.case)),
            })
            .collect();
        if !common.json {
            say(LEGEND);
            if fixtures && changed.is_empty() {
                say(&format!("all {} cases compute the golden bits", reports.len()));
            }
        }
        if changed.is_empty() {
            return Ok(());
        }
        let list = changed.join(", ");
        Err(format!("this build does not compute the golden bits; first stage that differs: {list}").into())
    }

    /// The reports up to the first scan that has none, and why it has none.
    fn compare(&self) -> Result<(Vec<Report>, Option<Failure>), Failure> {
        let bytes = inputs::model_bytes(self.model.as_deref())?;
        let model = inputs::model(&bytes, self.model.as_deref())?;
        let progress = bar(self.scans.len() as u64, "verifying");
        let mut reports = Vec::new();
        for path in &self.scans {
            match report(path, &bytes, &model) {
                Ok(report) => reports.push(report),
                Err(failure) => return Ok((reports, Some(failure))),
            }
            progress.inc(1);
        }
        progress.finish_and_clear();
        Ok((reports, None))
    }
}

fn report(path: &Path, bytes: &[u8], model: &Model<'_>) -> Result<Report, Failure> {
    let scan = inputs::usable_scan(Some(path), model)?;
    let start =
        prepare(model, &scan, &Options::of(model)).map_err(|error| inputs::named(Some(path), &error))?.start;
    let case = case(&path.display().to_string(), bytes, model, start);
    verify_core(&case, Schedule::of(model), None).map_err(|error| inputs::named(Some(path), &error))
}

/// A scan in the pose that registration finds, to be refined by the core.
fn case(name: &str, bytes: &[u8], model: &Model<'_>, start: Start) -> Case {
    let rounds = start.rounds(model);
    let Thinned { points, rough, .. } = start.thinned;
    Case { name: name.into(), model: bytes.to_vec(), points, pose: rough.pose, rounds, volumes: None }
}

/// All fixtures against their golden digests.
///
/// # Errors
/// A fixture that cannot be run.
pub fn fixtures() -> Result<Vec<Report>, Failure> {
    let progress = bar(CLASSES.len() as u64 + 1, "verifying");
    let mut reports = Vec::new();
    for class in &CLASSES {
        let case = Case::synthetic(class)?;
        let model =
            Model::from_bytes(&case.model).map_err(|error| sentence("the fixture's model", &error))?;
        reports.push(verify(&case, Schedule::of(&model), golden(class.name))?);
        progress.inc(1);
    }
    let bytes = inputs::model_bytes(None)?;
    let model = inputs::model(&bytes, None)?;
    // As firmware carries it: without the small pieces.
    let example = clean(&inputs::scan(None)?.mesh, widest(&model)).scan;
    let start = start(&model, &example, &Options::of(&model))?;
    let case = case(BUILT_IN, &bytes, &model, start);
    reports.push(verify_core(&case, Schedule::of(&model), golden(BUILT_IN))?);
    progress.finish_and_clear();
    Ok(reports)
}

fn golden(name: &str) -> Option<Digests> {
    let found = lacuna_fixtures::golden(name)?;
    Some(Digests {
        pose: found.pose,
        hull: found.hull,
        global: found.global,
        local: found.local,
        distances: found.distances,
    })
}
