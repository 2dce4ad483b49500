//! What holds for any input of its kind.

use lacuna::arithmetic::{Kernel, Stride};
use lacuna::box_filter::{box_sums, dense_len};
use lacuna::columns::LIMIT;
use lacuna::corner_rows::Row;
use lacuna::corners::Weights;
use lacuna::cube::Cube;
use lacuna::distance_cache::DistanceCache;
use lacuna::gradient::{CellGradient, GROUP, MARGIN, Taken};
use lacuna::grid::position;
use lacuna::hull::{Hull, Target};
use lacuna::nodes::{NodeMap, map_len};
use lacuna::pose_fit::{Hint, ROUNDS, Round};
use lacuna::pose_row::{MOST_ENTRIES, Rows};
use lacuna::trilinear::trilinear;
use lacuna::{
    Fixed, Float, GlobalFit, HullBuilder, LocalFit, Model, Reach, Schedule, Sizes, global_fit::normal_len,
};
use lacuna_host::fit::Buffers;
use lacuna_tests::fuzz::fit::completed;
use lacuna_tests::fuzz::tiny::tiny;
use lacuna_tests::{head_points, in_voxels, model, voxel_pose};
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

/// The built-in model with next to no prior: with its own, weak modes are drawn towards the mean, which is what it is for.
fn model_without_prior() -> Vec<u8> {
    crate::versions::with_header(lacuna_fixtures::MODEL, &|header| header.scales.global_ridge = 1e-6)
}

/// Full weight at every voxel whose distance a target can hold.
fn targets(distances: &[f64]) -> Vec<i16> {
    let target = |&d: &f64| if d.abs() < 2047.0 { Target::new(d.round() as i32, 16) } else { Target(0) };
    distances.iter().map(|d| target(d).0).collect()
}

fn global_weights(model: &Model<'_>, targets: &[i16]) -> Vec<f64> {
    let length = normal_len(model.modes());
    let (mut normal, mut block, mut weights) = (vec![0.0; length], vec![0; length], vec![0.0; model.modes()]);
    let fit = GlobalFit::new(model, Hull::new(targets), &mut normal, &mut block, &mut weights);
    fit.unwrap().run().to_vec()
}

#[test]
fn modes_that_a_local_fit_is_not_told_begin_at_zero_whatever_was_in_the_memory() {
    let model = model();
    let schedule = Schedule::of(&model);
    let targets = vec![0; model.voxels()];
    let begun = |start: &[f64], left: i16| {
        let mut buffers = Buffers::<Fixed>::new(&Sizes::required(&model, &schedule).unwrap());
        buffers.node_weights.fill(left);
        let workspace = buffers.memory().workspace;
        LocalFit::new(&model, Hull::new(&targets), start, schedule, workspace).unwrap().weights().to_vec()
    };
    let mut all = vec![0.0; model.modes()];
    all[..2].copy_from_slice(&[1.0, 2.0]);
    assert_eq!(begun(&[1.0, 2.0], 9999), begun(&all, 0));
}

fn weights() -> impl Strategy<Value = Vec<f64>> {
    prop::collection::vec(-2.0..2.0, model().modes())
}

/// What the voxels add to the gradient of eight nodes.
fn cell_gradient<R: Row<Fixed>>(taken: Taken<'_>, residuals: &[i16], places: [usize; 8]) -> Vec<i32> {
    let stride = Stride::new(3).unwrap();
    let corner_residuals: Vec<R> = residuals
        .iter()
        .enumerate()
        .map(|(i, &residual)| {
            let at = [i % 3, i / 3 % 3, i / 9].map(|v| v as u8);
            R::corner_residuals(residual, trilinear(at, 3), stride)
        })
        .collect();
    let mut gradient = vec![0; 8 * model().modes() + MARGIN];
    let kernel = Kernel::new(1, stride);
    let (mut group, mut many) = (R::Group::EMPTY, R::Many::EMPTY);
    group.add(&corner_residuals, taken, kernel, (&mut gradient, places));
    many.add(&corner_residuals, taken, kernel, (&mut gradient, places));
    gradient
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
        let file = model_without_prior();
        let model = Model::from_bytes(&file).unwrap();
        let found = global_weights(&model, &targets(&synthesise(&model, &weights)));
        for (k, (found, weight)) in found.iter().zip(&weights).enumerate() {
            prop_assert!((found - weight).abs() < 0.05, "mode {}: {} for {}", k, found, weight);
        }
    }

    /// Voxel by voxel or point by point, the jointly fitted surface is the same to the last bit.
    #[test]
    fn kept_distances_are_those_of_a_single_look(weights in weights(), length in 1usize..5000) {
        let model = model();
        let shape: Vec<f32> = weights.iter().map(|&weight| weight as f32).collect();
        let (shape, mut memory) = (Weights::new(&shape), vec![0i32; length]);
        let mut kept = DistanceCache::new(&model, &shape, &mut memory);
        let (points, mut stored) = (in_voxels(&head_points(1000), &voxel_pose(&model)), 0);
        for &(point, _) in &points {
            let single = Cube::new(&model, &shape).find(point).map(Cube::distance);
            stored += usize::from(single.is_some());
            prop_assert_eq!(kept.sample(point), single);
        }
        prop_assert!(2 * stored > points.len());
    }

    /// What a cube keeps of the places before does not change what it finds at the next one, in whatever order they come.
    #[test]
    fn a_cube_that_has_been_elsewhere_makes_the_same_rows(weights in weights(), step in 1usize..500) {
        let model = model();
        let shape: Vec<f32> = weights.iter().map(|&weight| weight as f32).collect();
        let mut rows = Rows::new(&model);
        rows.set(&ROUNDS[ROUNDS.len() - 1], [30.0; 3], &shape);
        let (mut used, mut filled) = (rows.cube(), 0);
        let points = in_voxels(&head_points(1000), &voxel_pose(&model));
        for i in 0..points.len() {
            let (point, _) = points[i * step % points.len()];
            let [mut row, mut fresh] = [[0; MOST_ENTRIES]; 2];
            let found = rows.fill(point, &mut used, &mut row);
            prop_assert_eq!(found, rows.fill(point, &mut rows.cube(), &mut fresh));
            if found.is_some() {
                prop_assert_eq!(&row[..rows.entries()], &fresh[..rows.entries()]);
                filled += 1;
            }
        }
        prop_assert!(2 * filled > points.len());
    }

    /// Every entry of a row is below the limit that the exact sums of columns rest on, whatever shape, misfit scale and
    /// centre of turns: at the grid's corners, where arms are longest, anywhere in it and on a surface.
    #[test]
    fn entries_of_rows_are_below_the_limit_of_columns(
        weights in weights(),
        strength in 0.0f32..8.0,
        misfit in (-3.0f32..3.0).prop_map(|power| 10f32.powf(power)),
        centres in prop::collection::vec(prop::array::uniform3(-7.0f32..8.0), 8),
        inside in prop::collection::vec(prop::array::uniform3(0.0f32..1.0), 1000),
    ) {
        let model = model();
        let sides = model.grid().sides().map(f32::from);
        let at = |within: [f32; 3]| -> [f32; 3] { std::array::from_fn(|axis| within[axis] * sides[axis]) };
        let corners = (0..8).map(|c| [0, 1, 2].map(|axis| if c >> axis & 1 == 0 { 0.0 } else { 0.9999 }));
        let surface = in_voxels(&head_points(1000), &voxel_pose(&model)).into_iter().map(|(point, _)| point);
        let places: Vec<[f32; 3]> = corners.chain(inside).map(at).chain(surface).collect();
        let shape: Vec<f32> = weights.iter().map(|&weight| weight as f32 * strength).collect();
        let mut rows = Rows::new(&model);
        let rounds = [ROUNDS[0], ROUNDS[ROUNDS.len() - 1]].map(|round| Round { misfit, ..round });
        // Far from the grid all arms are about as long as the longest one, which the entries are scaled by.
        for (round, centre) in rounds.iter().flat_map(|round| centres.iter().map(move |&centre| (round, centre))) {
            rows.set(round, at(centre), &shape);
            let (mut cube, mut filled) = (rows.cube(), 0);
            for &place in &places {
                let mut row = [0; MOST_ENTRIES];
                if rows.fill(place, &mut cube, &mut row).is_some() {
                    let entries = &row[..rows.entries()];
                    prop_assert!(entries.iter().all(|e| e.unsigned_abs() < LIMIT as u16), "{place:?}: {entries:?}");
                    filled += 1;
                }
            }
            prop_assert!(filled > 100, "only {filled} rows");
        }
    }

    /// A perfect global fit leaves the local one nothing to do but rounding: 5.7 at most in eighty draws.
    #[test]
    fn a_perfect_global_fit_stays(weights in weights()) {
        let model = model();
        let schedule = Schedule::of(&model);
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
        prop_assert!(worst <= 8.0, "moved by {worst} / 256 voxel");
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
        each(&nodes, |number, index| {
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

/// Visits the active nodes: number, position in the grid.
fn each(nodes: &NodeMap<'_>, mut visit: impl FnMut(usize, usize)) {
    nodes.for_each_run(|number, index, length| (0..length).for_each(|i| visit(number + i, index + i)));
}

/// Sums over boxes of nodes, taken one by one, zero outside the grid and at nodes that are not active.
fn naive_sums(nodes: &NodeMap<'_>, field: &[i32], radius: u8) -> Vec<i32> {
    let sides = nodes.sides().map(i32::from);
    let r = i32::from(radius);
    let mut sums = vec![0i32; field.len()];
    each(nodes, |number, index| {
        let at = position(index, nodes.sides()).map(i32::from);
        let range = |axis: usize| (at[axis] - r).max(0)..(at[axis] + r + 1).min(sides[axis]);
        for (z, y, x) in range(2).flat_map(|z| range(1).flat_map(move |y| range(0).map(move |x| (z, y, x)))) {
            if let Some(other) = nodes.number([x, y, z].map(|v| v as u16)) {
                sums[number] = sums[number].wrapping_add(field[other]);
            }
        }
    });
    sums
}

proptest! {
    #![proptest_config(Config { cases: 24, failure_persistence: None, max_shrink_iters: 8, ..Config::default() })]

    /// Sums of a brick's cells with the numbers of eight corners are the same in both orders of the numbers, also
    /// at the end of the brick and of the nodes.
    #[test]
    fn both_orders_of_corner_rows_give_the_same_sums(seed: u64, picked: prop::sample::Index, most in 1usize..27) {
        use rand::{RngExt, SeedableRng};
        let model = model();
        let (brick, modes) = (model.brick(picked.index(model.bricks().count())).unwrap(), model.modes());
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        let weights: Vec<i16> = (0..8 * modes).map(|_| rng.random_range(-32767..=32767)).collect();
        let nodes: [&[i16]; 8] = std::array::from_fn(|corner| &weights[corner * modes..]);
        let least = brick.least_exponent();
        let mut pairs = vec![[0i32; 4]; modes];
        Row::<Fixed>::gather(&mut pairs, nodes, brick.exponents(), least);
        let mut lanes = vec![[7i16; 8]; <[i16; 8] as Row<Fixed>>::count(modes)];
        Row::<Fixed>::gather(&mut lanes, nodes, brick.exponents(), least);
        for voxel in 0..brick.voxels() {
            let values = brick.basis_from(voxel);
            let [a, b]: [[i32; 8]; 2] = [Row::<Fixed>::dots(&pairs, values), Row::<Fixed>::dots(&lanes, values)];
            prop_assert_eq!(a, b);
        }
        let voxels: Vec<u16> = (0..brick.voxels() as u16).rev().take(most).collect();
        let residuals: Vec<i16> = voxels.iter().map(|_| rng.random_range(-2047..=2047)).collect();
        let places = std::array::from_fn(|corner| (7 - corner) * modes);
        for taken in (0..modes).step_by(GROUP).map(|first| Taken {
            brick: &brick, voxels: &voxels, first, count: (modes - first).min(GROUP),
        }) {
            let [a, b] = [
                cell_gradient::<[i32; 4]>(taken, &residuals, places),
                cell_gradient::<[i16; 8]>(taken, &residuals, places),
            ];
            prop_assert_eq!(a, b);
        }
    }

    /// Also where integral images wrap: the values may be as large as they like.
    #[test]
    fn the_box_filter_is_the_naive_sum(seed: u64, radius in 0u8..4, limit in 1i32..i32::MAX, lane in 0..GROUP) {
        use rand::{RngExt, SeedableRng};
        let tiny = tiny().model();
        let stride = 1;
        let mut words = vec![0; map_len(tiny.grid().nodes(stride))];
        let nodes = NodeMap::new(&tiny, stride, &mut words).unwrap();
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        let field: Vec<i32> = (0..nodes.active()).map(|_| rng.random_range(-limit..limit)).collect();
        let mut sums = vec![[7i32; GROUP]; field.len()];
        sums.iter_mut().zip(&field).for_each(|(lanes, &value)| lanes[lane] = value);
        let mut floats: Vec<[f64; GROUP]> = sums.iter().map(|lanes| lanes.map(f64::from)).collect();
        let mut dense = vec![0; dense_len(nodes.sides())];
        box_sums::<Fixed>(&nodes, &mut dense, radius, &mut sums, lane);
        let naive = naive_sums(&nodes, &field, radius);
        prop_assert!(sums.iter().zip(&naive).all(|(lanes, &sum)| lanes[lane] == sum));
        prop_assert!(sums.iter().all(|lanes| (0..GROUP).all(|other| other == lane || lanes[other] == 7)));
        let mut dense = vec![0.0; dense_len(nodes.sides())];
        box_sums::<Float>(&nodes, &mut dense, radius, &mut floats, lane);
        // Whole numbers below 2^53: the double precision sums are exact and must agree where i32 has not wrapped.
        prop_assert!(floats.iter().zip(&naive).all(|(lanes, &sum)| lanes[lane] as i64 as i32 == sum));
    }

    /// What is written is read again to the last bit: coordinates of single precision, normals, triangles.
    #[test]
    fn a_mesh_comes_back_from_a_file(
        points in prop::collection::vec(prop::array::uniform3(-1e6f32..1e6), 3..60),
        corners in prop::collection::vec(prop::array::uniform3(0usize..60), 0..80),
        oriented: bool,
    ) {
        use lacuna_host::mesh::{Mesh, Point, Vector};
        let count = points.len();
        let points: Vec<Point> = points.iter().map(|p| Point::from(p.map(f64::from))).collect();
        let triangles = corners.iter().map(|t| t.map(|v| (v % count) as u32));
        let triangles: Vec<[u32; 3]> = triangles.filter(|[a, b, c]| a != b && b != c && c != a).collect();
        // Axes, so that reading normals as unit vectors changes no bit.
        let axis = |i: usize| [Vector::x(), -Vector::y(), Vector::z()][i % 3];
        let normals = if oriented { (0..count).map(axis).collect() } else { vec![] };
        let mesh = Mesh { points, normals, triangles };
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("mesh.ply");
        lacuna_host::io::write_ply(&path, &lacuna_host::io::PlyOut::new(&mesh)).unwrap();
        let back = lacuna_host::io::read(&path).unwrap();
        prop_assert_eq!(&back.points, &mesh.points);
        prop_assert_eq!(&back.normals, &mesh.normals);
        prop_assert_eq!(&back.triangles, &mesh.triangles);
    }

    /// Of a completion only the hull sees every point: the order of points changes no bit behind the pose.
    #[test]
    fn a_completion_does_not_depend_on_the_order_of_points(
        points in Just(tiny().scan.points.clone()).prop_shuffle(),
    ) {
        let model = tiny().model();
        let settings = lacuna::completion::Settings { rounds: &[], ..tiny().settings() };
        let digest = |points: &[lacuna::cloud::Packed]| {
            let cloud = lacuna::Cloud::new(points, tiny().scan.begin.step).unwrap();
            let (outcome, distances) = completed::<Fixed>(&model, cloud, tiny().scan.begin.pose, settings, 0).unwrap();
            (outcome.digests, distances)
        };
        prop_assert_eq!(digest(&points), digest(&tiny().scan.points));
    }

    /// A packed scan in bytes gives back its points, step and pose.
    #[test]
    fn a_packed_scan_comes_back_from_its_bytes(
        points in prop::collection::vec(prop::array::uniform6(any::<i16>()), 0..50),
        step in 1e-6f32..1e3,
        shift in prop::array::uniform3(-1e3f32..1e3),
        number in 0u8..3,
    ) {
        let hint = Hint::from_byte(number);
        let pose = lacuna::Pose { translation: shift, scale: step, ..lacuna::Pose::IDENTITY };
        let bytes = lacuna_host::points::PackedPoints { points: points.clone(), step }.to_bytes(&pose, hint);
        let back = lacuna::cloud::Bytes(&bytes);
        prop_assert_eq!((back.step(), back.pose(), back.hint()), (step, pose, hint));
        prop_assert_eq!(back.points().collect::<Vec<_>>(), points);
    }
}
