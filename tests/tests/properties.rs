//! What holds for any input of its kind.

use lacuna::box_filter::{box_sums, dense_len};
use lacuna::gradient::GROUP;
use lacuna::grid::position;
use lacuna::hull::{Hull, Target};
use lacuna::nodes::{NodeMap, map_len};
use lacuna::{Fixed, GlobalFit, HullBuilder, LocalFit, Model, Reach, Sizes, global_fit::normal_len};
use lacuna_host::fit::Buffers;
use lacuna_tests::{default_schedule, head_points, in_voxels, model, voxel_pose};
use proptest::prelude::*;
use proptest::test_runner::Config;

/// Distances of the shape with these weights, 1/256 voxel, one a stored voxel.
fn synthesise(model: &Model<'_>, weights: &[f64]) -> Vec<f64> {
    let mut distances = Vec::with_capacity(model.voxels());
    for brick in model.bricks() {
        for voxel in 0..brick.voxels() {
            let terms = brick.basis(voxel).iter().zip(brick.exponents()).zip(weights);
            let sum: f64 = terms.map(|((&b, &e), w)| f64::from(b as i8) * 2f64.powi(-i32::from(e)) * w).sum();
            distances.push(f64::from(brick.mean(voxel)) + 256.0 * sum);
        }
    }
    distances
}

/// Next to no prior: with the model's own, weak modes are drawn towards the mean, which is what it is for.
const RIDGE: f32 = 1e-9;

/// Full weight at every voxel whose distance a target can hold.
fn targets(distances: &[f64]) -> Vec<i16> {
    let target = |&d: &f64| if d.abs() < 2047.0 { Target::new(d.round() as i32, 16) } else { Target(0) };
    distances.iter().map(|d| target(d).0).collect()
}

fn global_weights(model: &Model<'_>, targets: &[i16]) -> Vec<f64> {
    let length = normal_len(model.modes());
    let (mut normal, mut block, mut weights) = (vec![0.0; length], vec![0; length], vec![0.0; model.modes()]);
    let fit = GlobalFit::new(model, Hull::new(targets), Some(RIDGE), &mut normal, &mut block, &mut weights);
    fit.unwrap().run().to_vec()
}

fn weights() -> impl Strategy<Value = Vec<f64>> {
    prop::collection::vec(-2.0..2.0, model().modes())
}

proptest! {
    #![proptest_config(Config { cases: 6, failure_persistence: None, max_shrink_iters: 8, ..Config::default() })]

    #[test]
    fn the_hull_does_not_depend_on_the_order_of_points(
        points in Just(in_voxels(&head_points(1000), &voxel_pose(&model()))).prop_shuffle(),
    ) {
        let model = model();
        let digest = |points: &[([f32; 3], [f32; 3])]| {
            let (mut targets, mut keys) = (vec![0; model.voxels()], vec![0i16; model.voxels()]);
            let mut builder = HullBuilder::new(&model, Reach::of(&model), &mut targets, &mut keys).unwrap();
            points.iter().for_each(|&(point, normal)| builder.add(point, normal));
            let (hull, _) = builder.finish();
            (hull.count, hull.digest())
        };
        let shuffled = digest(&points);
        prop_assert!(shuffled.0 > 1000);
        prop_assert_eq!(shuffled, digest(&in_voxels(&head_points(1000), &voxel_pose(&model))));
    }

    #[test]
    fn a_synthesised_shape_gives_back_its_weights(weights in weights()) {
        let model = model();
        let found = global_weights(&model, &targets(&synthesise(&model, &weights)));
        for (k, (found, weight)) in found.iter().zip(&weights).enumerate() {
            prop_assert!((found - weight).abs() < 0.05, "mode {}: {} for {}", k, found, weight);
        }
    }

    /// A perfect global fit leaves the local one nothing to do but rounding.
    #[test]
    fn a_perfect_global_fit_stays(weights in weights()) {
        let model = model();
        let schedule = default_schedule(&model);
        let distances = synthesise(&model, &weights);
        let targets = targets(&distances);
        let mut buffers = Buffers::<Fixed>::new(&Sizes::required(&model, &schedule).unwrap());
        let mut fit =
            LocalFit::new(&model, Hull::new(&targets), &weights, schedule, buffers.memory().workspace).unwrap();
        fit.run();
        let mut worst = 0.0f64;
        for brick in model.bricks() {
            fit.distances(&brick, |v, fitted| {
                if Target(targets[v]).weight() != 0 {
                    worst = worst.max((f64::from(fitted) - distances[v]).abs());
                }
            });
        }
        prop_assert!(worst <= 4.0, "moved by {worst} / 256 voxel");
    }
}

proptest! {
    #![proptest_config(Config { cases: 16, failure_persistence: None, max_shrink_iters: 8, ..Config::default() })]

    /// Where the box does not leave the active nodes, the sum of a constant is its multiple.
    #[test]
    fn a_constant_field_stays_constant_inside(value in -20_000i32..20_000, radius in 0u8..2) {
        let model = model();
        let grid = model.grid();
        let stride = model.header().stride;
        let mut words = vec![0; map_len(grid.nodes(stride))];
        let nodes = NodeMap::new(&model, stride, &mut words).unwrap();
        let sides = nodes.sides();
        let mut dense = vec![0; dense_len(sides)];
        let mut sums = vec![[value; GROUP]; nodes.active()];
        box_sums::<Fixed>(&nodes, &mut dense, radius, &mut sums, 1);
        let r = i32::from(radius);
        let mut inside = 0;
        nodes.for_each(|number, index| {
            let at = position(index, sides).map(i32::from);
            let mut offsets = (-r..=r).flat_map(|z| (-r..=r).flat_map(move |y| (-r..=r).map(move |x| [x, y, z])));
            let active = |o: [i32; 3]| {
                let node: [i32; 3] = std::array::from_fn(|i| at[i] + o[i]);
                node.iter().all(|&v| v >= 0) && nodes.number(node.map(|v| v as u16)).is_some()
                    && node.iter().zip(sides).all(|(&v, side)| v < i32::from(side))
            };
            if offsets.all(active) {
                inside += 1;
                assert_eq!(sums[number], [value, value * (2 * r + 1).pow(3), value, value, value]);
            }
        });
        prop_assert!(inside > 0, "{inside} nodes inside");
    }
}
