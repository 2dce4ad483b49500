//! Quantises a trained model and lays it out as a file: the writing side of [`lacuna::format`].

use super::Error;
use crate::volume::Lattice;
use lacuna::Model;
use lacuna::arithmetic::{MAX_EXPONENT, MIN_EXPONENT};
use lacuna::error::Part;
use lacuna::format::{
    ABSENT, CHECKSUM_AT, Calibration, HEADER_LENGTH_AT, Header, LENGTH_AT, MAGIC, MAX_MODE, PER_VOXEL,
    PREFIX, UNKNOWN, VERSION, checksum,
};
use lacuna::model::Extras;
use std::collections::BTreeMap;

/// Bricks whose factors a header has room for: its length is a number of 16 bits.
const MOST_FACTORS: usize = 60_000;

/// A model in floating point, lengths in voxels.
pub struct Draft<'a> {
    /// What the file says about itself; counts of bricks and voxels are filled in here.
    pub header: Header<'a>,
    /// What follows the header.
    pub extras: Extras<'a>,
    /// The grid.
    pub lattice: Lattice,
    /// Places of the stored voxels.
    pub voxels: Vec<u32>,
    /// Mean distance of each stored voxel.
    pub mean: Vec<f32>,
    /// Whitened modes at each stored voxel.
    pub modes: Vec<Vec<f32>>,
    /// Mean distance at the far nodes, `None` off the support.
    pub far: Vec<Option<f32>>,
}

/// The model file.
///
/// # Errors
/// [`Error::TooManyBricks`], [`Error::TooManyBytes`].
pub fn encode(draft: &Draft<'_>) -> Result<Vec<u8>, Error> {
    let bricks = group(draft);
    if bricks.len() >= usize::from(ABSENT) {
        return Err(Error::TooManyBricks(bricks.len()));
    }
    let mut header = draft.header.clone();
    header.bricks = bricks.len() as u16;
    header.voxels = draft.voxels.len() as u32;
    let mut file = head(&header, &draft.extras);
    write_modes(draft, &mut file);
    for value in &draft.far {
        file.extend(value.map_or(UNKNOWN, distance).to_le_bytes());
    }
    write_bricks(draft, &bricks, &mut file);
    // No place in a file that is short enough is too far off to be written either.
    if u32::try_from(file.len()).is_err() {
        return Err(Error::TooManyBytes(file.len()));
    }
    Ok(sealed(file))
}

/// The same model with another calibration of the expected error, and with factors a brick if there are some; none of
/// its other bytes changes. A header holds factors for `MOST_FACTORS` bricks.
///
/// # Errors
/// Bytes that are no model, another number of factors than of bricks, or constants that the core does not read.
pub fn calibrated(
    file: &[u8],
    calibration: &Calibration,
    factors: Option<&[u8]>,
) -> Result<Vec<u8>, lacuna::Error> {
    let model = Model::from_bytes(file)?;
    if factors.is_some_and(|factors| factors.len() != usize::from(model.header().bricks)) {
        return Err(lacuna::Error::Inconsistent(Part::Header));
    }
    let length = file.get(HEADER_LENGTH_AT..).and_then(|bytes| bytes.first_chunk());
    let length = length.map_or(0, |&bytes| usize::from(u16::from_le_bytes(bytes)));
    let rest = file.get(PREFIX + length..).unwrap_or(&[]);
    let factors = factors.filter(|factors| factors.len() <= MOST_FACTORS);
    let extras = Extras { calibration: Some(*calibration), factors, ..*model.extras() };
    let file = sealed([&head(model.header(), &extras), rest].concat());
    Model::from_bytes(&file)?;
    Ok(file)
}

/// The first bytes of a file, length and checksum still open.
fn head(header: &Header<'_>, extras: &Extras<'_>) -> Vec<u8> {
    let Extras { symmetry, calibration, jitter, factors } = extras;
    let header = postcard::to_allocvec(&(header, symmetry, calibration, jitter, factors));
    let header = header.expect("a header has nothing that cannot be written");
    let mut file = Vec::new();
    file.extend(MAGIC);
    file.extend(VERSION.to_le_bytes());
    file.extend((header.len() as u16).to_le_bytes());
    file.extend([0; PREFIX - LENGTH_AT]);
    file.extend(header);
    file
}

/// The file with its length and checksum.
fn sealed(mut file: Vec<u8>) -> Vec<u8> {
    let length = file.len() as u32;
    file[LENGTH_AT..CHECKSUM_AT].copy_from_slice(&length.to_le_bytes());
    let sum = checksum(&file);
    file[CHECKSUM_AT..PREFIX].copy_from_slice(&sum.to_le_bytes());
    file
}

/// 1/256 voxel, short of the value that means "unknown".
fn distance(voxels: f32) -> i16 {
    (voxels * PER_VOXEL).round().clamp(-32767.0, 32767.0) as i16
}

/// Stored voxels (numbers in the draft) of each brick cell, in row order.
fn group(draft: &Draft<'_>) -> BTreeMap<usize, Vec<usize>> {
    let edge = usize::from(draft.header.brick);
    let cells = draft.lattice.sides.map(|side| side / edge);
    let mut bricks: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for (number, &place) in draft.voxels.iter().enumerate() {
        let [x, y, z] = draft.lattice.voxel(place as usize).map(|v| v / edge);
        bricks.entry((z * cells[1] + y) * cells[0] + x).or_default().push(number);
    }
    bricks
}

fn write_modes(draft: &Draft<'_>, file: &mut Vec<u8>) {
    let deviations: Vec<f64> = draft.modes.iter().map(|mode| root_mean_square(mode)).collect();
    let mean = deviations.iter().sum::<f64>() / deviations.len().max(1) as f64;
    for deviation in deviations {
        let ratio = mean / deviation;
        file.extend((deviation as f32).to_le_bytes());
        file.extend(((ratio * ratio).min(f64::from(MAX_MODE)) as f32).to_le_bytes());
    }
}

fn root_mean_square(values: &[f32]) -> f64 {
    let sum: f64 = values.iter().map(|&v| f64::from(v) * f64::from(v)).sum();
    (sum / values.len().max(1) as f64).sqrt()
}

fn write_bricks(draft: &Draft<'_>, bricks: &BTreeMap<usize, Vec<usize>>, file: &mut Vec<u8>) {
    let edge = usize::from(draft.header.brick);
    let cells: usize = draft.lattice.sides.iter().map(|side| side / edge).product();
    let mut map = vec![ABSENT; cells];
    let (mut directory, mut records, mut first) = (Vec::new(), Vec::new(), 0u32);
    for (number, (&cell, voxels)) in bricks.iter().enumerate() {
        map[cell] = number as u16;
        for entry in [cell as u32, first, records.len() as u32] {
            directory.extend(entry.to_le_bytes());
        }
        first += voxels.len() as u32;
        write_brick(draft, voxels, &mut records);
    }
    map.iter().for_each(|entry| file.extend(entry.to_le_bytes()));
    file.extend(directory);
    file.extend(records);
}

fn write_brick(draft: &Draft<'_>, voxels: &[usize], out: &mut Vec<u8>) {
    let exponents: Vec<u8> = draft.modes.iter().map(|mode| exponent(mode, voxels)).collect();
    out.extend(&exponents);
    let edge = usize::from(draft.header.brick);
    let mut masks = vec![0u8; edge * edge];
    for &v in voxels {
        let [x, y, z] = draft.lattice.voxel(draft.voxels[v] as usize).map(|c| c % edge);
        masks[z * edge + y] |= 1 << x;
    }
    let mut before = 0u16;
    for mask in masks {
        out.push(mask);
        out.extend(before.to_le_bytes());
        before += mask.count_ones() as u16;
    }
    for &v in voxels {
        out.extend(distance(draft.mean[v]).to_le_bytes());
    }
    for &v in voxels {
        let quantised = |(mode, &e): (&Vec<f32>, &u8)| {
            (mode[v] * f32::from(2u16.pow(u32::from(e)))).round().clamp(-127.0, 127.0) as i8 as u8
        };
        out.extend(draft.modes.iter().zip(&exponents).map(quantised));
    }
}

/// The largest exponent that keeps a mode of a brick within i8.
fn exponent(mode: &[f32], voxels: &[usize]) -> u8 {
    let largest = voxels.iter().map(|&v| mode[v].abs()).fold(0.0f32, f32::max);
    let fits = |e: &u8| largest * f32::from(2u16.pow(u32::from(*e))) <= 127.0;
    (MIN_EXPONENT..=MAX_EXPONENT).rev().find(fits).unwrap_or(MIN_EXPONENT)
}
