//! `lacuna evaluate`.

mod method;
mod names;
mod told;

use super::shapes::{self, Shapes};
use super::train::{align_mode, positive};
use super::{Common, Failure, bar, inputs, outputs, say};
use crate::class;
use crate::evaluate::{
    self, Evaluation, Method, Outcome, PoseMode, Record, Settings, Summary, Target, figure, missed,
};
use crate::io;
use crate::train;
use crate::train::align::{Align, Aligned};
use crate::{report, unit};
use lacuna::format::Unit;
use method::Switches;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Compare local, global and correspondence models on complete shapes, over the number of training shapes.
///
/// Results are kept in the output folder as they come: the same command goes on where it was stopped.
#[derive(clap::Args)]
pub struct Evaluate {
    /// Training meshes, or folders of them: PLY, OBJ, STL
    #[arg(long, required = true, num_args = 1.., value_name = "MESH")]
    train: Vec<PathBuf>,
    /// Complete meshes to approximate, or folders of them
    #[arg(long, required = true, num_args = 1.., value_name = "MESH")]
    targets: Vec<PathBuf>,
    /// Numbers of training shapes [default: 10,30,50,70,90, as far as there are so many]
    #[arg(long, value_delimiter = ',', value_parser = clap::value_parser!(u16).range(2..))]
    counts: Vec<u16>,
    /// Random draws of the training shapes for each number
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u16).range(1..=1000))]
    draws: u16,
    /// Seed of the draws, and of the search for poses
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Where results, table and figure go
    #[arg(short, long, default_value = "evaluation", value_name = "DIR")]
    output: PathBuf,
    /// Also write a report to look at, one HTML file, into this folder
    #[arg(long, value_name = "DIR")]
    report: Option<PathBuf>,
    /// Voxel edge in the meshes' unit [default: 60 to 90 voxels along the longest side]
    #[arg(long, value_parser = positive)]
    spacing: Option<f64>,
    /// Unit of the meshes: mm, m, in, um
    #[arg(long, default_value = "mm", value_parser = unit::parse)]
    unit: Unit,
    /// How training shapes come into one pose: auto, always, never (as for train; with --pose identity auto means never)
    #[arg(long, default_value = "auto", value_parser = align_mode)]
    align: Align,
    /// Pose of the targets: joint (refined with the shape), identity (kept), search (anywhere)
    #[arg(long, default_value = "joint", value_parser = pose_mode)]
    pose: PoseMode,
    #[command(flatten)]
    switches: Switches,
    /// Instead of figure 2: every single departure from the paper, at the first of the counts
    #[arg(long, conflicts_with_all = ["method", "solver", "smooth", "radius", "stride", "kernel"])]
    ablation: bool,
    /// Also write every approximation as PLY, into a folder `surfaces-…` of the output, one for each method and its settings
    #[arg(long)]
    surfaces: bool,
}

/// Numbers of training shapes where none are asked for.
const USUAL_COUNTS: [usize; 5] = [10, 30, 50, 70, 90];
/// Files of the figure and of the ablation: first the settings, which tell what the others mean. They are written before the
/// others, so that those of an interrupted run are known as its own.
const FIGURE_FILES: [&str; 3] = ["settings.json", "results.csv", "figure2.svg"];
const ABLATION_FILES: [&str; 2] = ["ablation.json", "ablation.csv"];
/// Names of the reports.
const EVALUATION: &str = "evaluation";
const ABLATION: &str = "ablation";

/// A target that the local model misses by more than this, class millimetres rms, is not of the class: complete
/// shapes of it are met within 0.2.
const MISSED: f64 = 2.0;

fn pose_mode(text: &str) -> Result<PoseMode, String> {
    match text {
        "joint" => Ok(PoseMode::Joint),
        "identity" => Ok(PoseMode::Identity),
        "search" => Ok(PoseMode::Search),
        _ => Err("use joint, identity or search".into()),
    }
}

impl Evaluate {
    /// Runs the subcommand.
    pub fn run(&self, common: &Common) -> Result<(), Failure> {
        let method = self.switches.chosen()?;
        self.check_outputs()?;
        let training = self.train_settings();
        let shapes = shapes::training_set(&self.train, &training)?;
        let targets = shapes::targets(&self.targets, &shapes.meshes, self.unit)?;
        let mut notes: Vec<String> = shapes.notes.iter().chain(&targets.notes).cloned().collect();
        let counts = self.counts(shapes.meshes.len())?;
        let aligned = shapes::aligned(&shapes.meshes, &shapes.paths, (self.align_mode(), self.seed))?;
        notes.extend(shapes::lay(&aligned, &shapes.paths, self.unit));
        let Aligned { shapes: aligned, .. } = aligned;
        let limit = MISSED * class::millimetre(&aligned);
        let mut evaluation = Evaluation::new(aligned, named(targets)?);
        if self.ablation {
            return self.ablate(&mut evaluation, &notes, (counts[0], common));
        }
        notes.extend(without_correspondence(&evaluation, &shapes.paths));
        let Outcome { records, failed, surfaces } =
            self.results(&mut evaluation, &self.settings(method, &counts), "evaluating")?;
        notes.extend(failed.values().map(evaluate::Error::to_string));
        notes.extend(missed(&records, limit).iter().map(|(name, rms)| self.miss(name, *rms)));
        let settings = self.described(Some(&method), &counts);
        let [settings_file, table_file, figure_file] = FIGURE_FILES;
        self.write(settings_file, &told::settings(&settings)?)?;
        self.write(table_file, &told::csv(&records))?;
        let drawing = figure(&records, unit::symbol(self.unit))?;
        self.write(figure_file, &drawing)?;
        let summary = Summary::of(&records.iter().collect::<Vec<_>>());
        let title = "How well each model approximates complete shapes";
        self.report(EVALUATION, title, &settings, &notes, |s| {
            report::evaluation::figure2(&summary, &drawing, s)
        })?;
        if common.json {
            say(&told::figure_json(&summary, &notes)?);
        } else {
            tell(&notes);
            say(&told::figure(&summary, self.unit));
            say(&format!("figure  {}", self.output.join(figure_file).display()));
            surfaces.iter().for_each(|folder| say(&format!("surfaces  {}", folder.display())));
        }
        whole(failed.len())
    }

    /// Writes a file of the output folder.
    fn write(&self, name: &str, text: &str) -> Result<(), Failure> {
        Ok(io::atomic::write(&self.output.join(name), |file| file.write_all(text.as_bytes()))?)
    }

    fn train_settings(&self) -> train::Settings {
        let memory = io::limit::get();
        train::Settings { spacing: self.spacing, unit: self.unit, memory, ..train::Settings::default() }
    }

    fn miss(&self, target: &str, rms: f64) -> String {
        let (unit, rms) = (unit::symbol(self.unit), unit::digits(rms, 2));
        format!(
            "target {target}: the local model misses it by {rms} {unit} rms: is it of the same class, and in one \
             pose (--pose search)?"
        )
    }

    /// How the shapes come into one pose: targets that stay where they are need a model that knows how shapes lie.
    fn align_mode(&self) -> Align {
        let still = self.pose == PoseMode::Identity && self.align == Align::Auto;
        if still { Align::Never } else { self.align }
    }

    /// Finds outputs that cannot be written before any work is done.
    fn check_outputs(&self) -> Result<(), Failure> {
        let files: &[&str] = if self.ablation { &ABLATION_FILES } else { &FIGURE_FILES };
        outputs::check_folder(&self.output, files)?;
        self.check_own(files)?;
        let name = if self.ablation { ABLATION } else { EVALUATION };
        self.report_path(name).map_or(Ok(()), |path| inputs::check_report(&path))
    }

    /// Refuses a folder with files of these names, of which the first does not hold an evaluation's settings: they may be
    /// something else's, and would be replaced.
    fn check_own(&self, files: &[&str]) -> Result<(), Failure> {
        let paths: Vec<PathBuf> = files.iter().map(|name| self.output.join(name)).collect();
        let settings = paths.first().and_then(|path| io::limit::load(path, io::limit::PER_BYTE).ok());
        if settings.is_some_and(|text| told::is_settings(&text)) {
            return Ok(());
        }
        let other = paths.iter().find(|path| path.exists());
        other.map_or(Ok(()), |path| {
            Err(format!(
                "{} is there without the settings of an evaluation, and would be replaced: move it away, or choose \
                 another folder with -o",
                path.display()
            )
            .into())
        })
    }

    fn report_path(&self, name: &str) -> Option<PathBuf> {
        self.report.as_ref().map(|folder| folder.join(name).with_extension("html"))
    }

    /// The numbers of training shapes, each once; `given` are there.
    fn counts(&self, given: usize) -> Result<Vec<usize>, Failure> {
        if self.counts.is_empty() {
            let usual: Vec<usize> = USUAL_COUNTS.into_iter().filter(|&count| count <= given).collect();
            return Ok(if usual.is_empty() { vec![given] } else { usual });
        }
        let mut counts: Vec<usize> = Vec::new();
        for count in self.counts.iter().map(|&count| usize::from(count)) {
            if !counts.contains(&count) {
                counts.push(count);
            }
        }
        if self.ablation {
            // Departures are looked at for the first of them.
            counts.truncate(1);
        }
        evaluate::enough(&counts, given)?;
        Ok(counts)
    }

    fn settings(&self, method: Method, counts: &[usize]) -> Settings {
        Settings {
            counts: counts.to_vec(),
            draws: usize::from(self.draws),
            seed: self.seed,
            pose: self.pose,
            method,
            baselines: true,
            surfaces: self.surfaces,
            train: self.train_settings(),
        }
    }

    /// The results for some settings: at least one of them is there.
    fn results(
        &self,
        evaluation: &mut Evaluation,
        settings: &Settings,
        what: &str,
    ) -> Result<Outcome, Failure> {
        let state = evaluation.open(settings, &self.output)?;
        let progress = bar(0, what);
        let mut outcome = evaluation.run(settings, state, &|done, total| {
            progress.set_length(total);
            progress.set_position(done);
        })?;
        progress.finish_and_clear();
        if outcome.records.is_empty()
            && let Some((_, error)) = outcome.failed.pop_first()
        {
            return Err(error.into());
        }
        Ok(outcome)
    }

    /// Names and values of all settings: what a result means, and how it is had again.
    fn described(&self, method: Option<&Method>, counts: &[usize]) -> Vec<(&'static str, String)> {
        let list =
            |paths: &[PathBuf]| paths.iter().map(|p| p.display().to_string()).collect::<Vec<_>>().join(", ");
        let counts: Vec<String> = counts.iter().map(usize::to_string).collect();
        vec![
            (told::PROGRAM, format!("lacuna {}", env!("CARGO_PKG_VERSION"))),
            ("training shapes", list(&self.train)),
            ("targets", list(&self.targets)),
            ("counts", counts.join(", ")),
            ("draws, seed", format!("{}, {}", self.draws, self.seed)),
            ("unit", unit::symbol(self.unit).into()),
            ("pose of the training shapes", json(&self.align_mode())),
            ("pose of the targets", json(&self.pose)),
            ("voxel edge", self.spacing.map_or("chosen from the size".into(), |s| s.to_string())),
            ("method", method.map_or("each departure from the paper alone".into(), json)),
        ]
    }

    /// Writes a report, if one is asked for.
    fn report(
        &self,
        name: &str,
        title: &str,
        settings: &[(&str, String)],
        notes: &[String],
        html: impl FnOnce(&report::evaluation::Subject<'_>) -> String,
    ) -> Result<(), Failure> {
        let Some(path) = self.report_path(name) else { return Ok(()) };
        let unit = unit::symbol(self.unit);
        let command = report::command_line();
        let subject = report::evaluation::Subject { title, unit, settings, notes, command: &command };
        inputs::write_report(&path, &html(&subject))
    }

    fn ablate(
        &self,
        evaluation: &mut Evaluation,
        notes: &[String],
        (count, common): (usize, &Common),
    ) -> Result<(), Failure> {
        let mut rows = Vec::new();
        let mut failed = BTreeMap::new();
        for (name, method) in Method::ablation() {
            let settings = Settings { baselines: false, ..self.settings(method, &[count]) };
            let outcome = self.results(evaluation, &settings, name)?;
            failed.extend(outcome.failed);
            rows.push((name, outcome.records));
        }
        let reasons = failed.values().map(evaluate::Error::to_string);
        let notes: Vec<String> = notes.iter().cloned().chain(reasons).collect();
        let settings = self.described(None, &[count]);
        let [settings_file, table_file] = ABLATION_FILES;
        self.write(settings_file, &told::settings(&settings)?)?;
        self.write(table_file, &told::ablation_csv(&rows))?;
        let summary = |records: &Vec<Record>| Summary::of(&records.iter().collect::<Vec<_>>());
        let rows: Vec<_> = rows.iter().map(|(name, records)| (*name, summary(records))).collect();
        self.report(ABLATION, "What each departure from the paper brings", &settings, &notes, |s| {
            report::evaluation::ablation(&rows, s)
        })?;
        if common.json {
            say(&told::ablation_json(&rows, &notes)?);
        } else {
            tell(&notes);
            say(&told::ablation(&rows, self.unit));
        }
        whole(failed.len())
    }
}

/// What the figure has no correspondence model for, if anything.
fn without_correspondence(evaluation: &Evaluation, paths: &[PathBuf]) -> Option<String> {
    if let Some(number) = evaluation.without_correspondence() {
        let path = paths[number].display();
        return Some(format!(
            "there is no correspondence model of draws with {path}: it needs meshes with the same triangles"
        ));
    }
    let others: Vec<&str> = evaluation.not_corresponding().collect();
    let first = others.first()?;
    let rest = others.len() - 1;
    let more = if rest == 0 { String::new() } else { format!(" and {rest} more") };
    Some(format!(
        "the correspondence model leaves out {first}{more}: other triangles than the training shapes'"
    ))
}

/// Fails if some targets did.
fn whole(failed: usize) -> Result<(), Failure> {
    match failed {
        0 => Ok(()),
        1 => Err("a target could not be approximated (see its note); the results are of the others".into()),
        _ => Err(format!(
            "{failed} targets could not be approximated (see the notes); the results are of the others"
        )
        .into()),
    }
}

/// Targets under names that tell them apart.
fn named(targets: Shapes) -> Result<Vec<Target>, Failure> {
    let names = names::of(&targets.paths);
    names.par_iter().zip(targets.meshes).map(|(name, mesh)| Ok(Target::new(name, mesh)?)).collect()
}

fn tell(notes: &[String]) {
    notes.iter().for_each(|note| say(&format!("note            {note}")));
}

/// A setting as text.
fn json(value: &impl serde::Serialize) -> String {
    serde_json::to_string(value).unwrap_or_default().replace('"', "")
}
