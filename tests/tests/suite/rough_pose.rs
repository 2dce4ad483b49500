//! How far off a rough pose may be: what the core's documentation and the README promise to applications.

use lacuna::cloud::{Bytes, Packed};
use lacuna::completion::{Completion, Settings};
use lacuna::pose_fit::ROUNDS;
use lacuna::{Cloud, Fixed, Pose, Reach, Sizes};
use lacuna_host::fit::Buffers;
use lacuna_tests::{default_schedule, model};

/// Voxels, radians, and the logarithm of a factor.
const OFF: [f32; 3] = [15.0, 0.785, 0.22];

/// Inliers of the example scan from a pose.
fn inliers(pose: Pose) -> u32 {
    let (model, scan) = (model(), Bytes(lacuna_fixtures::PACKED_SCAN));
    let schedule = default_schedule(&model);
    let settings = Settings { reach: Reach::of(&model), rounds: &ROUNDS, schedule };
    let points: Vec<Packed> = scan.points().collect();
    let mut buffers = Buffers::<Fixed>::new(&Sizes::required(&model, &schedule).expect("sizes"));
    let cloud = Cloud::new(&points, scan.step()).expect("a cloud");
    let mut job = Completion::new(&model, cloud, pose, settings, buffers.memory()).expect("a completion");
    job.run();
    job.outcome().map_or(0, |outcome| outcome.inliers)
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
