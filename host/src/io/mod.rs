//! Files in and out: meshes, point clouds, depth images.
//!
//! [`read`] takes any mesh or point cloud, [`read_scan`] takes depth images as well, which it knows by their names
//! (PNG, JSON, a folder). Of all others both look at the content before they trust a file name. Both refuse what they
//! cannot read completely, and neither panics, whatever the bytes are. [`write_ply`] writes results; [`atomic::write`]
//! makes sure that a file is there completely or not at all.
//!
//! What is damaged without loss is repaired, and said: [`read_noted`] and [`read_scan_noted`] hand out the notes.
//!
//! What every reader guarantees about the [`Mesh`] it returns: at least one vertex, all
//! coordinates finite, all corner indices in range, no triangle that names a vertex twice, and
//! normals either absent or one a vertex, of unit length or zero where the file knows none.
//! Vertices keep the order of the file (STL has none: there, the order of first use).

pub mod atomic;
mod columns;
pub mod depth;
mod error;
mod finish;
mod format;
pub mod limit;
mod obj;
mod pcd;
mod pipe;
mod ply;
mod ply_out;
mod stl;
mod stranger;
mod text;
mod unknown;
mod weld;
mod xyz;

#[cfg(test)]
mod tests;

use std::path::Path;

pub use error::{Error, Fault, Place, Problem};
pub use format::{Format, parse, parse_noted};
pub use ply_out::{COMPLETED, PlyOut, write_ply};
pub(crate) use weld::Weld;

use crate::mesh::Mesh;

/// A mesh and what was repaired while it was read.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Loaded {
    /// The mesh or cloud.
    pub mesh: Mesh,
    /// Sentences without a full stop.
    pub repairs: Vec<String>,
}

/// Reads a mesh or a point cloud: PLY, OBJ, STL, PCD, or text in columns.
///
/// # Errors
/// [`Error::Read`] if the file cannot be read, [`Error::Content`] if it is not a complete and
/// consistent mesh.
pub fn read(path: &Path) -> Result<Mesh, Error> {
    Ok(read_noted(path)?.mesh)
}

/// As [`read`], with what was repaired.
///
/// # Errors
/// As for [`read`].
pub fn read_noted(path: &Path) -> Result<Loaded, Error> {
    let bytes = load(path, limit::PER_BYTE)?;
    let format = Format::detect(path, &bytes);
    format.and_then(|format| parse_noted(format, &bytes)).map_err(|fault| fault.in_file(path))
}

/// Reads a scan in any form: what [`read`] takes, or depth images ([`depth::read`]), whose views
/// are triangulated and put side by side in the scan's frame.
///
/// # Errors
/// As for [`read`] and [`depth::read`].
pub fn read_scan(path: &Path) -> Result<Mesh, Error> {
    Ok(read_scan_noted(path)?.mesh)
}

/// As [`read_scan`], with what was repaired.
///
/// # Errors
/// As for [`read_scan`].
pub fn read_scan_noted(path: &Path) -> Result<Loaded, Error> {
    if depth::is_depth(path) {
        return depth::merge(depth::read(path)?).map_err(|fault| fault.in_file(path));
    }
    read_noted(path)
}

use limit::load;
