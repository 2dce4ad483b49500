//! Shared helpers of the tests: the built-in model, the program, borrowed buffers, real data.

pub mod browser;
pub mod device_memory;
pub mod expected_errors;
pub mod firmware;
pub mod framed;
pub mod fuzz;
pub mod image;
pub mod line;
pub mod looks;
pub mod nasty;
pub mod nine;
pub mod program;
pub mod registration;
pub mod required;
pub mod rubbish;
pub mod sample;
pub mod seam;
pub mod small;
pub mod tcp_device;
pub mod trained;

use lacuna::{Model, Pose};
use lacuna_host::points::{OrientedPoints, thin};
use lacuna_host::synth::Head;
use std::path::PathBuf;
use std::sync::LazyLock;

/// The built-in model.
pub fn model() -> Model<'static> {
    // Once: each of its bytes is looked at.
    static MODEL: LazyLock<Model<'static>> =
        LazyLock::new(|| Model::from_bytes(lacuna_fixtures::MODEL).expect("the built-in model"));
    MODEL.clone()
}

/// A whole head of the built-in class, in the model's frame, one point every 2 mm.
pub fn head_points(number: u64) -> OrientedPoints {
    thin(&Head::sample(1, number).mesh(), 2.0)
}

/// From the model's frame to its voxels.
pub fn voxel_pose(model: &Model<'_>) -> Pose {
    Pose::in_frame_of(model.header(), Pose::IDENTITY.rotation, 1.0, [0.0; 3])
}

/// Points as the core takes them: voxels, with unit normals.
pub fn in_voxels(points: &OrientedPoints, pose: &Pose) -> Vec<([f32; 3], [f32; 3])> {
    let place = |(p, n): (&lacuna_host::mesh::Point, &lacuna_host::mesh::Vector)| {
        let normal = pose.rotate(n.map(|c| c as f32).into());
        (pose.apply(p.coords.map(|c| c as f32).into()), normal)
    };
    points.points.iter().zip(&points.normals).map(place).collect()
}

/// Degrees between the rotations in two similarities, given row by row.
pub fn degrees_between(a: &[[f64; 4]; 4], b: &[[f64; 4]; 4]) -> f64 {
    let size = |m: &[[f64; 4]; 4]| (0..3).map(|i| m[i][0] * m[i][0]).sum::<f64>().sqrt();
    let entries = (0..3).flat_map(|i| (0..3).map(move |j| (i, j)));
    let trace = entries.map(|(i, j)| a[i][j] * b[i][j]).sum::<f64>() / (size(a) * size(b));
    ((trace - 1.0) / 2.0).clamp(-1.0, 1.0).acos().to_degrees()
}

/// A file or folder of the real data beside the workspace; `None`, and a line that says so, without it.
///
/// # Panics
/// Without it where `LACUNA_REQUIRE_DATA=1`.
pub fn real_data(path: &str) -> Option<PathBuf> {
    let root = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../shared/data");
    let found = root.join(path);
    if found.exists() {
        return Some(found);
    }
    required::lacks("DATA", &format!("there is no real data at ../shared/data/{path}"));
    None
}
