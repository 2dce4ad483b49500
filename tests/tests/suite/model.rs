//! The model file: every kind of damage is refused, and any alignment will do.

use lacuna::format::{CHECKSUM_AT, PREFIX, VERSION, checksum};
use lacuna::nodes::{Extent, NodeMap, map_len};
use lacuna::{Error, Model};
use lacuna_fixtures::MODEL;
use lacuna_host::synth::Random;
use lacuna_tests::default_schedule;

/// Positions in the model: all of the beginning and the end, and a sample of the rest.
fn positions(sampled: usize) -> Vec<usize> {
    let mut random = Random::new(5, 0);
    let mut positions: Vec<usize> = (0..64).chain(MODEL.len() - 64..MODEL.len()).collect();
    positions.extend((0..sampled).map(|_| (random.unit() * MODEL.len() as f64) as usize));
    positions
}

#[test]
fn every_flipped_bit_is_refused() {
    let mut bytes = MODEL.to_vec();
    let mut random = Random::new(6, 0);
    for at in positions(1900) {
        let bit = 1 << (random.unit() * 8.0) as u8;
        bytes[at] ^= bit;
        let error = Model::from_bytes(&bytes).expect_err("a flipped bit");
        if at >= PREFIX {
            assert_eq!(error, Error::Damaged, "byte {at}");
        }
        bytes[at] ^= bit;
    }
    assert!(Model::from_bytes(&bytes).is_ok());
}

#[test]
fn active_nodes_are_counted_without_a_buffer_as_with_one() {
    let model = lacuna_tests::model();
    let dividing = (1..=4).filter(|&stride| model.grid().brick().is_multiple_of(stride));
    for stride in dividing {
        let mut words = vec![0; map_len(model.grid().nodes(stride))];
        let nodes = NodeMap::new(&model, stride, &mut words).unwrap();
        let layers = (0..nodes.sides()[2]).map(|z| nodes.before(z + 1) - nodes.before(z));
        let widest = layers.max().unwrap();
        assert_eq!(Extent::of(&model, stride), Extent { active: nodes.active(), widest }, "stride {stride}");
    }
}

#[test]
fn places_are_those_of_the_stored_voxels_in_their_order() {
    let model = lacuna_tests::model();
    let mut all = std::collections::BTreeSet::new();
    for brick in model.bricks() {
        let places: Vec<(usize, [u16; 3])> = brick.places().collect();
        assert!(places.iter().map(|(voxel, _)| *voxel).eq(0..brick.voxels()));
        for (_, place) in places {
            assert_eq!(model.brick_at(place).map(|found| found.corner), Some(brick.corner));
            assert!(all.insert(place), "{place:?} twice");
        }
    }
    assert_eq!(all.len(), model.voxels());
}

#[test]
fn every_truncation_is_refused() {
    for length in positions(1000) {
        let found = length as u32;
        let expected = MODEL.len() as u32;
        let error = if length < PREFIX { Error::NotAModel } else { Error::WrongLength { expected, found } };
        assert_eq!(Model::from_bytes(&MODEL[..length]).expect_err("a short file"), error);
    }
}

#[test]
fn bytes_behind_the_end_are_refused() {
    let longer = [MODEL, &[0]].concat();
    assert!(matches!(Model::from_bytes(&longer), Err(Error::WrongLength { .. })));
}

#[test]
fn other_versions_are_refused_by_name() {
    for found in [0, VERSION + 1, 0x0100, u16::MAX] {
        let mut bytes = MODEL.to_vec();
        bytes[8..10].copy_from_slice(&found.to_le_bytes());
        let sum = checksum(&bytes);
        bytes[CHECKSUM_AT..PREFIX].copy_from_slice(&sum.to_le_bytes());
        assert_eq!(Model::from_bytes(&bytes).unwrap_err(), Error::UnknownVersion { found });
    }
}

/// A forged checksum lets contradictions through to the checks behind it: they must refuse or accept, not panic.
#[test]
fn damage_with_a_matching_checksum_never_panics() {
    let mut bytes = MODEL.to_vec();
    let mut random = Random::new(7, 0);
    let early = (0..300).map(|i| PREFIX + i);
    for at in early.chain(positions(200)).filter(|&at| at >= PREFIX) {
        let before = bytes[at];
        bytes[at] ^= 1 << (random.unit() * 8.0) as u8;
        let sum = checksum(&bytes);
        bytes[CHECKSUM_AT..PREFIX].copy_from_slice(&sum.to_le_bytes());
        if let Ok(model) = Model::from_bytes(&bytes) {
            assert_eq!(model.bricks().map(|brick| brick.voxels()).sum::<usize>(), model.voxels());
        }
        bytes[at] = before;
    }
}

#[test]
fn any_alignment_reads_the_same() {
    let aligned = Model::from_bytes(MODEL).unwrap();
    for offset in 1..4 {
        let mut moved = vec![0; offset];
        moved.extend_from_slice(MODEL);
        let model = Model::from_bytes(&moved[offset..]).unwrap();
        assert_eq!(model.header(), aligned.header());
        assert_eq!(model.checksum(), aligned.checksum());
        let sizes = |model| lacuna::Sizes::required(model, &default_schedule(model)).unwrap();
        assert_eq!(sizes(&model), sizes(&aligned));
        for k in 0..model.modes() {
            assert_eq!((model.deviation(k), model.gain(k)), (aligned.deviation(k), aligned.gain(k)));
        }
        for (a, b) in model.bricks().zip(aligned.bricks()) {
            assert_eq!((a.corner, a.first, a.exponents()), (b.corner, b.first, b.exponents()));
            assert!((0..a.voxels()).all(|v| (a.mean(v), a.basis(v)) == (b.mean(v), b.basis(v))));
        }
    }
}
