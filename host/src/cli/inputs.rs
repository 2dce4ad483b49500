//! What several subcommands read: models, scans, units, poses.

use super::outputs::Usage;
use super::{Failure, outputs};
use crate::check;
use crate::check::alternatives::Alternative;
use crate::class;
use crate::complete::depth_rows::DepthImage;
use crate::complete::zero_level;
use crate::io::{self, Loaded};
use crate::mesh::{Mesh, Point};
use crate::register::Placed;
use crate::sentence::sentence;
use crate::similarity::scale_and_rotation;
use crate::{report, size, unit};
use lacuna::Model;
use lacuna::format::Unit;
use nalgebra::Matrix4;
use std::fmt;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// A scan and the model it belongs to, as `complete` and `register` take them.
#[derive(clap::Args)]
pub struct Subject {
    /// The scan: PLY, OBJ, STL, PCD, XYZ, depth PNG, scan.json, or a folder with one [default: the example scan]
    pub scan: Option<PathBuf>,
    /// The shape model [default: the built-in one]
    #[arg(short, long)]
    pub model: Option<PathBuf>,
    /// Unit of the scan, if it is not the model's: mm, m, in, um
    #[arg(long, value_parser = unit::parse)]
    unit: Option<Unit>,
    /// Turn the scan's triangles or normals round: for scans that face inwards
    #[arg(long)]
    flip: bool,
    /// Seed of the search for the pose
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
}

impl Subject {
    /// The bytes of the model.
    pub fn model_bytes(&self) -> Result<Vec<u8>, Failure> {
        model_bytes(self.model.as_deref())
    }

    /// The model in these bytes.
    pub fn model<'a>(&self, bytes: &'a [u8]) -> Result<Model<'a>, Failure> {
        model(bytes, self.model.as_deref())
    }

    /// Unit of the scan.
    pub fn unit(&self, model: &Model<'_>) -> Unit {
        self.unit.unwrap_or(model.header().unit)
    }

    /// Model units a unit of the scan.
    pub fn factor(&self, model: &Model<'_>) -> f64 {
        unit::millimetres(self.unit(model)) / unit::millimetres(model.header().unit)
    }

    /// The scan in the model's unit, checked and repaired, and what was found.
    pub fn mesh(&self, model: &Model<'_>) -> Result<(Mesh, Vec<String>), Failure> {
        let Loaded { mesh, repairs } = scan(self.scan.as_deref())?;
        let mut mesh = scaled(mesh, self.factor(model));
        let mut notes = Vec::new();
        // The check would turn it outwards again, and tell that as if the file had been inside out.
        if self.flip && check::encloses(&mesh) {
            notes.push("--flip was left out: the surface is closed and faces outwards already".into());
        } else if self.flip {
            mesh = Alternative::Flipped.of(&mesh);
        }
        let (mesh, found) = usable(self.scan.as_deref(), Loaded { mesh, repairs }, model, self.unit(model))?;
        notes.extend(found);
        Ok((mesh, notes))
    }

    /// The scan as the one depth image that it is.
    pub fn depth_image(&self, model: &Model<'_>) -> Result<DepthImage, Failure> {
        let path = self.scan.as_deref().filter(|path| io::depth::is_depth(path));
        let Some(path) = path else {
            return Err(Usage("--depth-rows goes with a depth PNG or a scan.json".into()).into());
        };
        if self.flip {
            return Err(
                Usage("--flip does not go with --depth-rows: depth images face their camera".into()).into()
            );
        }
        let mut views = io::depth::read(path)?;
        let [view] = views.as_mut_slice() else {
            let (path, number) = (path.display(), views.len());
            return Err(
                format!("{path} has {number} views, --depth-rows takes one: name its PNG file").into()
            );
        };
        // As for its mesh, which the pose is found for.
        view.fill_gaps();
        DepthImage::new(view, self.factor(model)).map_err(|what| format!("{}: {what}", path.display()).into())
    }

    /// The files that are read.
    pub fn files(&self) -> Vec<PathBuf> {
        let scan = self.scan.iter().flat_map(|path| match io::depth::is_depth(path) {
            true => io::depth::files(path),
            false => vec![path.clone()],
        });
        scan.chain(self.model.clone()).collect()
    }

    /// What the scan is called in reports.
    pub fn name(&self) -> String {
        self.scan.as_ref().map_or("example".into(), |path| path.display().to_string())
    }

    /// An error with the scan it belongs to.
    pub fn named(&self, error: &dyn fmt::Display) -> Failure {
        named(self.scan.as_deref(), error)
    }
}

/// An error with the scan it belongs to.
pub fn named(path: Option<&Path>, error: &dyn fmt::Display) -> Failure {
    let name = path.map_or("the example scan".into(), |path| path.display().to_string());
    format!("{name}: {error}").into()
}

/// A scan in the model's unit, taken to be in `unit`, checked and repaired, and what was found.
fn usable(
    path: Option<&Path>,
    scan: Loaded,
    model: &Model<'_>,
    unit: Unit,
) -> Result<(Mesh, Vec<String>), Failure> {
    check::scan(scan, model, unit).usable().map_err(|refused| named(path, &refused))
}

/// A scan in the model's unit from a file, or the example scan, as [`Subject::mesh`] has it.
pub fn usable_scan(path: Option<&Path>, model: &Model<'_>) -> Result<Mesh, Failure> {
    Ok(usable(path, scan(path)?, model, model.header().unit)?.0)
}

/// The bytes of a model file, or of the built-in model.
pub fn model_bytes(path: Option<&Path>) -> Result<Vec<u8>, Failure> {
    let Some(path) = path else { return Ok(lacuna_fixtures::MODEL.to_vec()) };
    Ok(io::limit::load(path, 1)?)
}

/// What a model is called in messages.
pub fn model_name(path: Option<&Path>) -> String {
    path.map_or("the built-in model".into(), |path| path.display().to_string())
}

/// The model in these bytes, to be used with scans; `path` is for the message.
pub fn model<'a>(bytes: &'a [u8], path: Option<&Path>) -> Result<Model<'a>, Failure> {
    let name = model_name(path);
    let model = any_model(bytes, &name)?;
    within_memory(&model, &name)?;
    let spacing = model.header().spacing;
    if !VOXELS.contains(&spacing) {
        return Err(format!(
            "{name}: its voxels are {spacing:e} units long, no class is that small or large: train it in another unit (--unit)"
        )
        .into());
    }
    // Searches take their steps by it: at a twentieth of what is right they have no end.
    let growth = class::mean_growth(&model);
    if growth == 0.0 {
        return Err(
            format!("{name}: its mean shape has no surface: train it again, on shapes in one pose").into()
        );
    }
    if !CONSISTENT.contains(&growth) {
        return Err(
            format!("{name}: its length scale does not belong to its mean shape; train it again").into()
        );
    }
    Ok(model)
}

/// Refuses a model, called `name`, whose volumes need more memory than allowed.
pub fn within_memory(model: &Model<'_>, name: &str) -> Result<(), Failure> {
    let needed = zero_level::memory(model.grid().sides(), 1);
    let limit = io::limit::get();
    if needed > limit {
        let [x, y, z] = model.grid().sides();
        return Err(format!(
            "{name}: its grid of {x} x {y} x {z} voxels may need {needed} bytes of memory, --max-memory allows {limit}: \
             allow more, or train with a larger --spacing"
        )
        .into());
    }
    Ok(())
}

/// The model in these bytes, called `name`, to be looked at.
pub fn any_model<'a>(bytes: &'a [u8], name: &str) -> Result<Model<'a>, Failure> {
    Model::from_bytes(bytes).map_err(|error| sentence(name, &error).into())
}

/// Lengths of voxels that are believed, in the model's unit.
const VOXELS: Range<f32> = 1e-6..1e6;
/// Roots of a mean shape's area in terms of the shapes' that are believed: models of all kinds of classes 0.94 to 1.03, one
/// whose mean had closed an opening 1.5.
const CONSISTENT: Range<f64> = 0.4..2.5;

/// A scan from a file, or the example scan; a cloud without normals gets estimated ones.
pub fn scan(path: Option<&Path>) -> Result<Loaded, Failure> {
    let Some(path) = path else {
        let example = io::parse_noted(io::Format::Ply, lacuna_fixtures::SCAN);
        return example.map_err(|fault| fault.in_file(Path::new("the example scan")).into());
    };
    let mut loaded = io::read_scan_noted(path)?;
    if loaded.mesh.triangles.is_empty() && loaded.mesh.normals.is_empty() {
        loaded.mesh.normals = crate::normals::estimate(&loaded.mesh.points);
    }
    Ok(loaded)
}

/// Finds before any work is done that a report cannot be written.
pub fn check_report(path: &Path) -> Result<(), Failure> {
    let folder = path.parent().unwrap_or(Path::new(""));
    let parent = folder.parent().filter(|parent| !parent.as_os_str().is_empty());
    if let Some(parent) = parent.filter(|parent| !parent.exists()) {
        let (folder, parent) = (folder.display(), parent.display());
        return Err(format!("cannot make {folder}: the folder {parent} does not exist").into());
    }
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    outputs::check_folder(folder, &[&*name])?;
    outputs::own(path, report::MARK, "give --report another folder")
}

/// Writes a report; its folder is made where it is missing.
pub fn write_report(path: &Path, html: &str) -> Result<(), Failure> {
    let folder = path.parent().unwrap_or(Path::new(""));
    if !folder.as_os_str().is_empty() && !folder.is_dir() {
        std::fs::create_dir(folder)
            .map_err(|error| format!("cannot make the folder {}: {error}", folder.display()))?;
    }
    Ok(io::atomic::write(path, |file| file.write_all(html.as_bytes()))?)
}

/// All vertices times a factor.
pub fn scaled(mut mesh: Mesh, factor: f64) -> Mesh {
    if factor != 1.0 {
        mesh.points.iter_mut().for_each(|p| *p *= factor);
    }
    mesh
}

/// A pose file: a JSON array of four rows of four, scan to model, or an object with it as `scan_to_model`;
/// `identity` stands for a scan that is in the model's frame. A unit of the scan is `factor` of the model's.
pub fn pose(text: &str, model: &Model<'_>, factor: f64) -> Result<Placed, Failure> {
    let matrix =
        if text == "identity" { Matrix4::identity() * factor } else { read_matrix(Path::new(text))? };
    let Some((scale, rotation)) = scale_and_rotation(&(matrix.fixed_view::<3, 3>(0, 0) / factor)) else {
        return Err(format!("{text}: the matrix is not a rotation with a positive scale").into());
    };
    if !(1.0 / size::LIMIT..=size::LIMIT).contains(&scale) {
        return Err(format!(
            "{text}: the matrix makes the scan {scale:.4e} times as large, a model's scans differ from it by at most a \
             factor of {}: is the matrix from the scan (in the unit of its file, see --unit) to the model?",
            size::LIMIT
        )
        .into());
    }
    Ok(Placed::new(model, &rotation, scale, &matrix.fixed_view::<3, 1>(0, 3).into()))
}

fn read_matrix(path: &Path) -> Result<Matrix4<f64>, Failure> {
    let name = path.display();
    let bytes = io::limit::load(path, io::limit::PER_BYTE)?;
    let value: serde_json::Value =
        serde_json::from_slice(&bytes).map_err(|error| format!("{name} is not JSON: {error}"))?;
    let rows =
        value.get("scan_to_model").or_else(|| value.get("truth")?.get("scan_to_model")).unwrap_or(&value);
    let rows: [[f64; 4]; 4] = serde_json::from_value(rows.clone()).map_err(|_| {
        format!("{name} holds no 4 x 4 matrix: give an array of four rows, or `scan_to_model`")
    })?;
    let [x, y, z, w] = rows[3];
    if [x, y, z] != [0.0; 3] || w == 0.0 || !w.is_finite() {
        return Err(format!(
            "{name}: the last row of the matrix is {x} {y} {z} {w} instead of 0 0 0 1: it is applied to columns, with \
             the translation in the last column; transpose it?"
        )
        .into());
    }
    // Homogeneous: all multiples are the same transform.
    Ok(Matrix4::from_fn(|i, j| rows[i][j] / w))
}

/// From the scan as it is in its file to the model, as a matrix. A unit of the scan is `factor` of the model's.
pub fn matrix(placed: &Placed, model: &Model<'_>, factor: f64) -> [[f64; 4]; 4] {
    let header = model.header();
    let spacing = f64::from(header.spacing);
    let position = |p: &Point| {
        let q = placed.to_model(p).coords * spacing;
        q + nalgebra::Vector3::from(header.origin.map(f64::from))
    };
    let scale = f64::from(placed.pose.scale) * spacing;
    let rotation = placed.pose.rotation.map(|row| row.map(|c| f64::from(c) * scale));
    let at_centre = position(&placed.centre);
    std::array::from_fn(|i| {
        if i == 3 {
            return [0.0, 0.0, 0.0, 1.0];
        }
        let [a, b, c] = rotation[i];
        let moved = a * placed.centre.x + b * placed.centre.y + c * placed.centre.z;
        [a * factor, b * factor, c * factor, at_centre[i] - moved]
    })
}
