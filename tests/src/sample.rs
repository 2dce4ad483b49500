//! Scans whose truth is known, and how far a completion is from it.

use crate::degrees_between;
use lacuna_host::distance::Surface;
use lacuna_host::io;
use lacuna_host::mesh::Mesh;
use lacuna_host::register::Placed;
use lacuna_host::synth::{Head, Kind, ScannerSettings, Surrounding, scan_among};
use nalgebra::Matrix4;
use std::ops::RangeInclusive;
use std::path::Path;

/// A scan with its truth.
pub struct Sample {
    /// What it is called.
    pub name: String,
    /// The whole shape, millimetres, in the model's frame.
    pub truth: Mesh,
    /// The scan.
    pub scan: Mesh,
    /// Which vertices of the truth were not seen.
    pub missing: Vec<bool>,
    /// From the model's frame to the scan's: a similarity.
    pub model_to_scan: Matrix4<f64>,
}

/// A head of seed 1 from one side, in an unknown pose.
pub fn head(number: u64, kind: Kind) -> Sample {
    head_among(number, kind, &[])
}

/// Such a head, scanned among other things.
pub fn head_among(number: u64, kind: Kind, things: &[Surrounding]) -> Sample {
    let truth = Head::sample(1, number).mesh();
    let others = Surrounding::meshes(things.iter().copied(), truth.bounds().expect("a head"), number);
    let made = scan_among(&truth, &others, kind, &ScannerSettings::small(), number);
    Sample {
        name: format!("head {number} {kind:?}"),
        truth,
        scan: made.mesh,
        missing: made.missing,
        model_to_scan: made.model_to_scan,
    }
}

/// Such heads, each from the front and from the side.
pub fn heads(numbers: RangeInclusive<u64>) -> impl Iterator<Item = Sample> {
    let both = numbers.flat_map(|number| [Kind::Front, Kind::Side].map(|kind| (number, kind)));
    both.map(|(number, kind)| head(number, kind))
}

/// A scan as `../shared/data/scans` describes it: a folder with mesh.ply, scan.json and gt_missing.u8.
///
/// # Panics
/// A folder with other files.
pub fn real(folder: &Path) -> Sample {
    let text = std::fs::read_to_string(folder.join("scan.json")).expect("scan.json");
    let about: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    let rows: [[f64; 4]; 4] =
        serde_json::from_value(about["truth"]["scan_to_model"].clone()).expect("a 4 x 4 matrix");
    let truth = about["ground_truth_mesh"].as_str().expect("the truth's path");
    let missing = std::fs::read(folder.join("gt_missing.u8")).expect("gt_missing.u8");
    Sample {
        name: folder.file_name().map_or(String::new(), |name| name.to_string_lossy().into_owned()),
        truth: io::read(&folder.join("..").join(truth)).expect("the truth"),
        scan: io::read(&folder.join("mesh.ply")).expect("the scan"),
        missing: missing.iter().map(|&m| m != 0).collect(),
        model_to_scan: Matrix4::from_fn(|i, j| rows[i][j]).try_inverse().expect("a similarity"),
    }
}

impl Sample {
    /// From the scan's frame to the model's.
    pub fn scan_to_model(&self) -> Matrix4<f64> {
        self.model_to_scan.try_inverse().expect("a similarity")
    }

    /// Degrees between the pose found and the true one.
    pub fn degrees_off(&self, placed: &Placed) -> f64 {
        let truth = self.scan_to_model();
        let rotation = placed.pose.rotation;
        let entry = |i: usize, j: usize| if i < 3 && j < 3 { f64::from(rotation[i][j]) } else { 0.0 };
        let rows =
            |f: &dyn Fn(usize, usize) -> f64| std::array::from_fn(|i| std::array::from_fn(|j| f(i, j)));
        degrees_between(&rows(&entry), &rows(&|i, j| truth[(i, j)]))
    }

    /// Root mean square distance of some of the truth's vertices from a mesh in the scan's frame, in true
    /// millimetres.
    pub fn rms_mm(&self, mesh: &Mesh, keep: impl Fn(usize) -> bool) -> f64 {
        let surface = Surface::new(mesh).expect("a surface");
        let scale = self.model_to_scan.fixed_view::<3, 1>(0, 0).norm();
        let kept = self.truth.points.iter().enumerate().filter(|&(i, _)| keep(i));
        let distance = |p| {
            surface.distance(&self.model_to_scan.transform_point(p), f64::INFINITY).map_or(0.0, |d| d.value)
        };
        let squares: Vec<f64> = kept.map(|(_, p)| (distance(p) / scale).powi(2)).collect();
        (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt()
    }
}
