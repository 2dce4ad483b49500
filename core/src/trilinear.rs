//! Trilinear weights φ of the eight nodes around a voxel, as integers: a cell of q³ voxels has the same ones everywhere.

/// Most voxels of a cell: q is 4 at most.
pub const CELL_VOXELS: usize = 64;

/// φ q³ of the eight corners for the voxel at `at` within a cell.
#[inline]
pub fn trilinear([x, y, z]: [u8; 3], q: u8) -> &'static Factors {
    let [x, y, z, side] = [x, y, z, q].map(usize::from);
    let factors = TRILINEAR.get(side).and_then(|cell| cell.get((z * side + y) * side + x));
    factors.unwrap_or(&[0; 8])
}

/// Integer trilinear weights of the eight corners, which sum to q³.
pub type Factors = [i16; 8];

/// [`Factors`] of the voxels of a cell, x fastest, for every stride: to look them up takes less than to work them out.
static TRILINEAR: [[Factors; CELL_VOXELS]; 5] = [cell(0), cell(1), cell(2), cell(3), cell(4)];

const fn cell(q: usize) -> [Factors; CELL_VOXELS] {
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
