//! The signs of a volume as bits, so that cells without a surface are skipped 64 at a time.

use super::marching_cubes::Volume;

/// Two bits for each voxel, in rows along x that end with at least one unknown voxel.
pub struct Signs {
    inside: Vec<u64>,
    unknown: Vec<u64>,
    words: usize,
}

/// The signs of the corners of up to 64 neighbouring cells.
pub struct Cells {
    /// For each of the eight corners, one bit for each cell: is it inside?
    corners: [u64; 8],
    /// The cells that the surface passes through.
    active: u64,
}

impl Signs {
    /// Reads the signs of all voxels.
    pub fn new(volume: &Volume) -> Self {
        let nx = volume.dims[0];
        let words = nx / 64 + 1;
        let rows = volume.dims[1] * volume.dims[2];
        let mut signs = Self { inside: vec![0; rows * words], unknown: vec![u64::MAX; rows * words], words };
        let targets = signs.inside.chunks_exact_mut(words).zip(signs.unknown.chunks_exact_mut(words));
        for (row, (inside, unknown)) in volume.values.chunks_exact(nx).zip(targets) {
            for (values, (inside, unknown)) in row.chunks(64).zip(inside.iter_mut().zip(unknown)) {
                (*inside, *unknown) = pack(values);
            }
        }
        signs
    }

    /// Words in a row.
    pub fn words(&self) -> usize {
        self.words
    }

    /// The cells that start in word `word` of four rows: (y, z), (y + 1, z), (y, z + 1), (y + 1, z + 1).
    pub fn cells(&self, rows: [usize; 4], word: usize) -> Cells {
        let (mut corners, mut unknown) = ([0; 8], 0);
        for (pair, row) in corners.chunks_exact_mut(2).zip(rows) {
            let (here, next) = self.two(&self.inside, row, word);
            pair.copy_from_slice(&[here, next]);
            let (here, next) = self.two(&self.unknown, row, word);
            unknown |= here | next;
        }
        let any = corners.iter().fold(0, |all, bits| all | bits);
        let all = corners.iter().fold(u64::MAX, |all, bits| all & bits);
        Cells { corners, active: any & !all & !unknown }
    }

    /// The bits of 64 voxels and of their neighbours along x; past the row's end comes a zero, which
    /// belongs to a cell that starts past the row's end.
    fn two(&self, bits: &[u64], row: usize, word: usize) -> (u64, u64) {
        let at = row * self.words + word;
        let following = if word + 1 < self.words { bits[at + 1] } else { 0 };
        (bits[at], bits[at] >> 1 | following << 63)
    }
}

impl Iterator for Cells {
    type Item = (usize, usize);

    /// The next cell that the surface passes through: its place in the word and its sign pattern.
    fn next(&mut self) -> Option<Self::Item> {
        let bit = self.active.trailing_zeros();
        self.active &= self.active.checked_sub(1)?;
        let pattern = (0..8).fold(0, |all, corner| all | (self.corners[corner] >> bit & 1) << corner);
        Some((bit as usize, pattern as usize))
    }
}

/// Inside and unknown bits of up to 64 values; voxels that are not there are unknown.
fn pack(values: &[f32]) -> (u64, u64) {
    values.iter().enumerate().fold((0, u64::MAX), |(inside, unknown), (bit, value)| {
        (inside | u64::from(*value < 0.0) << bit, unknown ^ u64::from(value.is_finite()) << bit)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn active(dims: [usize; 3], values: &[f32]) -> Vec<(usize, usize)> {
        let signs = Signs::new(&Volume { dims, values });
        let rows = [0, 1, dims[1], dims[1] + 1];
        (0..signs.words())
            .flat_map(|w| signs.cells(rows, w).map(move |(bit, case)| (64 * w + bit, case)))
            .collect()
    }

    #[test]
    fn finds_the_one_inside_voxel_across_words() {
        for nx in [2, 63, 64, 65, 66, 128, 129, 200] {
            for at in [0, 1, 62, 63, 64, 65, 127, 128, nx - 1] {
                if at >= nx {
                    continue;
                }
                let mut values = vec![1.0; nx * 4];
                values[at] = -1.0;
                let left = at.checked_sub(1).map(|x| (x, 0b10));
                let right = (at + 1 < nx).then_some((at, 0b01));
                assert_eq!(active([nx, 2, 2], &values), left.into_iter().chain(right).collect::<Vec<_>>());
            }
        }
    }

    #[test]
    fn unknown_and_infinite_values_silence_their_cells() {
        for odd in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            let mut values = vec![1.0; 16];
            (values[1], values[2]) = (-1.0, odd);
            assert_eq!(active([4, 2, 2], &values), [(0, 0b10)]);
        }
    }
}
