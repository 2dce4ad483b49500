//! Small pieces of a scan are kept where they lie on the shape, and are specks elsewhere.

use lacuna::Fixed;
use lacuna_host::complete::clean::clean;
use lacuna_host::complete::{Completion, GivenPose, Options, complete};
use lacuna_host::distance::Surface;
use lacuna_host::mesh::{Mesh, Point, Vector};
use lacuna_host::register::Placed;
use lacuna_host::surface::keep_triangles;
use lacuna_host::synth::{Head, Kind, ScannerSettings, scan};
use lacuna_tests::{model, voxel_pose};
use nalgebra::Translation3;

/// The triangles of `mesh` around `centre`, at least eight of them.
fn patch(mesh: &Mesh, centre: &Point) -> Mesh {
    let within =
        |radius: f64| keep_triangles(mesh, |t| mesh.corners(t).iter().all(|p| (p - centre).norm() < radius));
    let mut patches = (1..200).map(|i| within(0.1 * f64::from(i)));
    patches.find(|patch| patch.triangles.len() >= 8).expect("a patch")
}

fn moved(mesh: &Mesh, by: [f64; 3]) -> Mesh {
    mesh.moved(&nalgebra::convert(Translation3::from(by)))
}

fn completed(mesh: &Mesh) -> Completion {
    let model = model();
    let pose = GivenPose::Rough(Placed { centre: Point::origin(), pose: voxel_pose(&model) });
    let options = Options { pose, finer: 1, ..Options::of(&model) };
    complete::<Fixed>(&model, mesh, &options).expect("a completion")
}

#[test]
fn a_piece_on_the_hidden_side_is_kept_and_specks_are_not() {
    let head = Head::sample(1, 1001).mesh();
    let view = scan(&head, Kind::Front, &ScannerSettings::default(), 1001);
    let back = view.model_to_scan.try_inverse().expect("a similarity");
    let mut seen = clean(&view.mesh, 0.0).scan;
    seen.points.iter_mut().for_each(|p| *p = back.transform_point(p));
    let surface = Surface::new(&seen).expect("a surface");
    let away = |p: &Point| surface.distance(p, f64::INFINITY).map_or(0.0, |d| d.value);
    // On the side of the head, where no line of sight gets.
    let hidden = head.points.iter().filter(|p| (20.0..30.0).contains(&away(p)) && p.y.abs() < 40.0);
    let hidden = hidden.max_by(|a, b| a.x.total_cmp(&b.x)).expect("a hidden place");
    let nose = seen.points.iter().max_by(|a, b| a.z.total_cmp(&b.z)).expect("a nose");
    let cases = [
        ("hidden", patch(&head, hidden), true),
        ("beside the hidden side", moved(&patch(&head, hidden), [6.0, 0.0, 0.0]), false),
        ("over the nose", moved(&patch(&seen, nose), [0.0, 0.0, 5.0]), false),
        ("in the air", moved(&patch(&seen, nose), [90.0, 0.0, 30.0]), false),
    ];
    for (name, piece, kept) in cases {
        let mut mesh = seen.clone();
        mesh.append(&piece);
        let pieces = piece.triangles.len();
        assert_eq!(clean(&mesh, 0.0).small.triangles.len(), pieces, "{name}: as small as a speck");
        let more = completed(&mesh).scan.triangles.len() - seen.triangles.len();
        assert_eq!(more, if kept { pieces } else { 0 }, "{name}");
    }
}

#[test]
fn points_in_the_air_around_a_scan_are_specks_however_far_they_are() {
    let head = Head::sample(1, 1001).mesh();
    let view = scan(&head, Kind::Front, &ScannerSettings::default(), 1001).mesh;
    let mut cluttered = view.clone();
    // Single triangles up to 50 heads away: two points in a hundred.
    let added = view.points.len() / 150;
    for i in 0..added {
        let (turn, away) = (2.4 * i as f64, 200.0 + 50.0 * (i % 200) as f64);
        let at = Point::new(away * turn.cos(), away * turn.sin(), (i % 7) as f64 * 100.0 - 300.0);
        let first = cluttered.points.len() as u32;
        cluttered.points.extend([at, at + Vector::x(), at + Vector::y()]);
        cluttered.triangles.push([first, first + 1, first + 2]);
    }
    let model = model();
    let [alone, among] = [view, cluttered].map(|mesh| {
        let options = Options { finer: 1, ..Options::of(&model) };
        complete::<Fixed>(&model, &mesh, &options).expect("a completion")
    });
    assert_eq!(among.specks, alone.specks + added);
    let surface = Surface::new(&alone.merged.mesh).expect("a surface");
    let squares = among.merged.mesh.points.iter().map(|p| {
        let near = surface.distance(p, f64::INFINITY).expect("a distance");
        near.value * near.value
    });
    let rms = (squares.sum::<f64>() / among.merged.mesh.points.len() as f64).sqrt();
    assert!(rms < 0.5, "{rms:.2} mm apart");
}
