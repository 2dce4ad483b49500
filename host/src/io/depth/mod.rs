//! Depth images as files: 16-bit greyscale PNG and the scan.json that describes them.

mod description;
mod image;
#[cfg(test)]
mod tests;

use std::path::{Path, PathBuf};

use super::Loaded;
use super::error::{Error, Fault, Problem};
use super::finish::finish;
use super::limit::PER_BYTE;
use crate::depth_view::DepthView;
use crate::mesh::Mesh;
use description::{Description, View};

/// The file that describes the images beside it.
const DESCRIPTION: &str = "scan.json";

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

/// All views as one mesh of overlapping sheets in the scan frame; the gaps of those with many are filled in.
///
/// Neighbouring pixels whose depths differ by more than [`DepthView::jump_mm`] are not joined.
///
/// # Errors
/// If there is not a single triangle.
pub fn merge(views: Vec<DepthView>) -> Result<Loaded, Fault> {
    let mut all = Mesh::default();
    let mut filled = 0;
    for mut view in views {
        filled += view.fill_gaps();
        all.append(&view.mesh(view.jump_mm()));
    }
    if all.triangles.is_empty() {
        let what = "no three neighbouring pixels are measured; check the depth images and depth_unit_mm";
        return Err(Problem::Other(what.into()).in_whole());
    }
    let note = format!(
        "{filled} pixels between measured ones were not measured, and were filled in from those beside them: there is more noise than is told"
    );
    let mut loaded = finish(all)?;
    loaded.repairs.extend((filled > 0).then_some(note));
    Ok(loaded)
}
