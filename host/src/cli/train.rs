//! `lacuna train`.

use super::outputs::{self, Output, Usage};
use super::shapes::{self, Shapes};
use super::trained::{Made, Report};
use super::{Common, Failure, bar, inputs, say};
use crate::class;
use crate::io;
use crate::mesh::Mesh;
use crate::quantile::median;
use crate::sentence::sentence;
use crate::train::align::Align;
use crate::train::calibration::{Trained, train_calibrated};
use crate::train::held_out::{FEWEST, HeldOut};
use crate::train::leave_one_out::{self, Row};
use crate::train::{Footprint, Limits, Settings, strangers};
use crate::{size, unit};
use lacuna::Model;
use lacuna::format::{MAX_MODES, Unit};
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Train a shape model on meshes of one class.
#[derive(clap::Args)]
pub struct Train {
    /// Meshes, or folders of meshes: PLY, OBJ, STL
    #[arg(required = true)]
    meshes: Vec<PathBuf>,
    /// Where the model goes
    #[arg(short, long)]
    output: PathBuf,
    /// Voxel edge in the meshes' unit [default: 60 to 90 voxels along the longest side]
    #[arg(long, value_parser = positive)]
    spacing: Option<f64>,
    /// Most modes to keep [default: one less than the shapes]
    #[arg(long, value_parser = clap::value_parser!(u8).range(1..=i64::from(MAX_MODES)))]
    modes: Option<u8>,
    /// Largest model file: bytes, or with K, M or G (1.5M); unless they are given, spacing and modes are chosen for it
    #[arg(long, value_name = "BYTES", value_parser = io::limit::parse)]
    flash: Option<u64>,
    /// Largest memory of the fit without momentum: bytes, or with K, M or G, chosen for likewise; the scan's points, 12 bytes
    /// each, come on top
    #[arg(long, value_name = "BYTES", value_parser = io::limit::parse)]
    ram: Option<u64>,
    /// Voxels between the nodes of the weight field, 1 to 4 [default: about 10 mm of a face]
    #[arg(long, value_parser = clap::value_parser!(u8).range(1..=4))]
    stride: Option<u8>,
    /// Name of the shape class, 64 bytes at most [default: the name of the first mesh's folder]
    #[arg(long, value_parser = class)]
    class: Option<String>,
    /// Unit of the meshes: mm, m, in, um
    #[arg(long, default_value = "mm", value_parser = unit::parse)]
    unit: Unit,
    /// How shapes come into one pose: auto searches if they do not lie in one and then draws them to their mean; always; never
    #[arg(long, default_value = "auto", value_parser = align_mode)]
    align: Align,
    /// Seed of the alignment's search
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// The class is symmetric about a plane: find it, and let scans of one side help with the other
    #[arg(long)]
    symmetric: bool,
    /// How training distances are measured: exact, or along lines of sight (for scans and folded meshes)
    #[arg(long, default_value = "exact", value_parser = distances)]
    distances: crate::train::Distances,
    /// Complete every shape by the model of the others, from partial scans of it in a pose that is known roughly, and show how
    /// far off its unseen part comes out; the expected errors are calibrated by these completions
    #[arg(long)]
    leave_one_out: bool,
    /// Leave out several shapes at a time, so that only this many other models are trained
    #[arg(long, value_name = "N", requires = "leave_one_out", value_parser = clap::value_parser!(u16).range(2..))]
    folds: Option<u16>,
    /// Hold back no shapes to calibrate the expected errors of completed surfaces: faster, and not with --leave-one-out
    #[arg(long, conflicts_with_all = ["leave_one_out", "folds"])]
    no_calibration: bool,
}

/// The folder of the first file: what a class is called without a name.
fn folder(paths: &[PathBuf]) -> String {
    let full = paths.first().and_then(|p| p.canonicalize().ok());
    let name = full.as_deref().and_then(Path::parent).and_then(Path::file_name);
    let name = name.map_or("shape".into(), |name| name.to_string_lossy());
    cut(&name).into()
}

/// As much of a name as a class's may have.
fn cut(name: &str) -> &str {
    let mut ends = (0..=LONGEST.min(name.len())).rev();
    let end = ends.find(|&end| name.is_char_boundary(end));
    &name[..end.unwrap_or(0)]
}

/// Bytes of a class's name, at most.
const LONGEST: usize = 64;

fn class(text: &str) -> Result<String, String> {
    if (1..=LONGEST).contains(&text.len()) {
        Ok(text.into())
    } else {
        Err(format!("use 1 to {LONGEST} bytes"))
    }
}

pub(super) fn positive(text: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|_| "not a number".to_owned())?;
    if value.is_finite() && value > 0.0 { Ok(value) } else { Err("must be positive".into()) }
}

pub(super) fn align_mode(text: &str) -> Result<Align, String> {
    match text {
        "auto" => Ok(Align::Auto),
        "always" => Ok(Align::Always),
        "never" => Ok(Align::Never),
        _ => Err("use auto, always or never".into()),
    }
}

fn distances(text: &str) -> Result<crate::train::Distances, String> {
    match text {
        "exact" => Ok(crate::train::Distances::Exact),
        "sight" => Ok(crate::train::Distances::Sight),
        _ => Err("use exact or sight".into()),
    }
}

impl Train {
    /// Runs the subcommand.
    pub fn run(&self, common: &Common) -> Result<(), Failure> {
        let start = std::time::Instant::now();
        let settings = self.settings();
        let output = [Output { option: "--output", path: &self.output, format: "lacuna" }];
        outputs::check(&self.meshes, &output)?;
        let Shapes { paths, meshes: shapes, mut notes } = shapes::training_set(&self.meshes, &settings)?;
        outputs::apart(&paths, &output)?;
        if self.leave_one_out && shapes.len() < FEWEST {
            let text = format!("--leave-one-out needs {FEWEST} shapes or more, here are {}", shapes.len());
            return Err(Usage(text).into());
        }
        let settings = Settings { class: self.class.clone().unwrap_or_else(|| folder(&paths)), ..settings };
        let aligned = shapes::aligned(&shapes, &paths, (self.align, self.seed))?;
        notes.extend(shapes::lay(&aligned, &paths, settings.unit));
        let settings = Settings { apart: aligned.way.apart(), ..settings };
        let trained = self.train(&aligned.shapes, &settings).map_err(|error| match error {
            crate::train::Error::NoSurface(n) => shapes::named(&paths, n, &error),
            other => other.into(),
        })?;
        let model = inputs::any_model(&trained.file, &inputs::model_name(Some(&self.output)))?;
        notes.extend(coarse(&model, &aligned.shapes));
        notes.extend(grown(&model));
        notes.extend(torn(&model, &aligned.shapes, &paths, settings.unit)?);
        io::atomic::write(&self.output, |file| file.write_all(&trained.file))?;
        let rows = table(&trained, &paths);
        let seconds = start.elapsed().as_secs_f64();
        let output = self.output.display().to_string();
        let Footprint { flash, ram } =
            Footprint::of(&trained.file).map_err(|error| sentence("the model", &error))?;
        let made = Made { output, flash, ram, choice: trained.choice, way: aligned.way, notes, seconds };
        let report = Report::new(&model, made, rows, self.leave_one_out);
        if common.json {
            say(&serde_json::to_string_pretty(&report)?);
        } else {
            report.lines(unit::symbol(model.header().unit)).iter().for_each(|line| say(line));
        }
        Ok(())
    }

    fn train(&self, shapes: &[Mesh], settings: &Settings) -> Result<Trained, crate::train::Error> {
        let each = HeldOut { folds: self.folds.map_or(usize::MAX, usize::from), ..HeldOut::EACH };
        let held = match (self.leave_one_out, self.no_calibration) {
            (true, _) => each,
            (false, true) => HeldOut { shapes: 0, folds: 0 },
            (false, false) => HeldOut::SOME,
        };
        let (measured, completed) = (bar(shapes.len() as u64, "measuring distances"), bar(1, "calibrating"));
        let measuring = |done, _| measured.set_position(done);
        let completing = |done, total| {
            completed.set_length(total);
            completed.set_position(done);
        };
        let trained = train_calibrated(shapes, settings, held, [&measuring, &completing]);
        measured.finish_and_clear();
        completed.finish_and_clear();
        trained
    }

    fn settings(&self) -> Settings {
        Settings {
            spacing: self.spacing,
            modes: self.modes.map(usize::from),
            stride: self.stride,
            unit: self.unit,
            distances: self.distances,
            symmetric: self.symmetric,
            memory: io::limit::get(),
            limits: Limits { flash: self.flash, ram: self.ram },
            ..Settings::default()
        }
    }
}

/// Voxels along the shapes' longest side below which that is told: a vertebra of 7 explained a quarter of the next one, heads
/// of 16 come out as heads.
const FEWEST_VOXELS: f64 = 12.0;

/// What is said of a model whose voxels are that coarse.
fn coarse(model: &Model<'_>, shapes: &[Mesh]) -> Option<String> {
    let longest = median(shapes.iter().map(size::of_mesh).collect())?;
    let voxels = longest / f64::from(model.header().spacing);
    (voxels < FEWEST_VOXELS).then(|| {
        format!(
            "the shapes are {voxels:.0} voxels long: parts thinner than two are lost; choose a smaller --spacing, or allow \
             more flash and RAM"
        )
    })
}

/// Roots of the mean shape's area in terms of the shapes' that nothing is said of: 0.94 to 1.03 in models of all kinds of
/// classes.
const USUAL_GROWTH: Range<f64> = 0.8..1.2;

/// What is said of a model whose mean has a surface where the shapes have none, or hardly one.
fn grown(model: &Model<'_>) -> Option<String> {
    let growth = class::mean_growth(model);
    (!USUAL_GROWTH.contains(&growth)).then(|| {
        format!(
            "the mean shape has {:.1} times the area of the shapes: they do not lie in one pose, or their rims end at \
             different places; look at it with `inspect --modes`, search for their poses with --align always, or give them in one \
             with --align never",
            growth * growth
        )
    })
}

/// First modes, in terms of the shapes' length, that nothing is said of. Bottles are at 0.02, faces, feet, vertebrae and ears at
/// 0.04 or less, mugs at 0.05; a mug or a bottle among feet is at 0.16, two
/// bottles, one half as slender again as the other, are at 0.12.
const USUAL_MODE: f64 = 0.08;

/// What is said of a model whose first mode is far beyond what shapes of a class differ by.
fn torn(
    model: &Model<'_>,
    shapes: &[Mesh],
    paths: &[PathBuf],
    unit: Unit,
) -> Result<Option<String>, Failure> {
    let deviation = |k: usize| f64::from(model.deviation(k) * model.header().spacing);
    let longest = median(shapes.iter().map(size::of_mesh).collect()).unwrap_or(f64::INFINITY);
    if model.modes() == 0 || deviation(0) <= USUAL_MODE * longest {
        return Ok(None);
    }
    let times =
        (model.modes() > 1).then(|| format!(", {:.0} times the second one", deviation(0) / deviation(1)));
    let farthest = strangers::farthest(shapes)?.map(|number| shapes::name(paths, number));
    Ok(Some(format!(
        "the first mode moves the surface by {} {}{}: shapes lie in different poses, or are not of one class{}; look at it \
         with `inspect --modes`",
        unit::digits(deviation(0), 2),
        unit::symbol(unit),
        times.unwrap_or_default(),
        farthest.map(|name| format!(" (least of {name} lies where others do)")).unwrap_or_default(),
    )))
}

/// How well the shapes that were held back came out, scan by scan.
fn table(trained: &Trained, paths: &[PathBuf]) -> Vec<Row> {
    let name = |path: &PathBuf| path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let names: Vec<String> = paths.iter().map(name).collect();
    leave_one_out::rows(&trained.held, &trained.trials, &names, &trained.shares)
}

#[cfg(test)]
mod tests {
    use super::{LONGEST, class, cut};

    #[test]
    fn a_folders_name_is_cut_to_that_of_a_class() {
        assert_eq!(cut("faces"), "faces");
        let long = cut(&"ä".repeat(70)).to_owned();
        assert_eq!((long.len(), class(&long)), (LONGEST, Ok(long)));
        assert_eq!(cut(&format!("x{}", "ä".repeat(70))).len(), LONGEST - 1);
    }
}
