//! The memory a fit needs: within the budget, exactly as announced, and refused by name when one element short.

use lacuna::error::Buffer;
use lacuna::format::Unit;
use lacuna::{Error, Fixed, Model, Schedule, Sizes};
use lacuna_host::io;
use lacuna_host::mesh::Mesh;
use lacuna_host::points::{OrientedPoints, thin};
use lacuna_host::train::{Settings, train};
use lacuna_tests::buffers::Lent;
use lacuna_tests::{default_schedule, head_points, momentum_schedule, real_data, voxel_pose};

const BUDGET: usize = 640 * 1024;

fn assert_within_budget(model: &Model<'_>) {
    let bytes = Sizes::required(model, &default_schedule(model)).unwrap().bytes::<Fixed>();
    println!("{}: {} KiB of {}", model.header().class, bytes / 1024, BUDGET / 1024);
    assert!(bytes <= BUDGET, "{bytes} bytes");
}

fn assert_exact_buffers_do(model: &Model<'_>, points: &OrientedPoints, schedule: Schedule<'_>) {
    let sizes = Sizes::required(model, &schedule).unwrap();
    let mut lent = Lent::new(&sizes);
    assert_eq!(lent.bytes(), sizes.bytes::<Fixed>());
    lent.global(model, points, &voxel_pose(model)).unwrap();
    lent.local(model, schedule).unwrap();
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
    assert_exact_buffers_do(&model, &points, default_schedule(&model));
    assert_exact_buffers_do(&model, &points, momentum_schedule(&model));
}

#[test]
fn hull_and_global_fit_name_the_buffer_that_is_short() {
    let model = lacuna_tests::model();
    let sizes = Sizes::required(&model, &default_schedule(&model)).unwrap();
    let points = head_points(1000);
    for buffer in [Buffer::Targets, Buffer::Keys, Buffer::Normal, Buffer::Block, Buffer::Weights] {
        let mut lent = Lent::new(&sizes);
        lent.shorten(buffer);
        let error = lent.global(&model, &points, &voxel_pose(&model)).unwrap_err();
        assert!(names(error, buffer), "{buffer:?}: {error:?}");
    }
}

#[test]
fn the_local_fit_names_the_buffer_that_is_short() {
    let model = lacuna_tests::model();
    let schedule = momentum_schedule(&model);
    let sizes = Sizes::required(&model, &schedule).unwrap();
    use Buffer::{Cell, Dense, Gradient, NodeWeights, Nodes, Previous, Reciprocals, Residuals};
    for buffer in [NodeWeights, Previous, Residuals, Gradient, Dense, Reciprocals, Nodes, Cell] {
        let mut lent = Lent::new(&sizes);
        lent.shorten(buffer);
        let error = lent.local(&model, schedule).unwrap_err();
        assert!(names(error, buffer), "{buffer:?}: {error:?}");
    }
}

#[test]
fn without_momentum_no_previous_weights_are_needed() {
    let model = lacuna_tests::model();
    let sizes = |schedule: &Schedule<'_>| Sizes::required(&model, schedule).unwrap();
    assert_eq!(sizes(&default_schedule(&model)).previous, 0);
    let with = sizes(&momentum_schedule(&model));
    assert_eq!(with.previous, with.weights);
}

#[test]
fn a_model_of_real_faces_is_within_the_budget() {
    let (Some(folder), Some(target)) = (real_data("faces/train"), real_data("faces/targets/target_00.ply"))
    else {
        return;
    };
    let shape = |i: u32| io::read(&folder.join(format!("train_{i:03}.ply"))).unwrap();
    let shapes: Vec<Mesh> = (0..30).map(shape).collect();
    let settings = Settings { spacing: Some(3.3), unit: Unit::Millimetre, ..Settings::default() };
    let bytes = train(&shapes, &settings, &|_, _| ()).unwrap();
    assert!(bytes.len() <= 1_677_721, "{} bytes are over 1.6 MiB", bytes.len());
    let model = Model::from_bytes(&bytes).unwrap();
    assert_within_budget(&model);
    let points = thin(&io::read(&target).unwrap(), 2.0);
    assert_exact_buffers_do(&model, &points, default_schedule(&model));
}
