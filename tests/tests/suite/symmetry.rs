//! The mirror prior: its plane is found, its voxels are second to measured ones, and it helps where a side is missing.

use lacuna::hull::Target;
use lacuna::{Fixed, HullBuilder, Model, Reach, mirror};
use lacuna_host::complete::{GivenPose, Options, complete};
use lacuna_host::mesh::{Mesh, Point, Vector};
use lacuna_host::register::Placed;
use lacuna_host::synth::{Head, Kind};
use lacuna_host::train::{Error, Settings, train};
use lacuna_tests::sample::{Sample, head};
use lacuna_tests::{head_points, in_voxels, model, voxel_pose};
use nalgebra::{Matrix4, Rotation3, Translation3};

type Oriented = ([f32; 3], [f32; 3]);

fn targets(real: &[Oriented], mirrored: &[Oriented], mirrored_first: bool) -> Vec<i16> {
    let model = model();
    let (mut targets, mut keys) = (vec![0; model.voxels()], vec![0i16; model.voxels()]);
    let mut builder = HullBuilder::new(&model, Reach::of(&model), &mut targets, &mut keys).unwrap();
    if mirrored_first {
        mirrored.iter().for_each(|&(point, normal)| builder.add_mirrored(point, normal));
    }
    real.iter().for_each(|&(point, normal)| builder.add(point, normal));
    if !mirrored_first {
        mirrored.iter().for_each(|&(point, normal)| builder.add_mirrored(point, normal));
    }
    builder.finish();
    targets
}

/// Points of a head on the left of its middle, and on the right.
fn halves() -> [Vec<Oriented>; 2] {
    let model = model();
    let points = in_voxels(&head_points(1000), &voxel_pose(&model));
    let middle = voxel_pose(&model).apply([0.0; 3])[0];
    let (left, right) = points.into_iter().partition(|(p, _)| p[0] > middle);
    [left, right]
}

#[test]
fn mirrored_points_claim_only_what_no_measured_point_claims() {
    let [left, right] = halves();
    let alone = targets(&left, &[], false);
    let both = targets(&left, &right, false);
    assert!(both == targets(&left, &right, true), "the order does not matter");
    let mut mirrored = 0;
    for (&alone, &both) in alone.iter().zip(&both) {
        if Target(alone).weight() != 0 {
            assert_eq!(alone, both, "a measured voxel stays what it is");
        } else if Target(both).weight() != 0 {
            assert_eq!(Target(both).weight(), mirror::WEIGHT);
            mirrored += 1;
        }
    }
    assert!(mirrored > 1000, "{mirrored}");
}

#[test]
fn mirrored_voxels_are_dropped_where_they_bring_little() {
    let [left, right] = halves();
    let few = &right[..right.len() / 10];
    let hull = |mirrored| -> Vec<Target> {
        let all = targets(&left, mirrored, false).into_iter().map(Target);
        all.map(|target| if target.weight() == 0 { Target(0) } else { target }).collect()
    };
    assert!(hull(few) == hull(&[]), "as without");
}

fn class(count: u64, change: impl Fn(&Point) -> Point) -> Vec<Mesh> {
    let moved = |mut mesh: Mesh| {
        mesh.points.iter_mut().for_each(|p| *p = change(p));
        mesh
    };
    (0..count).map(|number| moved(Head::sample(1, number).mesh())).collect()
}

fn settings(symmetric: bool) -> Settings {
    Settings { spacing: Some(5.0), symmetric, ..Settings::default() }
}

#[test]
fn the_plane_is_found_in_any_pose() {
    let turn = Rotation3::from_euler_angles(0.4, -0.9, 2.1);
    let shift = Translation3::new(40.0, -300.0, 12.0);
    let shapes = class(6, |p| shift * (turn * p));
    let bytes = train(&shapes, &settings(true), &|_, _| {}).unwrap();
    let model = Model::from_bytes(&bytes).unwrap();
    let plane = model.symmetry().expect("a plane");
    let normal = Vector::from(plane.normal.map(f64::from));
    let expected = turn * Vector::x();
    let degrees = normal.dot(&expected).abs().min(1.0).acos().to_degrees();
    let origin = Vector::from(model.header().origin.map(f64::from));
    let offset = f64::from(plane.offset * model.header().spacing) + normal.dot(&origin);
    let distance = (normal.dot(&shift.vector) - offset).abs();
    println!("{degrees:.2} degrees, {distance:.2} mm off, deviation {:.2} voxels", plane.deviation);
    assert!(degrees < 1.0, "{degrees} degrees");
    assert!(distance < 1.0, "{distance} mm");
}

#[test]
fn a_class_without_a_plane_is_refused() {
    // Twisted about the vertical axis by a radian from chin to forehead.
    let shapes = class(4, |p| Rotation3::from_euler_angles(0.0, p.y / 100.0, 0.0) * p);
    let error = train(&shapes, &settings(true), &|_, _| {}).unwrap_err();
    assert!(matches!(error, Error::NotSymmetric { .. }), "{error}");
    assert!(error.to_string().contains("--symmetric"), "{error}");
}

fn in_the_models_frame(mut sample: Sample) -> Sample {
    let back = sample.scan_to_model();
    sample.scan.points.iter_mut().for_each(|p| *p = back.transform_point(p));
    Sample { model_to_scan: Matrix4::identity(), ..sample }
}

#[test]
fn a_scan_from_the_side_is_completed_better_with_the_other_sides_mirror_image() {
    let shapes = class(12, |p| *p);
    let missing = |symmetric: bool| -> f64 {
        let bytes = train(&shapes, &settings(symmetric), &|_, _| {}).unwrap();
        let model = Model::from_bytes(&bytes).unwrap();
        assert_eq!(model.symmetry().is_some(), symmetric);
        let sides: Vec<Sample> =
            (1001..=1003).map(|number| in_the_models_frame(head(number, Kind::Side))).collect();
        let still = Placed { centre: Point::origin(), pose: voxel_pose(&model) };
        let errors = sides.iter().map(|sample| {
            let options = Options { pose: GivenPose::Exact(still), ..Options::of(&model) };
            let completion = complete::<Fixed>(&model, &sample.scan, &options).unwrap();
            sample.rms_mm(&completion.merged.mesh, |i| sample.missing[i])
        });
        errors.sum::<f64>() / 3.0
    };
    let (without, with) = (missing(false), missing(true));
    println!("missing part {without:.2} mm without, {with:.2} mm with the mirror prior");
    assert!(with < 0.9 * without, "{with} against {without} mm");
}
