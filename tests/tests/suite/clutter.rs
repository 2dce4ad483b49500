//! What is not part of the class neither pulls the fit nor vanishes unasked.

use lacuna::pose_row::steepness;
use lacuna::{Fixed, Pose, Standing, pose_fit, sample as sampled};
use lacuna_host::complete::clutter::CLUTTER;
use lacuna_host::complete::merge::Merged;
use lacuna_host::complete::verdict::Grade;
use lacuna_host::complete::{Completion, GivenPose, Options, complete};
use lacuna_host::distance::Surface;
use lacuna_host::io::{PlyOut, write_ply};
use lacuna_host::mesh::{Mesh, Point};
use lacuna_host::register::{Placed, register};
use lacuna_host::synth::{Head, Kind, Scan, ScannerSettings, Surrounding, scan};
use lacuna_tests::program::{json, succeeds};
use lacuna_tests::registration::{Difference, similarity_of};
use lacuna_tests::sample::head_among;
use lacuna_tests::{model, real_data, voxel_pose};
use tempfile::tempdir;

/// How far clutter may move the completed surface, root mean square in scan units. Measured: 0.33 and
/// 0.43, depending on which points the pose is estimated from; all of it comes by the pose (0.007 when the pose is given
/// exactly).
const PULL: f64 = 0.5;

/// A table under a head and a collar around its neck, in the head's frame.
fn clutter(head: &Mesh) -> Mesh {
    let bounds = head.bounds().expect("a head");
    let mut all = Surrounding::Table.mesh(bounds, 1);
    all.append(&Surrounding::Collar.mesh(bounds, 1));
    all
}

fn sample() -> (Mesh, Scan) {
    let head = Head::sample(1, 1001).mesh();
    let scan = scan(&head, Kind::Front, &ScannerSettings::small(), 1001);
    (head, scan)
}

/// The scan in the head's frame, where its pose is known.
fn in_head_frame(scan: &Scan) -> Mesh {
    let back = scan.model_to_scan.try_inverse().expect("a similarity");
    let mut mesh = scan.mesh.clone();
    mesh.points.iter_mut().for_each(|p| *p = back.transform_point(p));
    mesh
}

fn exact_pose() -> Pose {
    voxel_pose(&model())
}

/// From a rough pose, or from none.
fn completed(mesh: &Mesh, hint: Option<Pose>) -> Completion {
    let model = model();
    let pose =
        hint.map_or(GivenPose::None, |pose| GivenPose::Rough(Placed { centre: Point::origin(), pose }));
    let options = Options { pose, finer: 1, ..Options::of(&model) };
    complete::<Fixed>(&model, mesh, &options).expect("a completion")
}

fn completed_from_near(mesh: &Mesh) -> Completion {
    let rough = exact_pose().moved([40.0; 3], [0.03, -0.04, 0.05], 0.02, [0.8, -0.6, 0.5]);
    completed(mesh, Some(rough))
}

fn rms_between(a: &Mesh, b: &Mesh) -> f64 {
    let surface = Surface::new(b).expect("a surface");
    let found = a.points.iter().filter_map(|p| surface.distance(p, f64::INFINITY)).filter(|d| !d.on_border);
    let squares: Vec<f64> = found.map(|d| d.value * d.value).collect();
    (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt()
}

#[test]
fn a_table_and_a_collar_do_not_pull_and_are_measured() {
    let (head, scan) = sample();
    let clean = in_head_frame(&scan);
    let mut cluttered = clean.clone();
    let added = clutter(&head);
    cluttered.append(&added);
    let (alone, with) = (completed_from_near(&clean), completed_from_near(&cluttered));
    let pull = rms_between(&with.merged.mesh, &alone.merged.mesh);
    let extra = with.clutter.area - alone.clutter.area;
    println!("pull {pull:.4}, left out {extra:.0} of {:.0} added", added.area());
    assert!(pull < PULL, "the clutter moved the surface by {pull:.3}");
    assert!((extra / added.area() - 1.0).abs() < 0.05, "{extra:.0} of {:.0}", added.area());
    kept_apart(&with);
}

/// Most of what lies on the model is hair and clothes: few of the points that the core takes would be the head's, and the
/// size found would be that of the hair, 15 to 18 per cent off and rejected.
#[test]
fn a_head_among_hair_and_clothes_is_completed_in_its_pose() {
    let (head, scan) = sample();
    let clean = in_head_frame(&scan);
    let bounds = head.bounds().expect("a head");
    let truth = similarity_of(&Placed { centre: Point::origin(), pose: exact_pose() });
    let mut scene = clean;
    let things = [Surrounding::Table, Surrounding::Hair, Surrounding::Collar];
    scene.append(&Surrounding::meshes(things, bounds, 1));
    let found = completed(&scene, None);
    let off = Difference::between(&similarity_of(&found.placed), &truth, &model());
    println!("{off:?}, {:?}", found.verdict);
    assert!(off.degrees < 2.0 && off.growth.abs() < 0.03, "{off:?}");
    assert_eq!(found.verdict.grade, Grade::Check, "{:?}", found.verdict.reasons);
}

/// Registration leaves hair and collar out of these heads' poses; the core's wide steps, which take all points, would make them
/// 18 and 6 per cent larger again.
#[test]
fn a_pose_found_among_clutter_is_kept_by_the_fit() {
    let model = model();
    for number in [1011, 1019] {
        let scene = head_among(number, Kind::Front, &[Surrounding::Hair, Surrounding::Collar]).scan;
        let found = register(&model, &scene, 1).expect("a pose");
        assert_eq!(found.hint(), pose_fit::Hint::Settled);
        let completion = completed(&scene, None);
        let [found, kept] = [&found.placed, &completion.placed].map(|placed| placed.size(&model));
        println!("head {number}: size {found:.3}, then {kept:.3}");
        assert!((kept / found - 1.0).abs() < 0.03, "head {number}: size {found:.3}, then {kept:.3}");
    }
}

/// The appended clutter shares no vertex with the completed mesh, which stays as it was.
fn kept_apart(completion: &Completion) {
    let (merged, clutter) = (&completion.merged, &completion.clutter);
    let all: Merged = clutter.append_to(merged);
    assert_eq!(all.mesh.points[..merged.mesh.points.len()], merged.mesh.points[..]);
    assert_eq!(all.mesh.triangles.len(), merged.mesh.triangles.len() + clutter.mesh.triangles.len());
    let kinds = |t: &[u32; 3]| t.iter().filter(|&&v| all.labels[v as usize] == CLUTTER).count();
    assert!(all.mesh.triangles.iter().all(|t| matches!(kinds(t), 0 | 3)), "a triangle joins both");
}

#[test]
fn the_program_keeps_clutter_only_when_asked() {
    let folder = tempdir().unwrap();
    let (head, scan) = sample();
    let mut mesh = in_head_frame(&scan);
    mesh.append(&clutter(&head));
    write_ply(&folder.path().join("scan.ply"), &PlyOut::new(&mesh)).unwrap();
    let run = |more: &[&str]| {
        let base = ["complete", "scan.ply", "--pose-hint", "identity", "--no-picture", "--json"];
        json(folder.path(), &[&base, more].concat())
    };
    let vertices = |name: &str| lacuna_host::io::read(&folder.path().join(name)).unwrap().points.len();
    let (without, with) = (run(&["-o", "a.ply"]), run(&["-o", "b.ply", "--keep-clutter"]));
    let points = without["clutter"]["points"].as_u64().unwrap() as usize;
    assert!(points > 1000 && without["clutter"]["area"].as_f64().unwrap() > 100_000.0, "{without:#}");
    assert_eq!((&without["clutter"]["kept"], &with["clutter"]["kept"]), (&false.into(), &true.into()));
    assert_eq!(vertices("b.ply"), vertices("a.ply") + points);
    let text = succeeds(folder.path(), &["complete", "scan.ply", "--pose-hint", "identity", "--no-picture"]);
    assert!(text.contains("not the class"), "{text}");
}

#[test]
fn the_demo_scan_leaves_its_collar_out() {
    let Some(path) = real_data("faces/targets_real/demoface_raw.ply") else { return };
    let scan = lacuna_host::io::read(&path).unwrap();
    let model = model();
    let options = Options { finer: 1, ..Options::of(&model) };
    // The built-in class is made of heads from a formula: it says nothing about quality, only what happens to the rest.
    let completion = complete::<Fixed>(&model, &scan, &options).expect("a completion");
    assert!(completion.clutter.area_share > 0.3, "{:.2}", completion.clutter.area_share);
    kept_apart(&completion);
}

/// Outside the band only the mean is known: what is far in front of it is left out, as a collar that draws the neck to where the
/// band ends.
#[test]
fn what_is_far_in_front_of_the_mean_is_left_out_where_no_voxel_is_stored() {
    let model = model();
    let sides = model.grid().sides();
    let millimetre = model.header().scales.millimetre;
    let mut found = [0; 3];
    for i in 0..sides.iter().map(|&side| usize::from(side)).product() {
        let at = lacuna_host::raster::voxel(sides.map(usize::from), i).map(|v| v as f32 + 0.5);
        let Some((distance, gradient)) = sampled::far(&model, at) else { continue };
        let away = distance / (steepness(gradient) * millimetre);
        let left_out = Standing::of(&model, at, [0.0; 3], |_| None).is_left_out();
        assert_eq!(left_out, away > 8.0, "{away} in front of the mean at {at:?}");
        found[usize::from(away > 0.0) + usize::from(left_out)] += 1;
    }
    assert!(found.iter().all(|&count| count > 1000), "behind, near, far: {found:?}");
}
