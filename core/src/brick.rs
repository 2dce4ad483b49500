//! A brick of a model: which of its voxels are stored, their mean distances and modes, read in place.

use crate::arithmetic::{MAX_EXPONENT, MIN_EXPONENT};
use crate::bytes::read_u16;
use crate::error::{Error, Part};
use crate::format::ROW_BYTES;

/// Most rows of a brick.
pub const MAX_BRICK_ROWS: usize = 64;
/// Most voxels of a brick.
pub const MAX_BRICK_VOXELS: usize = 512;

/// One brick of a model.
#[derive(Clone, Copy, Debug)]
pub struct Brick<'a> {
    /// Voxel position of the brick's first corner.
    pub corner: [u16; 3],
    /// Number of its first stored voxel.
    pub first: usize,
    edge: u8,
    exponents: &'a [u8],
    rows: &'a [u8],
    means: &'a [u8],
    /// Those of the brick, and what lies behind in the file.
    basis: &'a [u8],
}

impl<'a> Brick<'a> {
    /// The brick whose record begins so, with its first corner and the number of its first stored voxel. `None` where the
    /// record is cut short.
    pub(crate) fn of_record(
        record: &'a [u8],
        modes: usize,
        edge: u8,
        (corner, first): ([u16; 3], usize),
    ) -> Option<Self> {
        let area = usize::from(edge) * usize::from(edge);
        let (exponents, record) = record.split_at_checked(modes)?;
        let (rows, record) = record.split_at_checked(ROW_BYTES * area)?;
        let last = rows.last_chunk::<ROW_BYTES>()?;
        let voxels = usize::from(read_u16(last, 1)) + last.first()?.count_ones() as usize;
        let (means, basis) = record.split_at_checked(2 * voxels)?;
        basis.get(..voxels * modes)?;
        Some(Self { corner, first, edge, exponents, rows, means, basis })
    }

    /// Bytes of its record.
    pub(crate) const fn record_bytes(&self) -> usize {
        let modes = self.exponents.len();
        modes + self.rows.len() + self.means.len() + self.voxels() * modes
    }

    /// Stored voxels.
    pub const fn voxels(&self) -> usize {
        self.means.len() / 2
    }

    /// Edge, voxels.
    pub const fn edge(&self) -> u8 {
        self.edge
    }

    /// The row along x at (y, z).
    #[inline]
    pub fn row(&self, y: u8, z: u8) -> Row {
        let at = (usize::from(z) * usize::from(self.edge) + usize::from(y)) * ROW_BYTES;
        let row = self.rows.get(at..).and_then(|rows| rows.first_chunk());
        row.map_or(Row::default(), |&[mask, low, high]| Row { mask, before: u16::from_le_bytes([low, high]) })
    }

    /// The stored voxels of the brick in order: number in the brick, and place in the grid.
    pub fn places(&self) -> impl Iterator<Item = (usize, [u16; 3])> + use<'a> {
        let (brick, edge) = (*self, self.edge);
        let rows = (0..edge).flat_map(move |z| (0..edge).map(move |y| (y, z)));
        rows.flat_map(move |(y, z)| {
            let row = brick.row(y, z);
            (0..edge).filter_map(move |x| {
                let [cx, cy, cz] = brick.corner;
                Some((row.voxel(x)?, [cx + u16::from(x), cy + u16::from(y), cz + u16::from(z)]))
            })
        })
    }

    /// Exponents E of the modes: b' = basis · 2^-E.
    pub const fn exponents(&self) -> &'a [u8] {
        self.exponents
    }

    /// The least exponent of the modes.
    pub fn least_exponent(&self) -> u8 {
        self.exponents.iter().fold(MAX_EXPONENT, |least, &exponent| least.min(exponent))
    }

    /// Mean distance of a voxel, 1/256 voxel.
    #[inline]
    pub fn mean(&self, voxel: usize) -> i16 {
        read_u16(self.means, 2 * voxel) as i16
    }

    /// Basis values of a voxel, one a mode, as the bytes of i8.
    #[inline]
    pub fn basis(&self, voxel: usize) -> &'a [u8] {
        let modes = self.exponents.len();
        let basis = self.basis.get(voxel * modes..).and_then(|b| b.get(..modes));
        basis.filter(|_| voxel < self.voxels()).unwrap_or(&[])
    }

    /// Basis values from a voxel on; behind them lies what is next in the file, mostly those of the next voxel.
    #[inline]
    pub fn basis_from(&self, voxel: usize) -> &'a [u8] {
        self.basis.get(voxel * self.exponents.len()..).unwrap_or(&[])
    }

    /// The stored voxels of every row, y fastest, in the beginning of `masks`.
    pub fn row_masks<'d>(&self, masks: &'d mut [u8; MAX_BRICK_ROWS]) -> &'d [u8] {
        let rows = self.rows.chunks_exact(ROW_BYTES);
        let count = rows.len();
        for (mask, row) in masks.iter_mut().zip(rows) {
            *mask = row.first().copied().unwrap_or(0);
        }
        masks.get(..count).unwrap_or(&[])
    }

    /// Whether its exponents and rows are what the format says.
    pub(crate) fn check(&self) -> Result<(), Error> {
        let good = |e: &u8| (MIN_EXPONENT..=MAX_EXPONENT).contains(e);
        if !self.exponents.iter().all(good) {
            return Err(Error::Inconsistent(Part::Brick));
        }
        let mut before = 0u32;
        for row in self.rows.chunks_exact(ROW_BYTES) {
            let mask = row.first().copied().unwrap_or(0);
            if u32::from(read_u16(row, 1)) != before || u32::from(mask) >> self.edge != 0 {
                return Err(Error::Inconsistent(Part::Brick));
            }
            before += mask.count_ones();
        }
        Ok(())
    }
}

/// Which voxels of a brick are stored.
#[derive(Clone, Copy, Debug)]
pub struct BrickRows<'a> {
    /// Voxel position of the brick's first corner.
    corner: [u16; 3],
    /// Number of its first stored voxel.
    first: usize,
    edge: u16,
    /// From its first row on.
    rows: &'a [u8],
}

impl<'a> BrickRows<'a> {
    /// Those of the brick whose rows begin so, with its first corner and the number of its first stored voxel.
    pub(crate) const fn new(rows: &'a [u8], edge: u16, (corner, first): ([u16; 3], usize)) -> Self {
        Self { corner, first, edge, rows }
    }

    /// Whether a voxel lies in the brick.
    #[inline(always)]
    pub fn covers(&self, [x, y, z]: [u16; 3]) -> bool {
        let [_, up, back] = self.corner;
        self.spans(x) && y.wrapping_sub(up) < self.edge && z.wrapping_sub(back) < self.edge
    }

    /// Whether voxels at `x` can lie in the brick.
    #[inline(always)]
    pub const fn spans(&self, x: u16) -> bool {
        let [left, ..] = self.corner;
        x.wrapping_sub(left) < self.edge
    }

    /// Number of the first stored voxel from a voxel on in its row of the brick, and a bit for each stored one, bit 0 for
    /// that voxel, which must be one that the brick covers.
    #[inline(always)]
    pub(crate) fn starting_at(&self, [x, y, z]: [u16; 3]) -> Option<(usize, u8)> {
        let [left, up, back] = self.corner;
        let (x, y, z) = (x - left, usize::from(y - up), usize::from(z - back));
        let rows = self.rows.get((z * usize::from(self.edge) + y) * ROW_BYTES..)?;
        let &[mask, low, high] = rows.first_chunk()?;
        let row = Row { mask, before: u16::from_le_bytes([low, high]) };
        Some((self.first + row.rank(x as u8), mask >> (x & 7)))
    }
}

/// The stored voxels of one row of a brick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Row {
    /// Bit x is set where voxel x of the row is stored.
    pub mask: u8,
    /// Voxels of the brick before this row.
    pub before: u16,
}

impl Row {
    /// Number within the brick of the voxel at `x`, if it is stored.
    #[inline]
    pub const fn voxel(self, x: u8) -> Option<usize> {
        if x > 7 || self.mask >> x & 1 == 0 { None } else { Some(self.rank(x)) }
    }

    /// Voxels of the brick before `x` of this row.
    #[inline]
    pub const fn rank(self, x: u8) -> usize {
        self.before as usize + ones(self.mask & ((1u16 << (x & 15)) - 1) as u8)
    }
}

/// Bits that are set. Most of the processors have no instruction for it, and a table is quicker than a dozen others.
#[inline]
pub const fn ones(mask: u8) -> usize {
    ONES[mask as usize] as usize
}

static ONES: [u8; 256] = {
    let mut ones = [0; 256];
    let mut mask = 0;
    while mask < 256 {
        ones[mask] = mask.count_ones() as u8;
        mask += 1;
    }
    ones
};
