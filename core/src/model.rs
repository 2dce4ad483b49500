//! The model, read in place: a view on bytes that may lie in flash at any alignment.
//!
//! [`Model::from_bytes`] checks everything once; the accessors cannot fail afterwards.

use crate::arithmetic::Stride;
use crate::brick::{Brick, BrickRows};
use crate::bytes::{read_u16, read_u32};
use crate::error::{Error, Part};
use crate::format::{
    ABSENT, CHECKSUM_AT, Calibration, ENTRY_BYTES, HEADER_LENGTH_AT, Header, Jitter, LENGTH_AT, MAGIC,
    MAX_MODE, MAX_MODES, MODE_BYTES, PER_VOXEL, PREFIX, Symmetry, UNKNOWN, VERSION, VERSION_AT, checksum,
    factor,
};
use crate::grid::{Grid, linear, position, product};
use crate::hull::Reach;

/// What may follow the header, behind it in the file; the first version has none of it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Extras<'a> {
    /// The plane the class is symmetric about, if it was trained with one. Version 2.
    pub symmetry: Option<Symmetry>,
    /// Constants of the expected error, if the trainer has fitted them. Version 2.
    pub calibration: Option<Calibration>,
    /// How far the training shapes lay from the pose they have in the model, if they were given in one frame and drawn
    /// to their mean. Version 3.
    pub jitter: Option<Jitter>,
    /// A byte a brick: the [`factor`] of its expected errors. Version 4.
    pub factors: Option<&'a [u8]>,
}

/// A shape model: mean M and whitened modes b' on a sparse band of voxels.
#[derive(Clone, Debug)]
pub struct Model<'a> {
    version: u16,
    header: Header<'a>,
    extras: Extras<'a>,
    grid: Grid,
    modes: &'a [u8],
    far: &'a [u8],
    map: &'a [u8],
    directory: &'a [u8],
    records: &'a [u8],
    checksum: u32,
}

/// Cuts `n` bytes off the front.
fn take<'a>(bytes: &mut &'a [u8], n: usize, part: Part) -> Result<&'a [u8], Error> {
    let (head, tail) = bytes.split_at_checked(n).ok_or(Error::Inconsistent(part))?;
    *bytes = tail;
    Ok(head)
}

impl<'a> Model<'a> {
    /// A view on a model file; see [`format`](crate::format) for its layout.
    ///
    /// # Errors
    /// Tells what is wrong: not a model, an unknown version, cut short, damaged, or inconsistent.
    pub fn from_bytes(file: &'a [u8]) -> Result<Self, Error> {
        let prefix: &[u8; PREFIX] = file.first_chunk().ok_or(Error::NotAModel)?;
        if !prefix.starts_with(&MAGIC) {
            return Err(Error::NotAModel);
        }
        let version = read_u16(prefix, VERSION_AT);
        if !(1..=VERSION).contains(&version) {
            return Err(Error::UnknownVersion { found: version });
        }
        let (expected, found) = (read_u32(prefix, LENGTH_AT), u32::try_from(file.len()).unwrap_or(u32::MAX));
        if expected != found {
            return Err(Error::WrongLength { expected, found });
        }
        let stored = read_u32(prefix, CHECKSUM_AT);
        if stored != checksum(file) {
            return Err(Error::Damaged);
        }
        let mut rest = file.get(PREFIX..).unwrap_or(&[]);
        let header = take(&mut rest, usize::from(read_u16(prefix, HEADER_LENGTH_AT)), Part::Header)?;
        let (header, extras) = read_header(version, header)?;
        let model = Self::from_parts(header, rest, stored)?;
        Ok(Self { version, extras, ..model })
    }

    /// A model of the first version: it is the newest one without what came later.
    fn from_parts(header: Header<'a>, mut rest: &'a [u8], checksum: u32) -> Result<Self, Error> {
        let grid = check_header(&header)?;
        let far_nodes = product(grid.node_sides(header.far_stride));
        let model = Self {
            version: 1,
            extras: Extras::default(),
            modes: take(&mut rest, usize::from(header.modes) * MODE_BYTES, Part::Modes)?,
            far: take(&mut rest, far_nodes * 2, Part::FarField)?,
            map: take(&mut rest, grid.brick_cells() * 2, Part::Map)?,
            directory: take(&mut rest, usize::from(header.bricks) * ENTRY_BYTES, Part::Directory)?,
            records: rest,
            header,
            grid,
            checksum,
        };
        model.check_modes()?;
        model.check_map()?;
        model.check_bricks()?;
        Ok(model)
    }

    /// What the model says about itself.
    pub const fn header(&self) -> &Header<'a> {
        &self.header
    }

    /// Version of the format it was read from.
    pub const fn version(&self) -> u16 {
        self.version
    }

    /// What follows the header.
    pub const fn extras(&self) -> &Extras<'a> {
        &self.extras
    }

    /// The plane the class is symmetric about, if it was trained with one.
    pub const fn symmetry(&self) -> Option<&Symmetry> {
        self.extras.symmetry.as_ref()
    }

    /// Constants of the expected error, if the trainer has fitted them.
    pub const fn calibration(&self) -> Option<&Calibration> {
        self.extras.calibration.as_ref()
    }

    /// How far the training shapes lay from the pose they have in the model, if they were given in one frame and
    /// drawn to their mean.
    pub const fn jitter(&self) -> Option<&Jitter> {
        self.extras.jitter.as_ref()
    }

    /// The factor of the expected error in brick number `index`, if the trainer has fitted one.
    pub fn factor(&self, index: usize) -> Option<f32> {
        self.extras.factors?.get(index).map(|&byte| factor(byte))
    }

    /// The voxel grid.
    pub const fn grid(&self) -> &Grid {
        &self.grid
    }

    /// CRC-32 of the file: the model's identity.
    pub const fn checksum(&self) -> u32 {
        self.checksum
    }

    /// Modes, K.
    pub const fn modes(&self) -> usize {
        self.header.modes as usize
    }

    /// Stored voxels.
    pub const fn voxels(&self) -> usize {
        self.header.voxels as usize
    }

    /// Root mean square over the band of one standard deviation of mode `k`, voxels.
    pub fn deviation(&self, k: usize) -> f32 {
        f32::from_bits(read_u32(self.modes, k * MODE_BYTES))
    }

    /// Gain g of mode `k`: (mean(s) / s_k)², at most [`MAX_MODE`].
    pub fn gain(&self, k: usize) -> f32 {
        f32::from_bits(read_u32(self.modes, k * MODE_BYTES + 4))
    }

    /// The bricks, in file order.
    pub fn bricks(&self) -> impl Iterator<Item = Brick<'a>> + use<'a, '_> {
        (0..usize::from(self.header.bricks)).filter_map(|index| self.brick(index))
    }

    /// Brick number `index`.
    pub fn brick(&self, index: usize) -> Option<Brick<'a>> {
        let entry = self.directory.chunks_exact(ENTRY_BYTES).nth(index)?;
        let edge = self.grid.brick();
        let cell = position(read_u32(entry, 0) as usize, self.grid.brick_sides());
        let corner = cell.map(|c| c.wrapping_mul(u16::from(edge)));
        let record = self.records.get(read_u32(entry, 8) as usize..)?;
        Brick::of_record(record, self.modes(), edge, (corner, read_u32(entry, 4) as usize))
    }

    /// The brick that covers a voxel position, if it is stored.
    #[inline]
    pub fn brick_at(&self, voxel: [u16; 3]) -> Option<Brick<'a>> {
        self.brick(self.brick_number(voxel)?)
    }

    /// The rows of the brick that covers a voxel position, if it is stored: a part of what [`Model::brick_at`] tells.
    #[inline]
    pub fn rows_at(&self, voxel: [u16; 3]) -> Option<BrickRows<'a>> {
        let edge = u16::from(self.grid.brick());
        let corner = voxel.map(|v| v - v.checked_rem(edge).unwrap_or(0));
        let entry = self.directory.get(self.brick_number(voxel)? * ENTRY_BYTES..)?;
        let rows = self.records.get(read_u32(entry, 8) as usize + self.modes()..)?;
        Some(BrickRows::new(rows, edge, (corner, read_u32(entry, 4) as usize)))
    }

    /// Number of the brick that covers a voxel position, if it is stored.
    #[inline]
    pub fn brick_number(&self, voxel: [u16; 3]) -> Option<usize> {
        let edge = u16::from(self.grid.brick());
        self.brick_of_cell(voxel.map(|v| v.checked_div(edge).unwrap_or(0)))
    }

    /// Number of the brick at a position of the grid of bricks, if it is stored.
    #[inline]
    pub fn brick_of_cell(&self, cell: [u16; 3]) -> Option<usize> {
        let sides = self.grid.brick_sides();
        if cell.iter().zip(sides).any(|(&c, side)| c >= side) {
            return None;
        }
        let number = read_u16(self.map, 2 * linear(cell, sides));
        (number != ABSENT).then_some(usize::from(number))
    }

    /// Far field distance at a far node, voxels; `None` off the support or outside the grid.
    pub fn far(&self, node: [u16; 3]) -> Option<f32> {
        let sides = self.grid.node_sides(self.header.far_stride);
        if node.iter().zip(sides).any(|(&n, side)| n >= side) {
            return None;
        }
        let value = read_u16(self.far, 2 * linear(node, sides)) as i16;
        (value != UNKNOWN).then(|| f32::from(value) / PER_VOXEL)
    }

    fn check_modes(&self) -> Result<(), Error> {
        let good = |x: f32| x > 0.0 && x <= MAX_MODE;
        let all = (0..self.modes()).all(|k| good(self.deviation(k)) && good(self.gain(k)));
        if all { Ok(()) } else { Err(Error::Inconsistent(Part::Modes)) }
    }

    fn check_map(&self) -> Result<(), Error> {
        let mut stored = 0usize;
        for (cell, entry) in self.map.chunks_exact(2).enumerate() {
            let number = read_u16(entry, 0);
            if number == ABSENT {
                continue;
            }
            let listed = read_u32(self.directory, usize::from(number) * ENTRY_BYTES) as usize;
            if number >= self.header.bricks || listed != cell {
                return Err(Error::Inconsistent(Part::Map));
            }
            stored += 1;
        }
        if stored == usize::from(self.header.bricks) { Ok(()) } else { Err(Error::Inconsistent(Part::Map)) }
    }

    fn check_bricks(&self) -> Result<(), Error> {
        let (mut first, mut offset) = (0usize, 0usize);
        let cells = self.directory.chunks_exact(ENTRY_BYTES).map(|entry| read_u32(entry, 0));
        if !cells.is_sorted_by(|a, b| a < b) {
            return Err(Error::Inconsistent(Part::Directory));
        }
        for (index, entry) in self.directory.chunks_exact(ENTRY_BYTES).enumerate() {
            let brick = self.brick(index).ok_or(Error::Inconsistent(Part::Brick))?;
            if brick.first != first || read_u32(entry, 8) as usize != offset {
                return Err(Error::Inconsistent(Part::Directory));
            }
            brick.check()?;
            first = first.saturating_add(brick.voxels());
            offset = offset.saturating_add(brick.record_bytes());
        }
        if first != self.voxels() || offset != self.records.len() {
            return Err(Error::Inconsistent(Part::Directory));
        }
        Ok(())
    }
}

/// Everything from all bytes of a header.
fn read_header(version: u16, bytes: &[u8]) -> Result<(Header<'_>, Extras<'_>), Error> {
    let bad = Error::Inconsistent(Part::Header);
    let (header, mut unread): (Header<'_>, _) = postcard::take_from_bytes(bytes).map_err(|_| bad)?;
    let mut extras = Extras::default();
    if version > 1 {
        ((extras.symmetry, extras.calibration), unread) =
            postcard::take_from_bytes(unread).map_err(|_| bad)?;
    }
    if version > 2 {
        (extras.jitter, unread) = postcard::take_from_bytes(unread).map_err(|_| bad)?;
    }
    if version > 3 {
        (extras.factors, unread) = postcard::take_from_bytes(unread).map_err(|_| bad)?;
    }
    let sound = extras.symmetry.as_ref().is_none_or(Symmetry::is_sound)
        && extras.calibration.as_ref().is_none_or(Calibration::is_sound)
        && extras.jitter.as_ref().is_none_or(Jitter::is_sound)
        && extras.factors.is_none_or(|factors| factors.len() == usize::from(header.bricks));
    if unread.is_empty() && sound { Ok((header, extras)) } else { Err(bad) }
}

fn check_header(header: &Header<'_>) -> Result<Grid, Error> {
    let grid = Grid::new(header.sides, header.brick)?;
    let finite = header.spacing.is_finite() && header.origin.iter().all(|o| o.is_finite());
    let divides = |stride: u8| stride != 0 && header.brick.is_multiple_of(stride);
    if !finite || header.spacing <= 0.0 || !divides(header.far_stride) || !divides(header.stride) {
        return Err(Error::Inconsistent(Part::Grid));
    }
    if Stride::new(header.stride).is_none() || header.modes == 0 || header.modes > MAX_MODES {
        return Err(Error::Inconsistent(Part::Header));
    }
    let s = &header.scales;
    let within = |x: f32, low: f32, high: f32| x.is_finite() && x >= low && x <= high;
    let good = within(s.millimetre, 1e-3, 64.0)
        && within(s.front, 0.5, f32::from(Reach::MOST_FRONT) / PER_VOXEL)
        && within(s.behind, 0.25, s.front)
        && [s.global_ridge, s.local_ridge, s.voxel_ridge].iter().all(|&r| within(r, 1e-6, 1e3));
    if good { Ok(grid) } else { Err(Error::Inconsistent(Part::Scales)) }
}
