//! What several subcommands read: models, scans, units, poses.

use super::Failure;
use crate::io;
use crate::mesh::{Mesh, Point};
use crate::register::Placed;
use lacuna::format::Unit;
use lacuna::{Error, Model, Pose};
use nalgebra::Matrix4;
use std::path::Path;

/// The bytes of a model file, or of the built-in model.
pub fn model_bytes(path: Option<&Path>) -> Result<Vec<u8>, Failure> {
    let Some(path) = path else { return Ok(lacuna_fixtures::MODEL.to_vec()) };
    std::fs::read(path).map_err(|error| format!("cannot read the model {}: {error}", path.display()).into())
}

/// The model in these bytes; `path` is for the message.
pub fn model<'a>(bytes: &'a [u8], path: Option<&Path>) -> Result<Model<'a>, Failure> {
    let name = path.map_or("the built-in model".into(), |p| p.display().to_string());
    Model::from_bytes(bytes).map_err(|error| format!("{name}: {}", sentence(&error)).into())
}

/// An error of the core as a sentence.
pub fn sentence(error: &Error) -> String {
    match error {
        Error::NotAModel => "is not a Lacuna model: make one with `lacuna train`".into(),
        Error::UnknownVersion { found } => {
            format!(
                "has format version {found}, this program reads {}: update it, or train again",
                lacuna::format::VERSION
            )
        }
        Error::WrongLength { expected, found } if found < expected => {
            format!("is cut short, {found} of {expected} bytes: copy it again")
        }
        Error::WrongLength { expected, found } => {
            format!("has {found} bytes where {expected} belong: copy it again")
        }
        Error::Damaged => "is damaged (checksum): copy it again".into(),
        Error::Inconsistent(part) => format!("contradicts itself ({part:?}): train it again"),
        Error::BufferTooSmall { buffer, needed, given } => {
            format!("the buffer {buffer:?} has {given} elements, {needed} are needed")
        }
        Error::Stride { asked, brick } => {
            format!(
                "a stride of {asked} does not go with bricks of {brick} voxels: use one of 1 to 4 that divides it"
            )
        }
        Error::Radius { asked } => {
            format!("a kernel radius of {asked} nodes is too wide for the fixed-point bounds")
        }
        Error::Option(name) => format!("the option {name:?} is out of range"),
        Error::Pose => "the pose is not a rotation with a positive scale".into(),
        Error::TooFewPoints { given } => format!("{given} points are too few to find a pose"),
        Error::EmptyHull => "the scan does not touch the model in this pose: is the pose right?".into(),
    }
}

/// Millimetres of a unit.
pub fn millimetres(unit: Unit) -> f64 {
    match unit {
        Unit::Millimetre => 1.0,
        Unit::Metre => 1000.0,
        Unit::Inch => 25.4,
        Unit::Micrometre => 0.001,
    }
}

/// A unit by name.
pub fn unit(name: &str) -> Result<Unit, String> {
    match name {
        "mm" | "millimetre" => Ok(Unit::Millimetre),
        "m" | "metre" => Ok(Unit::Metre),
        "in" | "inch" => Ok(Unit::Inch),
        "um" | "micrometre" => Ok(Unit::Micrometre),
        _ => Err("use mm, m, in or um".into()),
    }
}

/// The symbol of a unit.
pub fn symbol(unit: Unit) -> &'static str {
    match unit {
        Unit::Millimetre => "mm",
        Unit::Metre => "m",
        Unit::Inch => "in",
        Unit::Micrometre => "um",
    }
}

/// A scan from a file, or the example scan; a cloud without normals gets estimated ones.
pub fn scan(path: Option<&Path>) -> Result<Mesh, Failure> {
    let Some(path) = path else {
        let example = io::parse(io::Format::Ply, lacuna_fixtures::SCAN);
        return example.map_err(|fault| fault.in_file(Path::new("the example scan")).into());
    };
    let mut mesh = io::read_scan(path)?;
    if mesh.triangles.is_empty() && mesh.normals.is_empty() {
        mesh.normals = crate::normals::estimate(&mesh.points);
    }
    Ok(mesh)
}

/// An error with the scan it belongs to.
pub fn named(path: Option<&Path>, error: &dyn std::error::Error) -> Failure {
    let name = path.map_or("the example scan".into(), |p| p.display().to_string());
    format!("{name}: {error}").into()
}

/// All vertices times a factor.
pub fn scaled(mut mesh: Mesh, factor: f64) -> Mesh {
    if factor != 1.0 {
        mesh.points.iter_mut().for_each(|p| *p *= factor);
    }
    mesh
}

/// A pose file: a JSON array of four rows of four, scan to model, or an object with it as `scan_to_model`;
/// `identity` stands for a scan that is in the model's frame.
pub fn pose(text: &str, model: &Model<'_>) -> Result<Placed, Failure> {
    let matrix = if text == "identity" { Matrix4::identity() } else { read_matrix(Path::new(text))? };
    let columns = matrix.fixed_view::<3, 3>(0, 0).into_owned();
    let scale = columns.determinant().cbrt();
    let rotation = columns / scale;
    let error = (rotation * rotation.transpose() - nalgebra::Matrix3::identity()).norm();
    if !scale.is_finite() || scale <= 0.0 || error > 1e-3 {
        return Err(format!("{text}: the matrix is not a rotation with a positive scale").into());
    }
    let header = model.header();
    let spacing = f64::from(header.spacing);
    let origin = nalgebra::Vector3::from(header.origin.map(f64::from));
    // The pose works on centred coordinates: the centre is what maps to the middle of the grid.
    let middle = nalgebra::Vector3::from(header.sides.map(|side| f64::from(side) / 2.0));
    let target = middle * spacing + origin - matrix.fixed_view::<3, 1>(0, 3);
    let centre = Point::from(rotation.transpose() * target / scale);
    let pose = Pose {
        rotation: rotation.transpose().map(|c| c as f32).into(),
        scale: (scale / spacing) as f32,
        translation: middle.map(|c| c as f32).into(),
    };
    Ok(Placed { centre, pose })
}

fn read_matrix(path: &Path) -> Result<Matrix4<f64>, Failure> {
    let name = path.display();
    let text =
        std::fs::read_to_string(path).map_err(|error| format!("cannot read the pose {name}: {error}"))?;
    let value: serde_json::Value =
        serde_json::from_str(&text).map_err(|error| format!("{name} is not JSON: {error}"))?;
    let rows =
        value.get("scan_to_model").or_else(|| value.get("truth")?.get("scan_to_model")).unwrap_or(&value);
    let rows: [[f64; 4]; 4] = serde_json::from_value(rows.clone()).map_err(|_| {
        format!("{name} holds no 4 x 4 matrix: give an array of four rows, or `scan_to_model`")
    })?;
    Ok(Matrix4::from_fn(|i, j| rows[i][j]))
}

/// Scan to model as a matrix, both in the model's unit.
pub fn matrix(placed: &Placed, model: &Model<'_>) -> [[f64; 4]; 4] {
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
        [a, b, c, at_centre[i] - moved]
    })
}
