//! `lacuna train`.

use super::shapes::{self, Shapes};
use super::{Common, Failure, bar, inputs, say};
use crate::io;
use crate::train::align::{Align, align};
use crate::train::{Settings, train};
use crate::unit;
use lacuna::Model;
use lacuna::format::Unit;
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
    #[arg(long, default_value_t = 127, value_parser = clap::value_parser!(u8).range(1..=127))]
    modes: u8,
    /// Voxels between the nodes of the weight field, 1 to 4 [default: about 10 mm of a face]
    #[arg(long, value_parser = clap::value_parser!(u8).range(1..=4))]
    stride: Option<u8>,
    /// Name of the shape class [default: the name of the first mesh's folder]
    #[arg(long)]
    class: Option<String>,
    /// Unit of the meshes: mm, m, in, um
    #[arg(long, default_value = "mm", value_parser = unit::parse)]
    unit: Unit,
    /// Whether to align the shapes first: auto looks whether they are in one pose already
    #[arg(long, default_value = "auto", value_parser = align_mode)]
    align: Align,
    /// Seed of the alignment's search
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// How training distances are measured: exact, or along lines of sight (for scans and folded meshes)
    #[arg(long, default_value = "exact", value_parser = distances)]
    distances: crate::train::Distances,
}

/// The folder of the first file: what a class is called without a name.
fn folder(paths: &[PathBuf]) -> String {
    let full = paths.first().and_then(|p| p.canonicalize().ok());
    let name = full.as_deref().and_then(Path::parent).and_then(Path::file_name);
    name.map_or("shape".into(), |name| name.to_string_lossy().into_owned())
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

#[derive(serde::Serialize)]
struct Report {
    output: String,
    class: String,
    shapes: usize,
    aligned: bool,
    modes: usize,
    voxels: usize,
    spacing: f32,
    bytes: usize,
    checksum: String,
    seconds: f64,
    notes: Vec<String>,
}

impl Train {
    /// Runs the subcommand.
    pub fn run(&self, common: &Common) -> Result<(), Failure> {
        let start = std::time::Instant::now();
        let settings = self.settings();
        let Shapes { paths, meshes: shapes, mut notes } = shapes::training_set(&self.meshes, &settings)?;
        let settings = Settings { class: self.class.clone().unwrap_or_else(|| folder(&paths)), ..settings };
        let named = |number: usize, message: String| -> Failure {
            format!("{}: {message}", paths.get(number).map_or("?".into(), |p| p.display().to_string())).into()
        };
        let progress = bar(shapes.len() as u64, "aligning");
        let aligned = align(&shapes, self.align, self.seed, &|done, _| progress.set_position(done));
        let aligned = aligned.map_err(|error| match error {
            crate::train::align::Error::NoSurface(n)
            | crate::train::align::Error::NoMatch { number: n, .. } => named(n, error.to_string()),
        })?;
        progress.finish_and_clear();
        // Without having been moved by the automatic alignment they lie together.
        if aligned.moved || self.align == Align::Never {
            notes.extend(shapes::strangers(&aligned.shapes, &paths)?);
        }
        let progress = bar(shapes.len() as u64, "measuring distances");
        let bytes =
            train(&aligned.shapes, &settings, &|done, _| progress.set_position(done)).map_err(|error| {
                match error {
                    crate::train::Error::NoSurface(n) => named(n, error.to_string()),
                    other => other.into(),
                }
            })?;
        progress.finish_and_clear();
        let model = inputs::model(&bytes, Some(&self.output))?;
        io::atomic::write(&self.output, |file| file.write_all(&bytes))?;
        self.tell(common, &model, &bytes, (aligned.moved, notes, start.elapsed().as_secs_f64()));
        Ok(())
    }

    fn settings(&self) -> Settings {
        Settings {
            spacing: self.spacing,
            modes: usize::from(self.modes),
            stride: self.stride,
            unit: self.unit,
            distances: self.distances,
            memory: io::limit::get(),
            ..Settings::default()
        }
    }

    fn tell(
        &self,
        common: &Common,
        model: &Model<'_>,
        bytes: &[u8],
        (aligned, notes, seconds): (bool, Vec<String>, f64),
    ) {
        let header = model.header();
        let report = Report {
            output: self.output.display().to_string(),
            class: header.class.into(),
            shapes: header.shapes as usize,
            aligned,
            modes: model.modes(),
            voxels: model.voxels(),
            spacing: header.spacing,
            bytes: bytes.len(),
            checksum: format!("{:08x}", model.checksum()),
            seconds,
            notes,
        };
        if common.json {
            say(&serde_json::to_string_pretty(&report).unwrap_or_default());
            return;
        }
        report.notes.iter().for_each(|note| say(&format!("note            {note}")));
        let pose = if aligned { "aligned to each other" } else { "in one pose already, left as they are" };
        say(&format!("shapes          {} of class {}, {pose}", report.shapes, report.class));
        let symbol = unit::symbol(header.unit);
        say(&format!(
            "model           {} modes, {} voxels of {} {symbol}",
            report.modes, report.voxels, report.spacing
        ));
        say(&format!(
            "file            {} ({:.2} MiB, {seconds:.1} s)",
            report.output,
            bytes.len() as f64 / 1048576.0
        ));
    }
}
