//! Models of all versions keep being read, to the same numbers; whatever is damaged or lies is refused.

use lacuna::digest::Digest;
use lacuna::error::Part;
use lacuna::format::{CHECKSUM_AT, Calibration, Header, PREFIX, VERSION, checksum};
use lacuna::{Error, Fixed, Model};
use lacuna_fixtures::VERSIONS;
use lacuna_host::train::model_file::calibrated;
use lacuna_tests::fuzz::fit::completed;
use lacuna_tests::fuzz::model::{forge, walk};
use lacuna_tests::fuzz::tiny::tiny;
use std::collections::BTreeSet;

/// The newest model: a few kilobytes, so that every bit of it can be tried.
fn newest() -> &'static [u8] {
    VERSIONS.last().expect("a version").model
}

/// CRC-32 of all that a model says, through its accessors: independent of how the file is laid out.
fn contents(model: &Model<'_>) -> u32 {
    let mut digest = Digest::new();
    let mut add = |bytes: &[u8]| digest.add(bytes);
    let h = model.header();
    let scales = [
        h.scales.millimetre,
        h.scales.front,
        h.scales.behind,
        h.scales.global_ridge,
        h.scales.local_ridge,
        h.scales.voxel_ridge,
    ];
    add(format!("{} {} {} {:?} {:?}", h.class, h.made, h.shapes, h.unit, h.sides).as_bytes());
    add(&[h.brick, h.far_stride, h.stride, h.modes]);
    add(format!("{} {}", h.bricks, h.voxels).as_bytes());
    let gains = (0..model.modes()).flat_map(|k| [model.deviation(k), model.gain(k)]);
    let numbers = [h.spacing, h.explained].into_iter().chain(h.origin).chain(scales).chain(gains);
    numbers.for_each(|number| add(&number.to_le_bytes()));
    let [nx, ny, nz] = model.grid().node_sides(h.far_stride);
    for (z, y, x) in (0..nz).flat_map(|z| (0..ny).flat_map(move |y| (0..nx).map(move |x| (z, y, x)))) {
        add(&model.far([x, y, z]).unwrap_or(f32::INFINITY).to_le_bytes());
    }
    for brick in model.bricks() {
        brick.corner.iter().for_each(|c| add(&c.to_le_bytes()));
        add(brick.exponents());
        for (z, y) in (0..brick.edge()).flat_map(|z| (0..brick.edge()).map(move |y| (z, y))) {
            add(&[brick.row(y, z).mask]);
        }
        for voxel in 0..brick.voxels() {
            add(&brick.mean(voxel).to_le_bytes());
            add(brick.basis(voxel));
        }
    }
    if let Some(plane) = model.symmetry() {
        let numbers = plane.normal.into_iter().chain([plane.offset, plane.deviation]);
        numbers.for_each(|number| digest.add(&number.to_le_bytes()));
    }
    if let Some(c) = model.calibration() {
        digest.add(&c.scans.to_le_bytes());
        let numbers = [c.noise, c.seam, c.posterior, c.posterior_way, c.residual, c.residual_way];
        c.shares.into_iter().chain(numbers).for_each(|number| digest.add(&number.to_le_bytes()));
    }
    if let Some(j) = model.jitter() {
        [j.turn, j.shift, j.growth].into_iter().for_each(|number| digest.add(&number.to_le_bytes()));
    }
    (0..usize::from(h.bricks))
        .filter_map(|brick| model.factor(brick))
        .for_each(|factor| digest.add(&factor.to_le_bytes()));
    digest.value()
}

#[test]
fn every_version_is_read_to_the_numbers_it_was_written_with() {
    for (version, expected) in VERSIONS.iter().zip(1..) {
        let found = u16::from_le_bytes([version.model[8], version.model[9]]);
        assert_eq!((version.number, found), (expected, expected), "in order, none left out");
        assert!(version.model.len() < 60_000);
        let model = Model::from_bytes(version.model).unwrap();
        walk(&model);
        assert_eq!(contents(&model), version.contents, "version {expected}: {:#010x}", contents(&model));
        let (scan, settings) = (&tiny().scan, tiny().scan.begin.settings(&model));
        let cloud = lacuna::Cloud::new(&scan.points, scan.begin.step).unwrap();
        let (outcome, _) = completed::<Fixed>(&model, cloud, scan.begin.pose, settings, 0).unwrap();
        assert!(outcome.inliers > scan.begin.points / 2, "{outcome:?}");
        assert_eq!(model.version(), expected);
        assert_eq!(model.calibration().is_some(), expected > 1, "the first version has none");
        assert_eq!(model.symmetry().is_some(), expected > 1, "the first version has none");
        assert_eq!(model.jitter().is_some(), expected > 2, "the first two versions have none");
        assert_eq!(model.factor(0).is_some(), expected > 3, "the first three versions have none");
    }
    assert_eq!(VERSIONS.len(), usize::from(VERSION), "the version that is written has a model here");
}

#[test]
fn every_other_version_is_refused_by_its_name() {
    let mut bytes = newest().to_vec();
    for found in (0..=u16::MAX).filter(|found| VERSIONS.iter().all(|version| version.number != *found)) {
        bytes[8..10].copy_from_slice(&found.to_le_bytes());
        assert_eq!(Model::from_bytes(&bytes).unwrap_err(), Error::UnknownVersion { found });
    }
    let sentence = lacuna_host::sentence::sentence("the model", &Error::UnknownVersion { found: 7 });
    assert!(sentence.contains('7'), "{sentence}");
}

#[test]
fn every_flipped_bit_of_every_byte_is_refused() {
    let mut bytes = newest().to_vec();
    let mut codes = BTreeSet::new();
    for (at, bit) in (0..bytes.len()).flat_map(|at| (0..8).map(move |bit| (at, bit))) {
        bytes[at] ^= 1 << bit;
        let error = Model::from_bytes(&bytes).expect_err("a flipped bit");
        assert!(at < PREFIX || error == Error::Damaged, "byte {at}: {error:?}");
        codes.insert(postcard::to_slice(&error, &mut [0; 16]).unwrap()[0]);
        bytes[at] ^= 1 << bit;
    }
    assert!(codes.len() >= 4, "as a device tells them, magic, version, length, checksum: {codes:?}");
}

#[test]
fn every_truncation_is_refused_even_when_length_and_checksum_agree_with_it() {
    for length in 0..newest().len() {
        let mut bytes = newest()[..length].to_vec();
        let (expected, found) = (newest().len() as u32, length as u32);
        let short = if length < PREFIX { Error::NotAModel } else { Error::WrongLength { expected, found } };
        assert_eq!(Model::from_bytes(&bytes).expect_err("a short file"), short);
        if forge(&mut bytes) {
            let error = Model::from_bytes(&bytes).expect_err("a short file that says so");
            assert!(matches!(error, Error::Inconsistent(_)), "{length}: {error:?}");
        }
    }
}

/// A model of the newest version with another header and a checksum that agrees.
pub fn with_header(file: &[u8], change: &dyn Fn(&mut Header<'_>)) -> Vec<u8> {
    let length = usize::from(u16::from_le_bytes([file[10], file[11]]));
    let (head, rest) = file[PREFIX..].split_at(length);
    let (mut header, others): (Header<'_>, &[u8]) = postcard::take_from_bytes(head).unwrap();
    change(&mut header);
    let mut room = [0; 1024];
    let head = postcard::to_slice(&header, &mut room).unwrap();
    let mut bytes = [&file[..PREFIX], head, others, rest].concat();
    bytes[10..12].copy_from_slice(&((head.len() + others.len()) as u16).to_le_bytes());
    assert!(forge(&mut bytes));
    bytes
}

#[test]
fn a_header_that_lies_about_what_follows_is_refused() {
    Model::from_bytes(&with_header(newest(), &|_| ())).expect("the truth");
    type Lie = (&'static str, fn(&mut Header<'_>));
    let lies: [Lie; 30] = [
        ("a side more", |h| h.sides[0] += u16::from(h.brick)),
        ("a side less", |h| h.sides[1] -= u16::from(h.brick)),
        ("sides exchanged", |h| h.sides.copy_from_slice(&[8, 16, 32])),
        ("no side", |h| h.sides[2] = 0),
        ("a side that is no whole brick", |h| h.sides[2] += 1),
        ("the longest sides", |h| h.sides = [u16::MAX; 3]),
        ("long sides", |h| h.sides = [1024; 3]),
        ("a smaller brick", |h| h.brick /= 2),
        ("no brick", |h| h.brick = 0),
        ("a large brick", |h| h.brick = 255),
        ("another far field", |h| h.far_stride /= 2),
        ("no far field", |h| h.far_stride = 0),
        ("no stride", |h| h.stride = 0),
        ("a stride of 8", |h| h.stride = 8),
        ("a mode more", |h| h.modes += 1),
        ("a mode less", |h| h.modes -= 1),
        ("no mode", |h| h.modes = 0),
        ("most modes", |h| h.modes = 255),
        ("a brick more", |h| h.bricks += 1),
        ("a brick less", |h| h.bricks -= 1),
        ("most bricks", |h| h.bricks = u16::MAX),
        ("a voxel more", |h| h.voxels += 1),
        ("a voxel less", |h| h.voxels -= 1),
        ("most voxels", |h| h.voxels = u32::MAX),
        ("no spacing", |h| h.spacing = 0.0),
        ("a spacing that is no number", |h| h.spacing = f32::NAN),
        ("an origin far off", |h| h.origin[1] = f32::INFINITY),
        ("a hull too deep", |h| h.scales.front = 7.6),
        ("a ridge that is no number", |h| h.scales.local_ridge = f32::NAN),
        ("a negative ridge", |h| h.scales.voxel_ridge = -1.0),
    ];
    for (what, lie) in lies {
        let error = Model::from_bytes(&with_header(newest(), &lie)).expect_err(what);
        assert!(matches!(error, Error::Inconsistent(_)), "{what}: {error:?}");
    }
}

/// The newest model with another calibration, read back by the core.
fn with_calibration(change: &dyn Fn(&mut Calibration)) -> Result<Vec<u8>, Error> {
    let model = Model::from_bytes(newest()).unwrap();
    let mut calibration = *model.calibration().expect("a calibration");
    change(&mut calibration);
    calibrated(newest(), &calibration, model.extras().factors)
}

#[test]
fn a_calibration_that_states_no_errors_is_refused() {
    assert_eq!(with_calibration(&|_| ()).as_deref(), Ok(newest()));
    type Lie = (&'static str, fn(&mut Calibration));
    let lies: [Lie; 6] = [
        ("a share above one", |c| c.shares[1] = 1.01),
        ("a negative error", |c| c.seam = -0.1),
        ("an error that is no number", |c| c.noise = f32::NAN),
        ("an endless error", |c| c.residual = f32::INFINITY),
        ("no way", |c| c.posterior_way = 0.0),
        ("a negative way", |c| c.residual_way = -1.0),
    ];
    for (what, lie) in lies {
        assert_eq!(with_calibration(&lie), Err(Error::Inconsistent(Part::Header)), "{what}");
    }
}

#[test]
fn factors_for_another_number_of_bricks_are_refused() {
    let model = Model::from_bytes(newest()).unwrap();
    let (calibration, factors) = (model.calibration().unwrap(), model.extras().factors.unwrap());
    let other = [factors, &[128]].concat();
    for factors in [&other[..], &factors[1..], &[]] {
        let error = calibrated(newest(), calibration, Some(factors)).unwrap_err();
        assert_eq!(error, Error::Inconsistent(Part::Header));
    }
    let file = newest();
    let end = PREFIX + usize::from(u16::from_le_bytes([file[10], file[11]]));
    // A factor less in the list, a byte less in the header.
    let mut bytes = [&file[..end - 1], &file[end..]].concat();
    bytes[10..12].copy_from_slice(&((end - 1 - PREFIX) as u16).to_le_bytes());
    bytes[end - 1 - factors.len()] -= 1;
    assert!(forge(&mut bytes));
    assert_eq!(Model::from_bytes(&bytes).unwrap_err(), Error::Inconsistent(Part::Header));
}

#[test]
fn a_jitter_that_ties_nothing_is_refused() {
    let file = newest();
    let end = PREFIX + usize::from(u16::from_le_bytes([file[10], file[11]]));
    // The last numbers of the header: turn, shift and growth; behind them a byte a brick, their number, and that there
    // are some.
    let bricks = Model::from_bytes(file).unwrap().bricks().count();
    let end = end - bricks - 2;
    for (place, lie) in [(0, 0.0), (1, -1.0), (2, f32::NAN), (1, f32::INFINITY)] {
        let mut bytes = file.to_vec();
        let at = end - 12 + 4 * place;
        bytes[at..at + 4].copy_from_slice(&f32::to_le_bytes(lie));
        assert!(forge(&mut bytes));
        assert_eq!(Model::from_bytes(&bytes).unwrap_err(), Error::Inconsistent(Part::Header), "{lie}");
    }
}

/// A version with the number of an older one is a model whose header ends too late, or too soon the other way round.
#[test]
fn a_version_is_not_read_as_another() {
    for (version, other) in [(0, 2u16), (1, 1), (1, 3), (2, 1), (2, 2), (2, 4), (3, 3)] {
        let mut bytes = VERSIONS[version].model.to_vec();
        bytes[8..10].copy_from_slice(&other.to_le_bytes());
        let sum = checksum(&bytes);
        bytes[CHECKSUM_AT..PREFIX].copy_from_slice(&sum.to_le_bytes());
        assert_eq!(Model::from_bytes(&bytes).unwrap_err(), Error::Inconsistent(Part::Header));
    }
}

#[test]
fn a_header_longer_or_shorter_than_its_fields_is_refused() {
    let file = newest();
    let length = u16::from_le_bytes([file[10], file[11]]);
    for stated in (0..=u16::MAX).filter(|stated| *stated != length) {
        let mut bytes = file.to_vec();
        bytes[10..12].copy_from_slice(&stated.to_le_bytes());
        // The checksum is not worth its time where the bytes end before the header does.
        if stated < file.len() as u16 {
            assert!(forge(&mut bytes));
        }
        Model::from_bytes(&bytes).expect_err("another length of the header");
    }
    let mut longer =
        [&file[..PREFIX + usize::from(length)], &[0], &file[PREFIX + usize::from(length)..]].concat();
    longer[10..12].copy_from_slice(&(length + 1).to_le_bytes());
    assert!(forge(&mut longer));
    Model::from_bytes(&longer).expect_err("a byte nobody reads");
}

/// Any value in any byte up to the first record, with a checksum that agrees: refused, or a model without a
/// contradiction in it.
#[test]
fn any_byte_of_the_tables_may_lie_without_harm() {
    let file = newest();
    let header = usize::from(u16::from_le_bytes([file[10], file[11]]));
    let mut bytes = file.to_vec();
    let (mut accepted, mut refused) = (0, 0);
    let tables = (PREFIX..PREFIX + header + 200).chain((PREFIX..file.len()).step_by(37));
    for (at, value) in tables.flat_map(|at| [0, 1, 2, 0x7f, 0x80, 0xfe, 0xff].map(|value| (at, value))) {
        let before = std::mem::replace(&mut bytes[at], value);
        let sum = checksum(&bytes);
        bytes[CHECKSUM_AT..PREFIX].copy_from_slice(&sum.to_le_bytes());
        match Model::from_bytes(&bytes) {
            Ok(model) => {
                walk(&model);
                accepted += 1;
            }
            Err(_) => refused += 1,
        }
        bytes[at] = before;
    }
    println!("{accepted} accepted, {refused} refused");
    assert!(refused > 100);
}
