//! `lacuna synth`.

use super::outputs::{self, Output};
use super::{Common, Failure, bar, say};
use crate::depth_view::DepthView;
use crate::io::{self, PlyOut};
use crate::mesh::Mesh;
use crate::synth::{Head, Kind, Scan, ScannerSettings, Surrounding, scan_among};
use clap::{Args, Subcommand, ValueEnum};
use nalgebra::Matrix4;
use rayon::prelude::*;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// What the scanner can see.
const SCANNABLE: &str = "it wants a mesh in millimetres, some decimetres large at most, its front towards +z and its \
                         triangles counter-clockwise from outside";

/// What the description of a scan says of who made it.
const MAKER: &str = "lacuna synth";

/// Make heads and scans of the built-in shape class.
#[derive(Args)]
pub struct Synth {
    #[command(subcommand)]
    what: What,
}

#[derive(Subcommand)]
enum What {
    /// Heads as training meshes: head_000.ply, head_001.ply, ...
    Heads(Heads),
    /// A simulated scan of a head or of a mesh of yours, with its truth
    Scan(OneScan),
}

#[derive(Args)]
struct Heads {
    /// The folder they go to; made if it does not exist
    folder: PathBuf,
    /// How many
    #[arg(short, long, default_value_t = 30, value_parser = clap::value_parser!(u64).range(1..=10_000))]
    count: u64,
    /// Seed of the class
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Number of the first head
    #[arg(long, default_value_t = 0, value_parser = clap::value_parser!(u64).range(..=1_000_000_000))]
    first: u64,
    /// Smooth relief that no parameter makes, mm rms, at most 3
    #[arg(long, default_value_t = 0.0, value_parser = |text: &str| millimetres(text, 3.0), allow_negative_numbers = true)]
    relief: f64,
}

#[derive(Args)]
struct OneScan {
    /// The folder it goes to; made if it does not exist
    folder: PathBuf,
    /// From where
    #[arg(long, value_enum, default_value_t = From::Front)]
    view: From,
    /// Seed of the class
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Number of the head
    #[arg(long, default_value_t = 1000)]
    head: u64,
    /// Scan this mesh instead of a head: millimetres, y up, its front towards +z, as large as a head or so
    #[arg(long, conflicts_with_all = ["seed", "head"])]
    mesh: Option<PathBuf>,
    /// Seed of the scanner: pose, drop-outs, noise
    #[arg(long, default_value_t = 1)]
    scan_seed: u64,
    /// 320 x 240 pixels instead of 640 x 480
    #[arg(long)]
    small: bool,
    /// Deviation of the noise that each pixel has of its own, mm, at most 10
    #[arg(long, default_value_t = ScannerSettings::default().noise_mm, value_parser = |text: &str| millimetres(text, 10.0), allow_negative_numbers = true)]
    noise: f64,
    /// What is scanned along with it, separated by commas
    #[arg(long, value_enum, value_delimiter = ',')]
    with: Vec<With>,
}

#[derive(Clone, Copy, ValueEnum, serde::Serialize)]
#[serde(rename_all = "lowercase")]
enum With {
    Hair,
    Collar,
    Table,
}

impl With {
    const fn surrounding(self) -> Surrounding {
        match self {
            Self::Hair => Surrounding::Hair,
            Self::Collar => Surrounding::Collar,
            Self::Table => Surrounding::Table,
        }
    }
}

fn millimetres(text: &str, most: f64) -> Result<f64, String> {
    let length: f64 = text.parse().map_err(|_| "not a number".to_owned())?;
    if (0.0..=most).contains(&length) { Ok(length) } else { Err(format!("from 0 to {most} mm")) }
}

#[derive(Clone, Copy, ValueEnum)]
enum From {
    Front,
    Side,
    Stitched,
}

impl Synth {
    /// Runs the subcommand.
    pub fn run(&self, common: &Common) -> Result<(), Failure> {
        match &self.what {
            What::Heads(args) => args.run(common),
            What::Scan(args) => args.run(common),
        }
    }
}

fn make_folder(folder: &Path) -> Result<(), Failure> {
    std::fs::create_dir_all(folder)
        .map_err(|error| format!("cannot make the folder {}: {error}", folder.display()).into())
}

impl Heads {
    fn run(&self, common: &Common) -> Result<(), Failure> {
        make_folder(&self.folder)?;
        let progress = bar(self.count, "making heads");
        let numbers: Vec<u64> = (self.first..self.first + self.count).collect();
        numbers.par_iter().try_for_each(|&number| -> Result<(), Failure> {
            let head = Head::sample(self.seed, number);
            let head = if self.relief > 0.0 { head.with_relief(self.relief, number) } else { head };
            let path = self.folder.join(format!("head_{number:03}.ply"));
            io::write_ply(&path, &PlyOut::new(&head.mesh()))?;
            progress.inc(1);
            Ok(())
        })?;
        progress.finish_and_clear();
        if common.json {
            say(&json!({ "folder": self.folder.display().to_string(), "heads": self.count }).to_string());
        } else {
            say(&format!("{} heads in {}", self.count, self.folder.display()));
        }
        Ok(())
    }
}

impl OneScan {
    fn run(&self, common: &Common) -> Result<(), Failure> {
        self.check_outputs()?;
        let truth = match &self.mesh {
            Some(path) => io::read(path)?,
            None => Head::sample(self.seed, self.head).mesh(),
        };
        let kind = match self.view {
            From::Front => Kind::Front,
            From::Side => Kind::Side,
            From::Stitched => Kind::Stitched,
        };
        let scanner = if self.small { ScannerSettings::small() } else { ScannerSettings::default() };
        let settings = ScannerSettings { noise_mm: self.noise, ..scanner };
        let scan = scan_among(&truth, &self.others(&truth), kind, &settings, self.scan_seed);
        if scan.missing.iter().all(|&missing| missing) {
            return Err(format!("the scanner sees nothing of {}: {SCANNABLE}", self.name()).into());
        }
        make_folder(&self.folder)?;
        let info = self.write(&truth, &scan)?;
        if common.json {
            say(&info.to_string());
        } else {
            let (points, folder) = (scan.points.points.len(), self.folder.display());
            let missing = 100.0 * missing_share(&scan);
            say(&format!("{points} points in {folder}, {missing:.0} % of the vertices missing"));
        }
        Ok(())
    }

    /// Refuses a folder whose files would overwrite the mesh that is scanned, or a scan of something else's.
    fn check_outputs(&self) -> Result<(), Failure> {
        let paths = ["truth.ply", "mesh.ply", "points.ply"].map(|name| self.folder.join(name));
        let files = paths.each_ref().map(|path| Output { option: "the file", path, format: "ply" });
        outputs::apart(self.mesh.as_slice(), &files)?;
        let description = self.folder.join("scan.json");
        let written = ["gt_missing.u8".into(), depth_name(0, 1)]
            .into_iter()
            .chain((0..VIEWS).map(|n| depth_name(n, VIEWS)));
        let others = written.map(|name| self.folder.join(name));
        let there = paths.iter().cloned().chain(others).find(|path| path.exists() && !description.exists());
        let told = there.unwrap_or(description);
        outputs::own(&told, &format!("\"made_by\": \"{MAKER}\""), "name another folder")
    }

    /// What is around it.
    fn others(&self, truth: &Mesh) -> Mesh {
        let Some(bounds) = truth.bounds() else { return Mesh::default() };
        Surrounding::meshes(self.with.iter().map(|with| with.surrounding()), bounds, self.scan_seed)
    }

    /// What is scanned.
    fn name(&self) -> String {
        match &self.mesh {
            Some(path) => path.display().to_string(),
            None => format!("head {} of seed {}", self.head, self.seed),
        }
    }

    /// Where the truth is from the folder above, as in a set of scans that share theirs.
    fn truth_path(&self) -> String {
        let folder = self.folder.canonicalize().unwrap_or_else(|_| self.folder.clone());
        let name = folder.file_name().unwrap_or_default();
        Path::new(name).join("truth.ply").display().to_string()
    }

    fn write(&self, truth: &Mesh, scan: &Scan) -> Result<Value, Failure> {
        // First, for it tells whose files the others are.
        let info = self.info(scan);
        let text = serde_json::to_vec_pretty(&info)?;
        io::atomic::write(&self.folder.join("scan.json"), |file| file.write_all(&text))?;
        let write = |name: &str, mesh: &Mesh| io::write_ply(&self.folder.join(name), &PlyOut::new(mesh));
        write("truth.ply", truth)?;
        write("mesh.ply", &scan.mesh)?;
        write("points.ply", &scan.points)?;
        let missing: Vec<u8> = scan.missing.iter().map(|&m| u8::from(m)).collect();
        io::atomic::write(&self.folder.join("gt_missing.u8"), |file| file.write_all(&missing))?;
        for (number, view) in scan.views.iter().enumerate() {
            let png = depth_png(view)?;
            let path = self.folder.join(depth_name(number, scan.views.len()));
            io::atomic::write(&path, |file| file.write_all(&png))?;
        }
        Ok(info)
    }

    /// What is told of a scan.
    fn info(&self, scan: &Scan) -> Value {
        let view = |(number, view): (usize, &DepthView)| {
            let name = depth_name(number, scan.views.len());
            json!({ "depth": name, "camera_to_scan": rows(&view.camera_to_scan) })
        };
        let views: Vec<Value> = scan.views.iter().enumerate().map(view).collect();
        let inverse = scan.model_to_scan.try_inverse().unwrap_or_else(Matrix4::identity);
        let camera = scan.views.first().map(|view| {
            json!({
                "width": view.width, "height": view.height,
                "fx": view.fx, "fy": view.fy, "cx": view.cx, "cy": view.cy,
                "depth_unit_mm": view.unit_mm,
            })
        });
        json!({
            "made_by": MAKER,
            "name": self.name(),
            "ground_truth_mesh": self.truth_path(),
            "camera": camera,
            "views": views,
            "points": scan.points.points.len(),
            "missing_share": missing_share(scan),
            "with": self.with,
            "truth": { "model_to_scan": rows(&scan.model_to_scan), "scan_to_model": rows(&inverse) },
        })
    }
}

/// Most views of a scan.
const VIEWS: usize = 3;

/// What the depth image of a view is called, one of `views`.
fn depth_name(number: usize, views: usize) -> String {
    if views == 1 { "depth.png".into() } else { format!("depth_{number}.png") }
}

/// Share of the truth's vertices that the scanner has not seen.
fn missing_share(scan: &Scan) -> f64 {
    scan.missing.iter().filter(|&&missing| missing).count() as f64 / scan.missing.len() as f64
}

fn rows(matrix: &Matrix4<f64>) -> Vec<Vec<f64>> {
    matrix.row_iter().map(|row| row.iter().copied().collect()).collect()
}

fn depth_png(view: &DepthView) -> Result<Vec<u8>, Failure> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, view.width as u32, view.height as u32);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(png::BitDepth::Sixteen);
    let mut writer = encoder.write_header()?;
    let data: Vec<u8> = view.depth.iter().flat_map(|d| d.to_be_bytes()).collect();
    writer.write_image_data(&data)?;
    writer.finish()?;
    Ok(bytes)
}
