//! A fit comes to an end whatever the scan was: what a device can tell from its outcome alone.

use lacuna::cloud::{Bytes, Packed};
use lacuna::completion::{Completion, Doubt, Outcome, Settings};
use lacuna::pose_fit::ROUNDS;
use lacuna::{Cloud, Error, Fixed, Pose, Reach, Sizes};
use lacuna_host::fit::Buffers;
use lacuna_tests::{default_schedule, model};

fn outcome(points: &[Packed], pose: Pose) -> Result<Outcome, Error> {
    let (model, step) = (model(), Bytes(lacuna_fixtures::PACKED_SCAN).step());
    let schedule = default_schedule(&model);
    let settings = Settings { reach: Reach::of(&model), rounds: &ROUNDS, schedule };
    let mut buffers = Buffers::<Fixed>::new(&Sizes::required(&model, &schedule)?);
    let cloud = Cloud::new(points, step)?;
    let mut job = Completion::new(&model, cloud, pose, settings, buffers.memory())?;
    job.run();
    job.outcome()
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
