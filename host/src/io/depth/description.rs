//! The scan.json: camera, depth unit, and where each view was taken from.

use std::path::PathBuf;

use nalgebra::Matrix4;
use serde::Deserialize;

use super::image::Image;
use crate::depth_view::DepthView;
use crate::io::error::{Fault, Problem};

/// What a scan.json has to say; everything else in it is skipped.
#[derive(Debug, Deserialize)]
pub(super) struct Description {
    camera: Camera,
    /// At least one.
    pub views: Vec<View>,
}

#[derive(Debug, Deserialize)]
struct Camera {
    fx: f64,
    fy: f64,
    cx: f64,
    cy: f64,
    depth_unit_mm: f64,
    width: Option<usize>,
    height: Option<usize>,
}

/// One depth image.
#[derive(Debug, Deserialize)]
pub(super) struct View {
    /// Its file, relative to the folder of the scan.json.
    pub depth: PathBuf,
    /// Row by row.
    camera_to_scan: [[f64; 4]; 4],
}

impl Description {
    /// Reads and checks a scan.json.
    pub fn parse(bytes: &[u8]) -> Result<Self, Fault> {
        let description: Self = serde_json::from_slice(bytes).map_err(|error| complaint(&error))?;
        description.check().map_err(|what| Problem::Other(what).in_whole())?;
        Ok(description)
    }

    fn check(&self) -> Result<(), String> {
        let camera = &self.camera;
        for (name, value) in [("fx", camera.fx), ("fy", camera.fy), ("depth_unit_mm", camera.depth_unit_mm)] {
            if !(value > 0.0 && value.is_finite()) {
                return Err(format!("camera.{name} is {value}, it must be greater than 0; correct it"));
            }
        }
        for (number, view) in self.views.iter().enumerate() {
            check_pose(&view.matrix()).map_err(|what| format!("views[{number}].camera_to_scan {what}"))?;
        }
        Ok(())
    }

    /// A view with its pixels, whose size must be the one announced, if one is.
    pub fn join(&self, view: &View, image: Image) -> Result<DepthView, Fault> {
        let Camera { fx, fy, cx, cy, depth_unit_mm: unit_mm, .. } = self.camera;
        let Image { width, height, depth } = image;
        let stated = (self.camera.width.unwrap_or(width), self.camera.height.unwrap_or(height));
        if stated != (width, height) {
            let (w, h) = stated;
            return Err(Problem::Other(format!(
                "the image has {width} x {height} pixels, scan.json says {w} x {h}; correct one of them"
            ))
            .in_whole());
        }
        let camera_to_scan = view.matrix();
        Ok(DepthView { depth, width, height, fx, fy, cx, cy, unit_mm, camera_to_scan })
    }
}

impl View {
    fn matrix(&self) -> Matrix4<f64> {
        Matrix4::from_fn(|row, column| self.camera_to_scan[row][column])
    }
}

/// A pose keeps the homogeneous coordinate and flattens nothing.
fn check_pose(matrix: &Matrix4<f64>) -> Result<(), &'static str> {
    if matrix.row(3) != Matrix4::identity().row(3) {
        return Err("does not end in the row 0 0 0 1; write the matrix row by row");
    }
    let linear = matrix.fixed_view::<3, 3>(0, 0);
    let size: f64 = linear.column_iter().map(|column| column.norm()).product();
    if !(linear.determinant().abs() > 1e-6 * size && matrix.sum().is_finite()) {
        return Err("is not invertible; correct it");
    }
    Ok(())
}

/// What serde says, with its line where ours are.
fn complaint(error: &serde_json::Error) -> Fault {
    let text = error.to_string();
    let what = text.split(" at line ").next().unwrap_or(&text);
    let needed =
        "a scan.json needs camera.fx, fy, cx, cy, depth_unit_mm and, per view, depth and camera_to_scan";
    Problem::Other(format!("{what}; {needed}")).in_line(error.line())
}
