//! The memory a fit needs: within the budget, exactly as announced, and refused by name when one element short.

use lacuna::completion;
use lacuna::error::{Buffer, OptionName};
use lacuna::pose_fit::{ROUNDS, Round};
use lacuna::{Completion, Error, Fixed, Float, Model, Schedule, Sizes};
use lacuna_host::fit::{Buffers, fit};
use lacuna_host::io;
use lacuna_host::points::{OrientedPoints, PackedPoints, thin};
use lacuna_tests::trained::thirty_faces_bytes;
use lacuna_tests::{head_points, real_data, voxel_pose};

const BUDGET: usize = 640 * 1024;

/// Completes points in a known pose in exactly the memory that is lent, as firmware does.
fn complete(
    model: &Model<'_>,
    points: &PackedPoints,
    schedule: Schedule<'_>,
    buffers: &mut Buffers<Fixed>,
) -> Result<(), Error> {
    let settings = completion::Settings { rounds: &[], schedule };
    let mut job = Completion::new(model, points.cloud()?, voxel_pose(model), settings, buffers.memory())?;
    job.run();
    job.outcome().map(|_| ())
}

fn assert_within_budget(model: &Model<'_>) {
    let bytes = Sizes::required(model, &Schedule::of(model)).unwrap().bytes::<Fixed>();
    println!("{}: {} KiB of {}", model.header().class, bytes / 1024, BUDGET / 1024);
    assert!(bytes <= BUDGET, "{bytes} bytes");
}

fn assert_exact_buffers_do(model: &Model<'_>, points: &OrientedPoints, schedule: Schedule<'_>) {
    let sizes = Sizes::required(model, &schedule).unwrap();
    let mut buffers = Buffers::new(&sizes);
    assert_eq!(buffers.memory().bytes(), sizes.bytes::<Fixed>());
    complete(model, &points.packed(), schedule, &mut buffers).unwrap();
}

/// Whether the error names the buffer, with one element given less than needed.
fn names(error: Error, expected: Buffer) -> bool {
    matches!(error, Error::BufferTooSmall { buffer, needed, given } if buffer == expected && given + 1 == needed)
}

#[test]
fn the_built_in_model_is_within_the_budget() {
    assert_within_budget(&lacuna_tests::model());
}

#[test]
fn a_fit_runs_in_exactly_the_memory_required() {
    let model = lacuna_tests::model();
    let points = head_points(1000);
    assert_exact_buffers_do(&model, &points, Schedule::of(&model));
    assert_exact_buffers_do(&model, &points, Schedule::with_momentum(&model));
}

#[test]
fn a_round_that_the_pose_fit_cannot_do_is_refused_by_name() {
    let model = lacuna_tests::model();
    let points = head_points(1000).packed();
    let refusal = |round: Round| {
        let settings = completion::Settings { rounds: &[round], schedule: Schedule::of(&model) };
        fit::<Fixed>(&model, &points, &voxel_pose(&model), settings).expect_err("a round out of range")
    };
    for misfit in [0.0, -1.0, f32::NAN, f32::INFINITY, 1e-40] {
        assert_eq!(refusal(Round { misfit, ..ROUNDS[0] }), Error::Option(OptionName::Misfit), "{misfit}");
    }
    for given in [0, 3, 15] {
        let round = Round { points: given as usize, ..ROUNDS[0] };
        assert_eq!(refusal(round), Error::TooFewPoints { given });
    }
}

/// A variant's name as a constant has it.
fn upper_case(variant: &str) -> String {
    let mut constant = String::new();
    for letter in variant.chars() {
        if letter.is_uppercase() && !constant.is_empty() {
            constant.push('_');
        }
        constant.push(letter.to_ascii_uppercase());
    }
    constant
}

/// Takes the last element of a buffer away.
type Shorten = fn(&mut Buffers<Fixed>);

#[test]
fn a_buffer_one_element_short_is_refused_by_name() {
    let model = lacuna_tests::model();
    let schedule = Schedule::with_momentum(&model);
    let sizes = Sizes::required(&model, &schedule).unwrap();
    let points = head_points(1000).packed();
    let cases: [(Buffer, Shorten); 17] = [
        (Buffer::PoseNormal, |b| _ = b.pose_normal.pop()),
        (Buffer::PoseChunk, |b| _ = b.pose_chunk.pop()),
        (Buffer::PoseColumns, |b| _ = b.pose_columns.pop()),
        (Buffer::PoseWeights, |b| _ = b.pose_weights.pop()),
        (Buffer::Targets, |b| _ = b.targets.pop()),
        (Buffer::Normal, |b| _ = b.normal.pop()),
        (Buffer::Block, |b| _ = b.block.pop()),
        (Buffer::Global, |b| _ = b.global.pop()),
        (Buffer::NodeWeights, |b| _ = b.node_weights.pop()),
        (Buffer::Previous, |b| _ = b.previous.pop()),
        (Buffer::Residuals, |b| _ = b.residuals.pop()),
        (Buffer::HullRows, |b| _ = b.hull_rows.pop()),
        (Buffer::Gradient, |b| _ = b.gradient.pop()),
        (Buffer::Dense, |b| _ = b.dense.pop()),
        (Buffer::Reciprocals, |b| _ = b.reciprocals.pop()),
        (Buffer::Nodes, |b| _ = b.nodes.pop()),
        (Buffer::Cell, |b| _ = b.cell.pop()),
    ];
    for ((buffer, shorten), (constant, _)) in cases.into_iter().zip(sizes.named()) {
        assert_eq!(upper_case(&format!("{buffer:?}")), constant, "one name for one buffer");
        let mut buffers = Buffers::new(&sizes);
        shorten(&mut buffers);
        let error = complete(&model, &points, schedule, &mut buffers).unwrap_err();
        assert!(names(error, buffer), "{buffer:?}: {error:?}");
    }
}

#[test]
fn sizes_tell_the_bytes_of_their_buffers() {
    let model = lacuna_tests::model();
    for schedule in [Schedule::of(&model), Schedule::with_momentum(&model)] {
        let sizes = Sizes::required(&model, &schedule).unwrap();
        assert_eq!(sizes.bytes::<Fixed>(), Buffers::<Fixed>::new(&sizes).memory().bytes());
        assert_eq!(sizes.bytes::<Float>(), Buffers::<Float>::new(&sizes).memory().bytes());
    }
}

#[test]
fn without_momentum_no_previous_weights_are_needed() {
    let model = lacuna_tests::model();
    let sizes = |schedule: &Schedule<'_>| Sizes::required(&model, schedule).unwrap();
    assert_eq!(sizes(&Schedule::of(&model)).previous, 0);
    let with = sizes(&Schedule::with_momentum(&model));
    assert_eq!(with.previous, with.node_weights);
}

#[test]
fn a_model_of_real_faces_is_within_the_budget() {
    let (Some(bytes), Some(target)) = (thirty_faces_bytes(), real_data("faces/targets/target_00.ply")) else {
        return;
    };
    assert!(bytes.len() <= 1_677_721, "{} bytes are over 1.6 MiB", bytes.len());
    let model = Model::from_bytes(bytes).unwrap();
    assert_within_budget(&model);
    let points = thin(&io::read(&target).unwrap(), 2.0);
    assert_exact_buffers_do(&model, &points, Schedule::of(&model));
}
