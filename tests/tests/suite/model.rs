//! The model file: bricks and nodes are where it says, and any alignment will do. Damage is tried on the smaller models of
//! `versions`.

use lacuna::nodes::{Extent, NodeMap, map_len};
use lacuna::{Error, Model, Schedule};
use lacuna_fixtures::MODEL;

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
fn bytes_behind_the_end_are_refused() {
    let longer = [MODEL, &[0]].concat();
    let (expected, found) = (MODEL.len() as u32, longer.len() as u32);
    assert_eq!(Model::from_bytes(&longer).unwrap_err(), Error::WrongLength { expected, found });
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
        let sizes = |model| lacuna::Sizes::required(model, &Schedule::of(model)).unwrap();
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
