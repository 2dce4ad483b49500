//! Digests of what results depend on.

use crate::mesh::Mesh;
use lacuna::format::Digest;

/// CRC-32 of a sequence of pieces.
pub fn digest(pieces: impl IntoIterator<Item: AsRef<[u8]>>) -> u32 {
    let mut sum = Digest::new();
    pieces.into_iter().for_each(|piece| sum.add(piece.as_ref()));
    sum.value()
}

/// CRC-32 of this program: another build may compute other results.
pub fn of_program() -> u32 {
    let file = std::env::current_exe().and_then(std::fs::read);
    file.map_or(0, |bytes| digest([bytes]))
}

/// CRC-32 of a mesh's coordinates and triangles.
pub fn digest_of(mesh: &Mesh) -> u32 {
    let points = mesh.points.iter().flat_map(|p| [p.x, p.y, p.z]).map(|c| c.to_le_bytes().to_vec());
    let corners = mesh.triangles.as_flattened().iter().map(|corner| corner.to_le_bytes().to_vec());
    digest(points.chain(corners))
}
