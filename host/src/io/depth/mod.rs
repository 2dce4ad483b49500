//! Depth images: 16-bit greyscale PNG files and the scan.json that describes them.
//!
//! A pixel in column u and row v with the value d > 0 is the point
//! `Z = d unit_mm, X = (u - cx) / fx Z, Y = (v - cy) / fy Z` of a camera that looks along +Z with
//! x to the right and y down; pixel centres are at integers, 0 is "not measured". The view's
//! matrix takes it into the scan frame.

mod description;
mod grid;
mod image;
#[cfg(test)]
mod tests;

use std::path::{Path, PathBuf};

use nalgebra::Matrix4;

use super::Loaded;
use super::error::{Error, Fault, Problem};
use super::finish::finish;
use super::limit::PER_BYTE;
use crate::mesh::{Mesh, Point};
use description::{Description, View};

/// The file that describes the images beside it.
const DESCRIPTION: &str = "scan.json";

/// One depth image and its camera.
#[derive(Clone, Debug, PartialEq)]
pub struct DepthView {
    /// `width` x `height` values, row by row from the top; 0 is "not measured".
    pub depth: Vec<u16>,
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Focal length along a row, pixels.
    pub fx: f64,
    /// Focal length along a column, pixels.
    pub fy: f64,
    /// Column of the optical axis; the centre of the first pixel is 0.
    pub cx: f64,
    /// Row of the optical axis.
    pub cy: f64,
    /// Millimetres per grey level.
    pub unit_mm: f64,
    /// Takes camera coordinates into the scan frame: p_scan = M p_camera.
    pub camera_to_scan: Matrix4<f64>,
}

impl DepthView {
    /// The value in column `u` and row `v`; 0 beyond the image.
    pub fn at(&self, u: usize, v: usize) -> u16 {
        let inside = u < self.width && v < self.height;
        if inside { self.depth.get(v * self.width + u).copied().unwrap_or(0) } else { 0 }
    }

    /// The point of the pixel in column `u` and row `v`, in the scan frame; none if unmeasured.
    pub fn point(&self, u: usize, v: usize) -> Option<Point> {
        let z = f64::from(self.at(u, v)) * self.unit_mm;
        let camera = Point::new((u as f64 - self.cx) / self.fx * z, (v as f64 - self.cy) / self.fy * z, z);
        let scan = self.camera_to_scan.fixed_view::<3, 4>(0, 0) * camera.to_homogeneous();
        (z > 0.0).then(|| Point::from(scan))
    }

    /// Median of the measured depths, millimetres; none if nothing was measured.
    pub fn median_depth_mm(&self) -> Option<f64> {
        let mut measured: Vec<u16> = self.depth.iter().copied().filter(|&d| d > 0).collect();
        let middle = measured.len() / 2;
        (!measured.is_empty()).then(|| f64::from(*measured.select_nth_unstable(middle).1) * self.unit_mm)
    }

    /// Width of a pixel at the median depth, millimetres; 0 if nothing was measured.
    pub fn pixel_mm(&self) -> f64 {
        self.median_depth_mm().unwrap_or(0.0) / self.fx.min(self.fy)
    }

    /// Largest difference in depth between neighbouring pixels of a surface, millimetres: twelve pixel widths. A
    /// surface as steep as that is seen at more than 85 degrees.
    pub fn jump_mm(&self) -> f64 {
        const JUMP_PIXELS: f64 = 12.0;
        JUMP_PIXELS * self.pixel_mm()
    }
}

/// Whether `path` is something that [`read`] takes: a folder, a `.json` or a `.png`.
pub fn is_depth(path: &Path) -> bool {
    let extension = path.extension().map(|extension| extension.to_ascii_lowercase());
    path.is_dir() || extension.is_some_and(|extension| extension == "json" || extension == "png")
}

/// Whether a folder holds depth views: whether a description of them is in it.
pub fn is_in(folder: &Path) -> bool {
    folder.join(DESCRIPTION).exists()
}

/// Reads depth views: all of a scan.json, all of the scan.json in a folder, or the one view
/// whose PNG is named, described by the scan.json beside it.
///
/// # Errors
/// [`Error::Read`] if a file is missing, [`Error::Content`] if the description lacks something,
/// or an image is not what it describes.
pub fn read(path: &Path) -> Result<Vec<DepthView>, Error> {
    let (json, only) = locate(path);
    if json != path && !json.exists() {
        let what = match only {
            Some(_) => "a depth image needs a scan.json beside it, which says how the camera saw it",
            None => "there is no scan.json in this folder; name a file, or a folder with depth images",
        };
        return Err(Problem::Other(what.into()).in_whole().in_file(path));
    }
    let bytes = super::load(&json, PER_BYTE)?;
    let description = Description::parse(&bytes).map_err(|fault| fault.in_file(&json))?;
    let folder = json.parent().unwrap_or(Path::new("."));
    let wanted = |view: &&View| only.is_none_or(|png| view.depth.file_name() == png.file_name());
    let views: Vec<&View> = description.views.iter().filter(wanted).collect();
    if views.is_empty() {
        return Err(not_listed(only).in_file(&json));
    }
    views.into_iter().map(|view| load_view(folder, &description, view)).collect()
}

/// The files that [`read`] reads of a path; no more than the description where that cannot be read.
pub fn files(path: &Path) -> Vec<PathBuf> {
    let (json, only) = locate(path);
    let description = super::load(&json, PER_BYTE).ok().and_then(|bytes| Description::parse(&bytes).ok());
    let folder = json.parent().unwrap_or(Path::new("."));
    let images = description.into_iter().flat_map(|description| description.views);
    let mut files: Vec<PathBuf> = images.map(|view| folder.join(view.depth)).collect();
    files.extend(only.map(Path::to_path_buf));
    files.push(json);
    files
}

/// The description that belongs to a path, and the only image wanted if an image was named.
fn locate(path: &Path) -> (PathBuf, Option<&Path>) {
    if path.is_dir() {
        return (path.join(DESCRIPTION), None);
    }
    match path.extension() {
        Some(extension) if extension.eq_ignore_ascii_case("png") => {
            (path.with_file_name(DESCRIPTION), Some(path))
        }
        _ => (path.into(), None),
    }
}

fn not_listed(only: Option<&Path>) -> Fault {
    let what = match only {
        Some(png) => format!("there is no view {}; add it to \"views\"", png.display()),
        None => "\"views\" is empty; list at least one depth image".into(),
    };
    Problem::Other(what).in_whole()
}

fn load_view(folder: &Path, description: &Description, view: &View) -> Result<DepthView, Error> {
    let png = folder.join(&view.depth);
    let bytes = super::load(&png, PER_BYTE)?;
    let image = image::decode(&bytes).map_err(|fault| fault.in_file(&png))?;
    description.join(view, image).map_err(|fault| fault.in_file(&png))
}

/// All views as one mesh of overlapping sheets in the scan frame.
///
/// Neighbouring pixels whose depths differ by more than [`DepthView::jump_mm`] are not joined.
///
/// # Errors
/// If there is not a single triangle.
pub fn merge(views: &[DepthView]) -> Result<Loaded, Fault> {
    let mut all = Mesh::default();
    for view in views {
        all.append(&view.mesh(view.jump_mm()));
    }
    if all.triangles.is_empty() {
        let what = "no three neighbouring pixels are measured; check the depth images and depth_unit_mm";
        return Err(Problem::Other(what.into()).in_whole());
    }
    finish(all)
}
