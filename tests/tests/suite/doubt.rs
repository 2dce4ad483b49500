//! A fit comes to an end whatever the scan was: what a device can tell from its outcome alone.

use lacuna::cloud::{Bytes, Packed};
use lacuna::completion::{Doubt, Outcome, Settings};
use lacuna::pose_fit::ROUNDS;
use lacuna::{Error, Fixed, Pose, Schedule};
use lacuna_host::fit::fit;
use lacuna_host::points::PackedPoints;
use lacuna_tests::model;

fn outcome(points: &[Packed], pose: Pose) -> Result<Outcome, Error> {
    let (model, step) = (model(), Bytes(lacuna_fixtures::PACKED_SCAN).step());
    let settings = Settings { rounds: &ROUNDS, schedule: Schedule::of(&model) };
    let points = PackedPoints { points: points.to_vec(), step };
    fit::<Fixed>(&model, &points, &pose, settings).map(|fit| fit.outcome)
}

#[test]
fn another_unit_a_wrong_pose_and_inward_normals_are_doubted() {
    let scan = Bytes(lacuna_fixtures::PACKED_SCAN);
    let (points, pose) = (scan.points().collect::<Vec<Packed>>(), scan.pose());
    let right = outcome(&points, pose).expect("the example");
    assert_eq!(right.doubt(points.len()), None, "{right:?}");
    for (name, factor) in [("inches", 1.0 / 25.4), ("centimetres", 0.1), ("metres", 0.001)] {
        let small = outcome(&points, Pose { scale: pose.scale * factor, ..pose }).expect(name);
        assert_eq!(small.doubt(points.len()), Some(Doubt::Size), "{name}: {small:?}");
    }
    let [x, y, z] = pose.rotation;
    let turned = Pose { rotation: [x.map(|c| -c), y, z.map(|c| -c)], ..pose };
    let turned = outcome(&points, turned).expect("a fit");
    assert_eq!(turned.doubt(points.len()), Some(Doubt::Pose), "{turned:?}");
    let inward: Vec<Packed> = points.iter().map(|&[x, y, z, a, b, c]| [x, y, z, -a, -b, -c]).collect();
    let inward = outcome(&inward, pose).expect("a fit");
    assert_eq!(inward.doubt(points.len()), Some(Doubt::Pose), "{inward:?}");
}
