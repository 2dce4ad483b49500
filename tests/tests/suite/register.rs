//! Registration without a hint on heads of the built-in class: what must not mislead it, and that neither threads nor
//! seeds change its answer.

use lacuna::Model;
use lacuna_host::mesh::{Mesh, Point, Vector};
use lacuna_host::register::field::Field;
use lacuna_host::register::{Registration, refine_hint, register};
use lacuna_host::synth::{Kind, Surrounding};
use lacuna_tests::model;
use lacuna_tests::registration::{Difference, Way, moved, placed, similarity_of, to_voxels};
use lacuna_tests::sample::{Sample, head, head_among};
use nalgebra::{Similarity3, UnitQuaternion};

/// A scan, and where it lies in the model.
struct Known {
    scan: Mesh,
    to_model: Similarity3<f64>,
}

impl Known {
    fn of(model: &Model<'_>, sample: Sample) -> Self {
        let to_shapes = nalgebra::convert_unchecked(sample.scan_to_model());
        Self { scan: sample.scan, to_model: to_voxels(model, &to_shapes) }
    }

    /// In another place, `size` times as large as the class.
    fn moved(&self, model: &Model<'_>, turn: Vector, size: f64) -> Self {
        let way =
            Way { turn: UnitQuaternion::from_scaled_axis(turn), size, shift: Vector::new(3.0, -1.0, 2.0) };
        let (scan, motion) = moved(&self.scan, &way, &self.to_model, model);
        Self { scan, to_model: self.to_model * motion.inverse() }
    }

    fn registered(&self, model: &Model<'_>) -> Registration {
        register(model, &self.scan, 1).expect("a pose")
    }

    /// How far a pose is from the one that the true one is refined to.
    fn off(&self, model: &Model<'_>, found: &Registration) -> Difference {
        let known = refine_hint(model, &self.scan, &placed(&self.to_model)).expect("a pose");
        Difference::between(&similarity_of(&found.placed), &similarity_of(&known.placed), model)
    }

    #[track_caller]
    fn assert_found(&self, model: &Model<'_>, what: &str) -> Registration {
        let found = self.registered(model);
        let off = self.off(model, &found);
        println!("{what}: {off:?}, inliers {:.3}, next {:.3}", found.inliers, found.runner_up);
        assert!(off.same(), "{what}: {off:?}, inliers {:.3}, next {:.3}", found.inliers, found.runner_up);
        found
    }

    /// The part of the scan in front of a plane of the class's frame (voxels).
    fn cut(&self, normal: Vector, beyond: f64) -> Self {
        let inside = |p: &Point| (self.to_model * p).coords.dot(&normal) > beyond;
        let kept = |corners: &&[u32; 3]| corners.iter().all(|&v| inside(&self.scan.points[v as usize]));
        let triangles = self.scan.triangles.iter().filter(kept).copied().collect();
        Self { scan: Mesh { triangles, ..self.scan.clone() }, to_model: self.to_model }
    }

    /// With `share` of all surface a wavy sheet, which passes by the chin, and a ball behind the head.
    fn cluttered(&self, share: f64) -> Self {
        let own = self.scan.area();
        let clutter = own * share / (1.0 - share);
        let (low, high) = self.bounds();
        let scale = self.to_model.scaling();
        let side = (0.7 * clutter).sqrt() * scale;
        let radius = (0.3 * clutter / (4.0 * std::f64::consts::PI)).sqrt() * scale;
        let middle = nalgebra::center(&low, &high);
        let sheet = grid(40, |u, v| {
            let (x, z) = ((u - 0.5) * side, (v - 0.5) * side);
            Point::new(middle.x + x, low.y + 3.0 + 0.05 * side * (8.0 * u + 3.0 * v).sin(), middle.z + z)
        });
        let ball = grid(24, |u, v| {
            let (around, up) = (u * std::f64::consts::TAU, v * std::f64::consts::PI);
            let direction = Vector::new(around.cos() * up.sin(), up.cos(), -around.sin() * up.sin());
            Point::new(high.x, high.y, low.z) + direction * radius
        });
        let mut scan = Mesh { normals: vec![], ..self.scan.clone() };
        for part in [sheet, ball] {
            scan.append(&part.moved(&self.to_model.inverse()));
        }
        assert!((1.0 - own / scan.area() - share).abs() < 0.05, "clutter {}", 1.0 - own / scan.area());
        Self { scan, to_model: self.to_model }
    }

    /// With what is around heads, in proportion to the mean shape.
    fn in_a_scene(&self, model: &Model<'_>, with: &[Surrounding]) -> Self {
        let points = Field::of_model(model).samples.points;
        let bounds = Mesh { points, ..Mesh::default() }.bounds().expect("a mean shape");
        let mut scan = Mesh { normals: vec![], ..self.scan.clone() };
        for thing in with {
            scan.append(&thing.mesh(bounds, 1).moved(&self.to_model.inverse()));
        }
        Self { scan, to_model: self.to_model }
    }

    /// On smooth, wide shoulders: half an ellipsoid in front, in terms of half the head's height below and beside its middle.
    fn on_shoulders(&self, [wide, high, deep]: [f64; 3]) -> Self {
        let (low, top) = self.bounds();
        let (middle, half) = (nalgebra::center(&low, &top), (top.y - low.y) / 2.0);
        let shoulders = grid(60, |u, v| {
            let (around, up) = ((0.5 - u) * 3.0, (v - 0.5) * 3.0);
            let out = Vector::new(
                wide * around.sin() * up.cos(),
                high * up.sin() - 1.25 - high,
                deep * around.cos() * up.cos() - 0.7,
            );
            middle + out * half
        });
        let mut scan = Mesh { normals: vec![], ..self.scan.clone() };
        scan.append(&shoulders.moved(&self.to_model.inverse()));
        Self { scan, to_model: self.to_model }
    }

    fn bounds(&self) -> (Point, Point) {
        let points = self.scan.points.iter().map(|p| self.to_model * p).collect();
        Mesh { points, ..Mesh::default() }.bounds().expect("points")
    }
}

/// A patch of n x n cells.
fn grid(n: u32, place: impl Fn(f64, f64) -> Point) -> Mesh {
    let share = |i: u32| f64::from(i) / f64::from(n);
    let points = (0..=n).flat_map(|j| (0..=n).map(move |i| (i, j)));
    let points = points.map(|(i, j)| place(share(i), share(j))).collect();
    let corner = |i: u32, j: u32| j * (n + 1) + i;
    let cells = (0..n).flat_map(|j| (0..n).map(move |i| (i, j)));
    let halves = cells.flat_map(|(i, j)| {
        let [a, b, c, d] = [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)];
        [[a, c, b], [a, d, c]]
    });
    Mesh { points, normals: vec![], triangles: halves.collect() }
}

fn front(model: &Model<'_>, number: u64) -> Known {
    Known::of(model, head(number, Kind::Front))
}

fn side(model: &Model<'_>, number: u64) -> Known {
    Known::of(model, head(number, Kind::Side))
}

#[test]
fn upside_down_too_small_and_too_large() {
    let model = model();
    for (number, size) in [(1001, 0.8), (1002, 1.0), (1003, 1.25)] {
        let upside_down = Vector::new(0.1, 0.2, std::f64::consts::PI);
        front(&model, number)
            .moved(&model, upside_down, size)
            .assert_found(&model, &format!("front, {size}"));
        side(&model, number).moved(&model, upside_down, size).assert_found(&model, &format!("side, {size}"));
    }
}

#[test]
fn the_mirrored_half_does_not_win() {
    let model = model();
    for number in 1001..=1003 {
        let whole = front(&model, number);
        let (low, high) = whole.bounds();
        let middle = nalgebra::center(&low, &high).x;
        for sign in [1.0, -1.0] {
            let half = whole.cut(Vector::x() * sign, middle * sign);
            let found =
                half.moved(&model, Vector::new(0.5, 2.0, -1.0), 1.0).assert_found(&model, "half a head");
            assert!(found.runner_up < found.inliers, "no margin: {found:?}");
        }
    }
}

/// The right place, that is; the size is softer with clutter: one of these is found nine per cent larger than from the
/// true pose, with more inliers.
#[test]
fn clutter_is_not_what_is_looked_for() {
    let model = model();
    for number in 1001..=1003 {
        let cluttered = front(&model, number).cluttered(0.4).moved(&model, Vector::new(2.0, -1.0, 0.3), 0.9);
        let found = cluttered.registered(&model);
        let off = cluttered.off(&model, &found);
        println!("clutter: {off:?}, inliers {:.3}, next {:.3}", found.inliers, found.runner_up);
        assert!(off.degrees < 5.0 && off.millimetres < 15.0, "head {number}: {off:?}");
    }
}

/// Each head in four scenes, by turns from the front and from the side.
#[test]
fn a_table_hair_and_a_collar_do_not_hide_a_head() {
    let model = model();
    let [table, hair, collar] = [Surrounding::Table, Surrounding::Hair, Surrounding::Collar];
    let scenes: [&[Surrounding]; 4] = [&[table], &[hair], &[table, collar], &[table, hair, collar]];
    let ways = [Vector::new(2.0, -1.0, 0.3), Vector::new(0.2, 0.1, 3.0), Vector::new(-1.0, 2.5, 0.0)];
    for (number, (turn, size)) in (1001..).zip(ways.into_iter().zip([0.85, 1.0, 1.2])) {
        for (turns, with) in (number..).zip(scenes) {
            let scan = if turns % 2 == 0 { front(&model, number) } else { side(&model, number) };
            let scene = scan.in_a_scene(&model, with).moved(&model, turn, size);
            let found = scene.registered(&model);
            let off = Difference::between(&similarity_of(&found.placed), &scene.to_model, &model);
            println!("{number} {with:?}: {off:?}, inliers {:.3}, next {:.3}", found.inliers, found.runner_up);
            assert!(off.degrees < 5.0 && off.growth.abs() < 0.1, "head {number}, {with:?}: {off:?}");
        }
    }
}

/// Shoulders explain more of these scans than the head does: each was found on them, 1.1 to 1.9 times as large.
#[test]
fn a_head_is_found_on_smooth_shoulders_of_several_times_its_area() {
    let model = model();
    let sizes = [[1.6, 0.7, 0.75], [1.8, 0.95, 0.85], [2.2, 1.2, 1.0], [3.0, 1.6, 1.4]];
    for (number, size) in (1001..).zip(sizes) {
        let scene = front(&model, number).on_shoulders(size).moved(&model, Vector::new(2.0, -1.0, 0.3), 1.0);
        let found = scene.registered(&model);
        let off = Difference::between(&similarity_of(&found.placed), &scene.to_model, &model);
        println!("{number}: {off:?}, inliers {:.3}, next {:.3}", found.inliers, found.runner_up);
        assert!(off.degrees < 5.0 && off.growth.abs() < 0.08, "head {number}: {off:?}");
    }
}

/// A collar in place of the neck was taken for the jaw: with sizes compared among it and the hair, these were found 16 to 26 per
/// cent too large.
#[test]
fn a_collar_and_hair_around_a_head_do_not_give_it_their_size() {
    let model = model();
    for number in [1011, 1015, 1018, 1021] {
        let with = [Surrounding::Hair, Surrounding::Collar];
        let scene = Known::of(&model, head_among(number, Kind::Front, &with));
        let found = scene.registered(&model);
        let off = Difference::between(&similarity_of(&found.placed), &scene.to_model, &model);
        println!("{number}: {off:?}, inliers {:.3}, next {:.3}", found.inliers, found.runner_up);
        assert!(off.degrees < 5.0 && off.growth.abs() < 0.08, "head {number}: {off:?}");
    }
}

#[test]
fn neither_threads_nor_seeds_change_the_pose() {
    let model = model();
    let scan = side(&model, 1001).cluttered(0.4).moved(&model, Vector::new(-1.0, 0.4, 2.0), 1.1);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| scan.registered(&model))
    };
    let one = with(1);
    for threads in [2, 5] {
        let other = with(threads);
        assert_eq!(one.placed.pose, other.placed.pose, "{threads} threads");
        assert_eq!([one.inliers, one.runner_up], [other.inliers, other.runner_up], "{threads} threads");
    }
    for seed in 2..=5 {
        let found = register(&model, &scan.scan, seed).expect("a pose");
        let off = scan.off(&model, &found);
        assert!(off.same(), "seed {seed}: {off:?}");
    }
}
