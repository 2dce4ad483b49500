//! How far off a rough pose may be: what the core's documentation and the README promise to applications.

use lacuna::cloud::Bytes;
use lacuna::completion::Settings;
use lacuna::pose_fit::ROUNDS;
use lacuna::{Fixed, Pose, Schedule};
use lacuna_host::fit::fit;
use lacuna_host::points::PackedPoints;
use lacuna_tests::model;

/// Voxels, radians, and the logarithm of a factor.
const OFF: [f32; 3] = [15.0, 0.785, 0.22];

/// Inliers of the example scan from a pose.
fn inliers(pose: Pose) -> u32 {
    let (model, scan) = (model(), Bytes(lacuna_fixtures::PACKED_SCAN));
    let settings = Settings { rounds: &ROUNDS, schedule: Schedule::of(&model) };
    let points = PackedPoints { points: scan.points().collect(), step: scan.step() };
    fit::<Fixed>(&model, &points, &pose, settings).map_or(0, |fit| fit.outcome.inliers)
}

#[test]
fn a_pose_that_is_off_by_as_much_as_is_promised_is_refined() {
    let right = Bytes(lacuna_fixtures::PACKED_SCAN).pose();
    let known = inliers(right);
    let centre = right.translation;
    let [shift, turn, growth] = OFF;
    let along = |axis: usize, by: f32| std::array::from_fn(|i| if i == axis { by } else { 0.0 });
    for sign in [-1.0, 1.0] {
        for axis in 0..3 {
            let moved = right.moved(centre, [0.0; 3], 0.0, along(axis, sign * shift));
            let turned = right.moved(centre, along(axis, sign * turn), 0.0, [0.0; 3]);
            for (what, pose) in [("moved", moved), ("turned", turned)] {
                let found = inliers(pose);
                println!("{what} {sign} along {axis}: {found} of {known}");
                assert!(found * 50 > known * 49, "{what} {sign} along {axis}: {found} of {known} inliers");
            }
        }
        let found = inliers(right.moved(centre, [0.0; 3], sign * growth, [0.0; 3]));
        println!("grown {sign}: {found} of {known}");
        assert!(found * 50 > known * 49, "grown {sign}: {found} of {known} inliers");
    }
}
