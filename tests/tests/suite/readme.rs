//! The README's firmware, taken from the README by `build.rs`: it compiles, and computes the golden bits.

use lacuna::cloud::{Bytes, Packed};
use lacuna::completion::Outcome;
use lacuna::{Error, Memory, Pose, Schedule, Sizes};
use lacuna_fixtures::{MODEL, PACKED_SCAN, golden};
use lacuna_host::fit::Buffers;
use lacuna_tests::model;

include!(concat!(env!("OUT_DIR"), "/readme.rs"));

#[test]
fn the_firmware_of_the_readme_computes_the_golden_bits() {
    let (model, scan) = (model(), Bytes(PACKED_SCAN));
    let sizes = Sizes::required(&model, &Schedule::of(&model)).unwrap();
    let mut buffers = Buffers::new(&sizes);
    let points: Vec<Packed> = scan.points().collect();
    let outcome = firmware(&points, scan.step(), scan.pose(), buffers.memory()).unwrap();
    let golden = golden("built-in").expect("a golden case");
    let digests = outcome.digests;
    assert_eq!(
        (digests.pose, digests.hull, digests.global, digests.local),
        (golden.pose, golden.hull, golden.global, golden.local)
    );
}
