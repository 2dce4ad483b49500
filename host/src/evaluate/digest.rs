//! Digests of what results depend on.

use crate::io::Error;
use crate::mesh::Mesh;
use lacuna::digest::Digest;

/// CRC-32 of a sequence of pieces.
pub fn digest(pieces: impl IntoIterator<Item: AsRef<[u8]>>) -> u32 {
    let mut sum = Digest::new();
    pieces.into_iter().for_each(|piece| sum.add(piece.as_ref()));
    sum.value()
}

/// CRC-32 of this program: another build may compute other results.
///
/// # Errors
/// A program that cannot read its own file.
pub fn of_program() -> Result<u32, Error> {
    let path = std::env::current_exe().unwrap_or_else(|_| "this program".into());
    let bytes = std::fs::read(&path).map_err(|cause| Error::Read { path, cause })?;
    Ok(digest([bytes]))
}

/// CRC-32 of a mesh's coordinates and triangles.
pub fn digest_of(mesh: &Mesh) -> u32 {
    let points = mesh.points.iter().flat_map(|p| [p.x, p.y, p.z]).map(|c| c.to_le_bytes().to_vec());
    let corners = mesh.triangles.as_flattened().iter().map(|corner| corner.to_le_bytes().to_vec());
    digest(points.chain(corners))
}
