//! `lacuna inspect`.

use super::outputs::{self, Output};
use super::scatter::Scatter;
use super::trained::expected_error;
use super::{Common, Failure, inputs, say};
use crate::quantile::quantile;
use crate::sentence::sentence;
use crate::train::jitter::Apart;
use crate::unit::{digits, four_digits};
use crate::{io, modes, unit};
use lacuna::format::{Calibration, Header, MAX_MODES, Symmetry};
use lacuna::{Fixed, Model, Schedule, Sizes};
use std::path::PathBuf;

/// Show what a model holds and what memory its fit needs.
#[derive(clap::Args)]
pub struct Inspect {
    /// The shape model [default: the built-in one]
    model: Option<PathBuf>,
    /// Draw the first modes from -3 to +3 standard deviations
    #[arg(long, value_name = "PNG")]
    modes: Option<PathBuf>,
    /// How many modes to draw
    #[arg(long, default_value_t = 4, value_name = "N", requires = "modes", value_parser = clap::value_parser!(u8).range(1..=i64::from(MAX_MODES)))]
    first: u8,
    /// Also write the sizes of a fit's buffers as constants for the statics of a firmware
    #[arg(long, value_name = "FILE")]
    rust: Option<PathBuf>,
}

/// The sizes of a fit's buffers as a Rust file.
fn constants(model: &Model<'_>) -> Result<String, Failure> {
    let schedule = Schedule::of(model);
    let sizes = Sizes::required(model, &schedule).map_err(|error| sentence("the model", &error))?;
    let head = format!("// Elements of the buffers of a fit with the model {:08x}.\n", model.checksum());
    let lines = sizes.named().map(|(name, size)| format!("pub const {name}: usize = {size};\n"));
    Ok(head + &lines.concat())
}

/// Width and height of a drawn mode, pixels.
const PANEL: [usize; 2] = [240, 280];

#[derive(serde::Serialize)]
struct Report<'a> {
    class: &'a str,
    made: &'a str,
    format_version: u16,
    checksum: String,
    bytes: usize,
    shapes: u32,
    modes: usize,
    explained: f32,
    spacing: f32,
    unit: &'static str,
    origin: [f32; 3],
    sides: [u16; 3],
    brick: u8,
    bricks: u16,
    voxels: u32,
    stride: u8,
    node_distance: f32,
    active_nodes: usize,
    /// The plane the class is symmetric about, in the frame and unit of the training shapes.
    symmetry: Option<Plane>,
    /// How far the training shapes lay from their pose in the model, if they were drawn to it.
    jitter: Option<Scatter>,
    hull_front: f32,
    hull_behind: f32,
    deviations: Vec<f32>,
    fit_bytes: usize,
    fit_bytes_with_momentum: usize,
    pose_bytes: usize,
    calibration: Option<&'a Calibration>,
    /// Factors of the expected error in the bricks, of which a tenth is below and a tenth above.
    factors: Option<[f32; 2]>,
}

#[derive(serde::Serialize)]
struct Plane {
    normal: [f32; 3],
    offset: f32,
    deviation: f32,
}

impl Inspect {
    /// Runs the subcommand.
    pub fn run(&self, common: &Common) -> Result<(), Failure> {
        let written = [("--modes", &self.modes, "png"), ("--rust", &self.rust, "rs")];
        let written = written
            .iter()
            .filter_map(|&(option, path, format)| Some(Output { option, path: path.as_deref()?, format }));
        outputs::check(self.model.as_slice(), &written.collect::<Vec<_>>())?;
        let bytes = inputs::model_bytes(self.model.as_deref())?;
        let name = inputs::model_name(self.model.as_deref());
        let model = inputs::any_model(&bytes, &name)?;
        inputs::within_memory(&model, &name)?;
        let report = report(&model, bytes.len())?;
        if let Some(path) = &self.modes {
            let png = modes::draw(&model, usize::from(self.first), PANEL[0], PANEL[1]).png()?;
            io::atomic::write(path, |file| file.write_all(&png))?;
        }
        if let Some(path) = &self.rust {
            let text = constants(&model)?;
            io::atomic::write(path, |file| file.write_all(text.as_bytes()))?;
        }
        if common.json {
            say(&serde_json::to_string_pretty(&report)?);
        } else {
            tell(&report);
            self.modes.iter().for_each(|path| say(&format!("picture         {}", path.display())));
            self.rust.iter().for_each(|path| say(&format!("constants       {}", path.display())));
        }
        Ok(())
    }
}

/// The factor that a tenth of the bricks is below, and the one that a tenth is above.
fn factors(model: &Model<'_>) -> Option<[f32; 2]> {
    let bricks = 0..usize::from(model.header().bricks);
    let mut factors: Vec<f64> = bricks.filter_map(|index| model.factor(index)).map(f64::from).collect();
    factors.sort_by(f64::total_cmp);
    Some([quantile(&factors, 0.1)? as f32, quantile(&factors, 0.9)? as f32])
}

fn report<'a>(model: &'a Model<'_>, bytes: usize) -> Result<Report<'a>, Failure> {
    let h = model.header();
    let required =
        |schedule| Sizes::required(model, &schedule).map_err(|error| sentence("the model", &error));
    let sizes = required(Schedule::of(model))?;
    let modes = model.modes();
    Ok(Report {
        class: h.class,
        made: h.made,
        format_version: model.version(),
        checksum: format!("{:08x}", model.checksum()),
        bytes,
        shapes: h.shapes,
        modes,
        explained: h.explained,
        spacing: h.spacing,
        unit: unit::symbol(h.unit),
        origin: h.origin,
        sides: h.sides,
        brick: h.brick,
        bricks: h.bricks,
        voxels: h.voxels,
        stride: h.stride,
        node_distance: f32::from(h.stride) * h.spacing,
        active_nodes: sizes.reciprocals,
        symmetry: model.symmetry().map(|plane| in_frame(plane, h)),
        jitter: model.jitter().map(|jitter| Scatter::from(Apart::of(jitter, h.spacing))),
        hull_front: h.scales.front * h.spacing,
        hull_behind: h.scales.behind * h.spacing,
        deviations: (0..modes).map(|k| model.deviation(k) * h.spacing).collect(),
        fit_bytes: sizes.bytes::<Fixed>(),
        fit_bytes_with_momentum: required(Schedule::with_momentum(model))?.bytes::<Fixed>(),
        pose_bytes: sizes.pose_bytes(),
        calibration: model.calibration(),
        factors: factors(model),
    })
}

/// A plane in the frame and unit of the training shapes.
fn in_frame(plane: &Symmetry, header: &Header<'_>) -> Plane {
    let origin: f32 = plane.normal.iter().zip(header.origin).map(|(n, o)| n * o).sum();
    Plane {
        normal: plane.normal,
        offset: plane.offset * header.spacing + origin,
        deviation: plane.deviation * header.spacing,
    }
}

fn tell(r: &Report<'_>) {
    tell_file(r);
    tell_grid(r);
    tell_class(r);
    let kib = |bytes: usize| bytes as f64 / 1024.0;
    say(&format!(
        "fit memory      {:.0} KiB ({:.0} with momentum), pose {:.1} KiB",
        kib(r.fit_bytes),
        kib(r.fit_bytes_with_momentum),
        kib(r.pose_bytes)
    ));
    let deviations: Vec<String> = r.deviations.iter().map(|&d| digits(d.into(), 2)).collect();
    say(&format!("deviations      {} {} rms", deviations.join(" "), r.unit));
    say(&expected_error(r.calibration));
    if let Some([low, high]) = r.factors {
        say(&format!("                {low:.2} to {high:.2} times as large from place to place"));
    }
}

/// What was trained, and the file it is in.
fn tell_file(r: &Report<'_>) {
    say(&format!(
        "class           {}, {} shapes, {} modes ({:.1} % of the variance)",
        r.class,
        r.shapes,
        r.modes,
        100.0 * r.explained
    ));
    say(&format!("made            {}", r.made));
    say(&format!(
        "file            {:.2} MiB, format version {}, checksum {}",
        r.bytes as f64 / 1048576.0,
        r.format_version,
        r.checksum
    ));
}

/// Voxels, nodes and hull.
fn tell_grid(r: &Report<'_>) {
    let [x, y, z] = r.sides;
    say(&format!(
        "grid            {x} x {y} x {z} voxels of {} {}, {} stored in {} bricks",
        four_digits(r.spacing.into()),
        r.unit,
        r.voxels,
        r.bricks
    ));
    say(&format!(
        "weight nodes    every {} voxels ({} {}), {} active",
        r.stride,
        digits(r.node_distance.into(), 1),
        r.unit,
        r.active_nodes
    ));
    let [front, behind] = [r.hull_front, r.hull_behind].map(|depth| digits(depth.into(), 1));
    say(&format!("hull            {front} {} in front, {behind} behind", r.unit));
}

/// What the class has besides its shape.
fn tell_class(r: &Report<'_>) {
    if let Some(Plane { normal: [x, y, z], offset, deviation }) = r.symmetry {
        let (offset, deviation) = (digits(offset.into(), 1), digits(deviation.into(), 2));
        say(&format!(
            "symmetry        {x:.3} x + {y:.3} y + {z:.3} z = {offset} {}, mirror images lie {deviation} off",
            r.unit
        ));
    }
    if let Some(jitter) = r.jitter {
        say(&format!("poses           shapes were moved by {}", jitter.sentence(r.unit)));
    }
}
