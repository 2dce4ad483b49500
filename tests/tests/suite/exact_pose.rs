//! What an exact pose means: the frame the training shapes were given in. Trained on as they lay, it is held; drawn to
//! their mean, it is tied as firmly as they lay together.

use lacuna::pose_fit::{EXACT, Hint, ROUNDS};
use lacuna::{Model, Schedule};
use lacuna_fixtures::VERSIONS;
use lacuna_host::complete::verdict::Grade;
use lacuna_host::complete::{self, Options, start};
use lacuna_host::fit::fit;
use lacuna_host::mesh::Mesh;
use lacuna_host::register::Placed;
use lacuna_host::synth::{Head, Kind};
use lacuna_host::train::align::{Align, Way, align};
use lacuna_host::train::jitter::Apart;
use lacuna_host::train::{Settings, train};
use lacuna_tests::model;
use lacuna_tests::registration::{placed, to_voxels};
use lacuna_tests::sample::{Sample, head};
use nalgebra::{Similarity3, Translation3, UnitQuaternion, Vector3};
use std::sync::OnceLock;

/// A coarse model of eight heads, as far apart as is said.
fn coarse(apart: Option<Apart>) -> Vec<u8> {
    let shapes: Vec<Mesh> = (0..8).map(|number| Head::sample(1, number).mesh()).collect();
    train(&shapes, &Settings { spacing: Some(7.0), apart, ..Settings::default() }, &|_, _| ())
        .expect("a model")
}

/// Such a model that holds an exact pose, trained once.
fn holding() -> Model<'static> {
    static BYTES: OnceLock<Vec<u8>> = OnceLock::new();
    Model::from_bytes(BYTES.get_or_init(|| coarse(None))).expect("a model")
}

/// The pose of the fit that starts from this one, called exact.
fn fitted(model: &Model<'_>, sample: &Sample, exact: Placed) -> lacuna::Pose {
    let schedule = Schedule::of(model);
    let options = Options { pose: complete::GivenPose::Exact(exact), ..Options::of(model) };
    let start = start(model, &sample.scan, &options).expect("a start");
    let settings = lacuna::completion::Settings { rounds: Hint::Exact.rounds(model), schedule };
    let begun = start.thinned.rough.pose;
    let found = fit::<lacuna::Fixed>(model, &start.packed(), &begun, settings).expect("a fit").outcome.pose;
    assert_eq!(start.known.hint, Hint::Exact);
    lacuna::Pose {
        translation: std::array::from_fn(|a| found.translation[a] - begun.translation[a]),
        ..found
    }
}

#[test]
fn an_exact_pose_moves_as_far_as_the_training_shapes_lay_apart() {
    let sample = head(1001, Kind::Front);
    let shift = |model: &Model<'_>| {
        let to_shapes = sample.scan_to_model();
        // Two degrees and 3 mm off, so that there is something to be moved.
        let off = Similarity3::from_parts(
            Translation3::new(2.0, -2.0, 1.0),
            UnitQuaternion::from_scaled_axis(Vector3::new(0.02, -0.025, 0.015)),
            1.0,
        );
        let exact = placed(
            &(to_voxels(model, &(off * nalgebra::convert_unchecked::<_, Similarity3<f64>>(to_shapes)))),
        );
        let found = fitted(model, &sample, exact);
        Vector3::from(found.translation).norm() * model.header().spacing
    };
    let held = shift(&holding());
    let [firm, loose] = [1e-3, 1e3].map(|j| {
        let bytes = coarse(Some(Apart { turn: j, shift: j, growth: j }));
        shift(&Model::from_bytes(&bytes).expect("a model"))
    });
    println!("held {held}, firm {firm}, loose {loose} mm");
    assert_eq!(held, 0.0);
    assert!(firm < 0.05 && loose > 1.0, "firm {firm}, loose {loose} mm");
}

/// By the shape of the global fit: no other is fitted, and up to a quarter of a head lies farther than 3 mm from the mean.
#[test]
fn a_held_pose_is_judged_by_a_shape_and_not_by_the_mean() {
    let model = holding();
    for sample in (1001..=1004).map(|number| head(number, Kind::Front)) {
        let to_shapes = sample.scan_to_model();
        let exact = placed(&to_voxels(&model, &nalgebra::convert_unchecked(to_shapes)));
        let options = Options { pose: complete::GivenPose::Exact(exact), ..Options::of(&model) };
        let found = complete::complete::<lacuna::Fixed>(&model, &sample.scan, &options).expect("a head");
        let [inliers, _] = found.verdict.evidence.pose_inliers;
        let of_the_mean = f64::from(found.fit.outcome.inliers)
            / start(&model, &sample.scan, &options).expect("a start").thinned.points.points.len() as f64;
        println!("{of_the_mean} by the mean, {inliers}, {:?}", found.verdict);
        assert!(inliers > 0.85 && inliers > of_the_mean + 0.02, "{:?}", found.verdict);
        assert_eq!(found.verdict.grade, Grade::Good, "{:?}", found.verdict);
    }
}

#[test]
fn models_say_whether_an_exact_pose_is_held() {
    assert!(model().jitter().is_some(), "the built-in heads were drawn to their mean");
    assert_eq!(Hint::Exact.rounds(&model()), EXACT);
    for old in &VERSIONS[..2] {
        let model = Model::from_bytes(old.model).expect("a model");
        assert!(model.jitter().is_none() && Hint::Exact.rounds(&model).is_empty(), "version {}", old.number);
        assert_eq!(Hint::Rough.rounds(&model), ROUNDS);
    }
}

/// However the shapes are scattered, the model is the same: nothing of it is spent on how they lay.
#[test]
fn scattered_shapes_come_together_and_keep_their_frame() {
    let shapes: Vec<Mesh> = (0..6).map(|number| Head::sample(1, number).mesh()).collect();
    let scattered: Vec<Mesh> =
        shapes.iter().zip([1.0, -1.0, 0.5, -0.5, 0.8, -0.8]).map(|(s, t)| turned(s, t)).collect();
    let [still, moved] =
        [&shapes, &scattered].map(|shapes| align(shapes, Align::Auto, 1, &|_, _| ()).expect("aligned"));
    let (Way::Drawn(Some(before)), Way::Drawn(Some(after))) = (still.way, moved.way) else {
        panic!("in one pose")
    };
    println!("{before:?} {after:?}");
    assert!(after.turn > before.turn + 0.01 && after.shift > before.shift + 0.5, "{before:?} {after:?}");
    for (a, b) in still.shapes.iter().zip(&moved.shapes) {
        let squares: f64 = a.points.iter().zip(&b.points).map(|(a, b)| (a - b).norm_squared()).sum();
        let rms = (squares / a.points.len() as f64).sqrt();
        assert!(rms < 2.0, "{rms} mm apart");
    }
    let never = align(&scattered, Align::Never, 1, &|_, _| ()).expect("left");
    assert_eq!((never.way, never.shapes), (Way::Left, scattered));
}

/// Turned by up to three degrees about its middle, shifted and grown by up to two per cent.
fn turned(shape: &Mesh, by: f64) -> Mesh {
    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.03, -0.05, 0.02) * by);
    let motion = Similarity3::from_parts(Translation3::new(2.0 * by, -3.0 * by, by), turn, 1.0 + 0.02 * by);
    shape.moved(&motion)
}
