//! Digests of what results depend on.

use crate::mesh::Mesh;
use crc::{CRC_32_ISO_HDLC, Crc};

static CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);

/// CRC-32 of a sequence of pieces.
pub fn digest(pieces: impl IntoIterator<Item: AsRef<[u8]>>) -> u32 {
    let mut sum = CRC.digest();
    pieces.into_iter().for_each(|piece| sum.update(piece.as_ref()));
    sum.finalize()
}

/// CRC-32 of a mesh's coordinates and triangles.
pub fn digest_of(mesh: &Mesh) -> u32 {
    let points = mesh.points.iter().flat_map(|p| [p.x, p.y, p.z]).map(|c| c.to_le_bytes().to_vec());
    let corners = mesh.triangles.as_flattened().iter().map(|corner| corner.to_le_bytes().to_vec());
    digest(points.chain(corners))
}
