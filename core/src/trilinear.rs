//! Trilinear weights φ of the eight nodes around a voxel, as integers: they depend only on where in its cell of q³ voxels
//! the voxel lies, so that one table does for all cells.

/// Most voxels of a cell: q is 4 at most.
pub const CELL_VOXELS: usize = 64;

/// The weights φ of the eight corners for the voxel at `at` within a cell.
#[inline]
pub fn trilinear([x, y, z]: [u8; 3], q: u8) -> &'static TrilinearWeights {
    let [x, y, z, side] = [x, y, z, q].map(usize::from);
    let weights = TABLE.get(side).and_then(|cell| cell.get((z * side + y) * side + x));
    weights.unwrap_or(&[0; 8])
}

/// φ q³ of the eight corners: integers that sum to q³.
pub type TrilinearWeights = [i16; 8];

/// The weights of the voxels of a cell, x fastest, for every stride: looking them up is quicker than working them out.
static TABLE: [[TrilinearWeights; CELL_VOXELS]; 5] = [cell(0), cell(1), cell(2), cell(3), cell(4)];

const fn cell(q: usize) -> [TrilinearWeights; CELL_VOXELS] {
    let mut all = [[0; 8]; CELL_VOXELS];
    let mut voxel = 0;
    while voxel < q * q * q {
        let [x, y, z] = [voxel % q, voxel / q % q, voxel / (q * q)];
        let [x, y, z] = [x as i16, y as i16, z as i16];
        let (u, v, w) = (q as i16 - x, q as i16 - y, q as i16 - z);
        all[voxel] = [u * v * w, x * v * w, u * y * w, x * y * w, u * v * z, x * v * z, u * y * z, x * y * z];
        voxel += 1;
    }
    all
}
