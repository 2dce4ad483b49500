use super::*;
use crate::mesh::Point;
use crate::points::OrientedPoints;
use crate::synth::scanner::Kind;
use lacuna::Pose;
use lacuna::schedule::MOMENTUM;

const SCHEDULE: Schedule<'static> = Schedule { stride: 2, momentum: 179, passes: &MOMENTUM };

/// Median and worst difference in units of the core's distances, 1/256 voxel.
fn units(report: &Report, stage: Stage, rungs: Rungs) -> (f64, f64) {
    let found = report.get(stage, rungs).unwrap();
    let unit = report.voxel_mm / 256.0;
    (found.median / unit, found.worst / unit)
}

/// A class that is quick to train.
fn tiny() -> Case {
    let class = Class { name: "tiny", shapes: 3, spacing_mm: 9.0, kind: Kind::Side, ..Class::SMALL };
    Case::synthetic(&class).unwrap()
}

#[test]
fn the_rungs_of_the_small_case_agree() {
    let report = verify(&Case::small().unwrap(), SCHEDULE, None).unwrap();
    println!("{report}");
    assert_eq!(report.comparisons.len(), 12);

    // The core's arithmetic: half a unit is the rounding of its output.
    assert_eq!(units(&report, Stage::Hull, Rungs::FileFloat).1, 0.0);
    assert!(report.get(Stage::GlobalWeights, Rungs::FileFloat).unwrap().worst < 1e-9);
    assert!(units(&report, Stage::GlobalDistances, Rungs::FileFloat).1 < 0.501);
    // The core's curvature takes the gains in 1/256: another half unit and more (measured: 1.21).
    assert!(units(&report, Stage::LocalDistances, Rungs::FileFloat).1 < 1.5);

    // Rounding: hull and global weights are computed alike.
    assert_eq!(units(&report, Stage::Hull, Rungs::FloatFixed), (0.0, 0.0));
    assert_eq!(report.get(Stage::GlobalWeights, Rungs::FloatFixed).unwrap().worst, 0.0);
    assert!(units(&report, Stage::GlobalDistances, Rungs::FloatFixed).1 <= 4.0);
    let (median, worst) = units(&report, Stage::LocalDistances, Rungs::FloatFixed);
    assert!(median <= 1.0 && worst <= 24.0, "{median} {worst}");

    // Quantisation. Where two points are about equally near, the hulls may take different ones.
    assert!(units(&report, Stage::Hull, Rungs::ReferenceFloat).0 < 1.0);
    assert!(report.get(Stage::GlobalWeights, Rungs::ReferenceFloat).unwrap().worst < 0.03);
    assert!(units(&report, Stage::GlobalDistances, Rungs::ReferenceFloat).1 < 6.0);
    let (median, worst) = units(&report, Stage::LocalDistances, Rungs::ReferenceFloat);
    assert!(median < 1.5 && worst < 64.0, "{median} {worst}");
}

#[test]
fn digests_do_not_depend_on_the_number_of_threads() {
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| verify_core(&tiny(), SCHEDULE, None).unwrap())
    };
    assert_eq!(run(1), run(3));
}

#[test]
fn golden_digests_name_the_first_stage_that_changed() {
    let case = tiny();
    let found = verify_core(&case, SCHEDULE, None).unwrap();
    assert!(found.changed().is_empty());
    assert_eq!(found.comparisons.len(), 4);
    let same = verify_core(&case, SCHEDULE, Some(found.digests)).unwrap();
    assert!(same.changed().is_empty() && same.to_string().ends_with("golden: equal"));
    let golden = Digests { local: 1, distances: 2, ..found.digests };
    let changed = verify_core(&case, SCHEDULE, Some(golden)).unwrap();
    assert_eq!(changed.changed(), ["local", "distances"]);
    assert!(changed.to_string().ends_with("golden: changed in local, distances"));
}

#[test]
fn a_scan_in_the_model_frame_needs_no_pose() {
    let case = tiny();
    let model = Model::from_bytes(&case.model).unwrap();
    let (spacing, origin) = (model.header().spacing, model.header().origin);
    let back = |p: &Point| {
        let voxel = case.pose.apply(p.coords.map(|c| c as f32).into());
        Point::from(std::array::from_fn(|a| f64::from(voxel[a] * spacing + origin[a])))
    };
    let turn = |n: &crate::mesh::Vector| case.pose.rotate(n.map(|c| c as f32).into()).map(f64::from).into();
    let points = OrientedPoints {
        points: case.points.points.iter().map(back).collect(),
        normals: case.points.normals.iter().map(turn).collect(),
    };
    let pose = Pose::in_frame_of(model.header(), Pose::IDENTITY.rotation, 1.0, [0.0; 3]);
    let file = case.model.clone();
    let moved = Case { name: "moved".into(), model: file, points, pose, rounds: &[], volumes: None };
    let (a, b) = (verify_core(&case, SCHEDULE, None).unwrap(), verify(&moved, SCHEDULE, None).unwrap());
    assert!(a.hull_voxels.abs_diff(b.hull_voxels) < 9, "{} {}", a.hull_voxels, b.hull_voxels);
    assert_eq!(b.comparisons.len(), 8, "no training volumes, no rung 1");
}

#[test]
fn reports_are_written_for_programs_and_for_people() {
    let report = verify_core(&tiny(), SCHEDULE, None).unwrap();
    let json = serde_json::to_value(&report).unwrap();
    assert_eq!(json["comparisons"][3]["stage"], "local_distances");
    assert_eq!(json["comparisons"][3]["rungs"], "2-3");
    let text = report.to_string();
    let rows: Vec<&str> = text.lines().skip(1).take(5).collect();
    assert!(rows[1..].iter().all(|row| row.len() == rows[0].len() + 4), "{text}");
}

#[test]
fn a_damaged_model_is_refused() {
    let mut case = tiny();
    case.model[100] ^= 1;
    let refused = verify(&case, SCHEDULE, None).unwrap_err();
    assert!(refused.to_string().contains("damaged"));
}
