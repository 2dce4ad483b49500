//! Training at full resolution: what it takes, as Linux counts it, and whether the errors it states hold.

use lacuna::Model;
use lacuna_host::io;
use lacuna_tests::expected_errors::shares;
use lacuna_tests::real_data;
use lacuna_tests::required::lacks;
use lacuna_tests::trained::{Trained, thirty_heads, train_watched, training_faces};
use std::ops::RangeInclusive;

const LIMIT_KIB: u64 = 1 << 20;
/// Where the share of true errors below the stated one-sigma error must lie, over several scans.
const SHARE: RangeInclusive<f64> = 0.6..=0.75;
/// Shapes that expected errors are learned from: two scans of each are completed, by far the most of the time.
const CALIBRATED: usize = 6;
/// Their voxels, mm: the errors are those of completions with the same model.
const COARSER: &str = "5";

fn assert_less_than_a_gibibyte(trained: &Trained) {
    let Some(highest) = trained.peak_kib else {
        return lacks("PROC", "there is no /proc to tell the memory of a program");
    };
    assert!(highest > 10_000, "{highest} KiB: not measured");
    assert!(highest < LIMIT_KIB, "{highest} KiB");
}

#[test]
fn thirty_shapes_take_less_than_a_gibibyte() {
    assert_less_than_a_gibibyte(thirty_heads());
}

#[test]
fn errors_learned_from_faces_take_less_than_a_gibibyte_and_hold_for_others() {
    let Some(real) = real_data("faces/train") else { return };
    let trained = train_watched(&training_faces(&real, 0..CALIBRATED), &["--spacing", COARSER]);
    assert_less_than_a_gibibyte(&trained);
    let others = training_faces(&real, 30..34).into_iter().map(|path| io::read(&path).unwrap());
    let shares = shares(&Model::from_bytes(&trained.model).unwrap(), &others.collect::<Vec<_>>());
    assert!(shares.iter().all(|share| SHARE.contains(share)), "{shares:?}");
}
