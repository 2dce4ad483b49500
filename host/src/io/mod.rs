//! Files in and out: meshes, point clouds, depth images.
//!
//! [`read`] takes any mesh or point cloud, [`read_scan`] takes depth images as well. Both look at
//! the content before they trust a file name, both refuse what they cannot read completely, and
//! neither panics, whatever the bytes are. [`write_ply`] writes results; [`atomic::write`] makes
//! sure that a file is there completely or not at all.
//!
//! What every reader guarantees about the [`Mesh`] it returns: at least one vertex, all
//! coordinates finite, all corner indices in range, no triangle that names a vertex twice, and
//! normals either absent or one a vertex, of unit length or zero where the file knows none.
//! Vertices keep the order of the file (STL has none: there, the order of first use).

pub mod atomic;
pub mod depth;
mod error;
mod finish;
mod format;
pub mod limit;
mod obj;
mod pcd;
mod ply;
mod ply_out;
mod stl;
mod text;
mod weld;
mod xyz;

#[cfg(test)]
mod tests;

use std::path::Path;

pub use error::{Error, Fault, Place, Problem};
pub use format::{Format, parse};
pub use ply_out::{PlyOut, write_ply};

use crate::mesh::Mesh;

/// Reads a mesh or a point cloud: PLY, OBJ, STL, PCD, or text in columns.
///
/// # Errors
/// [`Error::Read`] if the file cannot be read, [`Error::Content`] if it is not a complete and
/// consistent mesh.
pub fn read(path: &Path) -> Result<Mesh, Error> {
    let bytes = load(path)?;
    Format::detect(path, &bytes).and_then(|format| parse(format, &bytes)).map_err(|fault| fault.in_file(path))
}

/// Reads a scan in any form: what [`read`] takes, or depth images ([`depth::read`]), whose views
/// are triangulated and put side by side in the scan's frame.
///
/// # Errors
/// As for [`read`] and [`depth::read`].
pub fn read_scan(path: &Path) -> Result<Mesh, Error> {
    if depth::is_depth(path) {
        return depth::merge(&depth::read(path)?).map_err(|fault| fault.in_file(path));
    }
    read(path)
}

use limit::load;
