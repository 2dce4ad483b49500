//! Parts of a real head with hair and collar, in any place and size: each comes out right and is not refused; what of the
//! scan is no head is.

use lacuna::{Fixed, Model};
use lacuna_host::check::alternatives::advice;
use lacuna_host::complete::verdict::Grade;
use lacuna_host::complete::{Completion, Options, complete};
use lacuna_host::mesh::{Mesh, Point, Vector};
use lacuna_host::surface::keep_triangles;
use lacuna_tests::nine::raw_head;
use lacuna_tests::registration::{Difference, similarity_of};
use lacuna_tests::trained::thirty_faces;
use nalgebra::Similarity3;
use std::f64::consts::PI;

/// Degrees and class millimetres from the pose of the whole head: parts leave a pose open by some, a wrong one is twenty
/// degrees or thirty millimetres off.
const MOST_OFF: (f64, f64) = (5.0, 9.0);

fn completed(model: &Model<'_>, scan: &Mesh) -> Completion {
    let options = Options { finer: 1, ..Options::of(model) };
    complete::<Fixed>(model, scan, &options).expect("a completion")
}

/// The part of a scan that `kept` says yes to.
fn part(scan: &Mesh, kept: impl Fn(&Point) -> bool) -> Mesh {
    keep_triangles(scan, |t| {
        let [a, b, c] = scan.corners(t);
        kept(&Point::from((a.coords + b.coords + c.coords) / 3.0))
    })
}

/// What of the raw head is kept; the middle of the face is at x = 16, the chin at y = -45, the ears at z = 0.
type Kept = fn(&Point) -> bool;

#[test]
fn parts_of_a_raw_head_are_completed_in_any_place_and_size() {
    let (Some((scan, whole)), Some(model)) = (raw_head(), thirty_faces()) else { return };
    let whole = similarity_of(&whole.placed);
    let parts: [(&str, Kept, [f64; 3], f64); 7] = [
        ("right half", |p| p.x < 22.0, [0.0, 0.0, PI], 0.85),
        (
            "face alone",
            |p| (p.x - 16.0).abs() < 60.0 && p.y > -60.0 && p.y < 110.0 && p.z > 20.0,
            [0.0, 2.0, 0.3],
            1.0,
        ),
        ("no face", |p| p.z < 60.0, [0.0; 3], 1.0),
        ("upper half", |p| p.y > 10.0, [1.0, 2.0, 3.0], 1.2),
        ("lower half", |p| p.y < 45.0, [3.0, 1.0, 0.0], 0.9),
        ("left quarter", |p| p.x > 10.0 && p.z > 10.0, [PI, 3.0, 0.0], 1.2),
        ("no shoulders", |p| p.y > -120.0, [2.0, 0.0, 2.0], 1.1),
    ];
    for (name, kept, turn, size) in parts {
        let motion = Similarity3::new(Vector::new(300.0, -50.0, 120.0), Vector::from(turn), size);
        let mesh = part(scan, kept).moved(&motion);
        let completion = completed(&model, &mesh);
        let found = similarity_of(&completion.placed) * motion;
        let off = Difference::between(&found, &whole, &model);
        let verdict = &completion.verdict;
        println!(
            "{name}: {off:?}, inliers and next {:.2?}, {:?}",
            verdict.evidence.pose_inliers, verdict.reasons
        );
        assert!(off.degrees < MOST_OFF.0 && off.millimetres < MOST_OFF.1, "{name}: {off:?}");
        assert_ne!(verdict.grade, Grade::Reject, "{name}: {:?}", verdict.reasons);
        if name == "right half" {
            assert_eq!(
                advice(&model, &mesh, 1, (verdict.evidence.pose_inliers[0], verdict.evidence.scale)),
                None,
                "turned round it would fit no better"
            );
        }
    }
}

#[test]
fn what_of_a_scan_is_no_head_is_rejected() {
    let (Some((scan, _)), Some(model)) = (raw_head(), thirty_faces()) else { return };
    let parts: [(&str, Kept); 2] =
        [("shoulders", |p| p.y < -95.0), ("hair", |p| p.y > 95.0 || p.z < 0.0 && p.y > 0.0)];
    for (name, kept) in parts {
        let verdict = completed(&model, &part(scan, kept)).verdict;
        println!("{name}: {:?}", verdict.reasons);
        assert_eq!(verdict.grade, Grade::Reject, "{name}");
    }
}
