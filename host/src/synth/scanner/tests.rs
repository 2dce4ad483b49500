use super::*;
use crate::synth::Head;

fn truth() -> Mesh {
    Head::sample(3, 1).mesh()
}

fn back_in_model_frame(scan: &Scan, points: &[Point]) -> Vec<Point> {
    let inverse = scan.model_to_scan.try_inverse().expect("a similarity");
    points.iter().map(|p| inverse.transform_point(p)).collect()
}

/// Share of the missing vertices.
fn missing_share(scan: &Scan) -> f64 {
    scan.missing.iter().filter(|&&m| m).count() as f64 / scan.missing.len() as f64
}

#[test]
fn scans_lie_on_the_truth() {
    let truth = truth();
    let bvh = Bvh::new(&truth);
    for (kind, missing) in [(Kind::Front, 0.4..0.8), (Kind::Side, 0.4..0.8), (Kind::Stitched, 0.03..0.35)] {
        let scan = scan(&truth, kind, &Settings::small(), 4);
        let points = back_in_model_frame(&scan, &scan.points.points);
        let squares: Vec<f64> =
            points.iter().filter_map(|p| bvh.closest(p, 1.5)).map(|h| h.squared_distance).collect();
        let rms = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
        assert!((0.08..0.25).contains(&rms), "{kind:?}: {rms}");
        let specks = points.len() - squares.len();
        assert!(specks > 0 && specks < points.len() / 50, "{kind:?}: {specks} of {}", points.len());
        assert!(missing.contains(&missing_share(&scan)), "{kind:?}: {}", missing_share(&scan));
        assert!(scan.views.len() == if kind == Kind::Stitched { 3 } else { 1 });
    }
}

#[test]
fn the_mesh_faces_the_scanner_and_spans_no_jump() {
    let settings = Settings::small();
    let scan = scan(&truth(), Kind::Front, &settings, 5);
    let eye = scan.views[0].camera_to_scan.transform_point(&Point::origin());
    let scale = scan.model_to_scan.fixed_view::<3, 1>(0, 0).norm();
    assert!((0.9..1.1).contains(&scale));
    for t in 0..scan.mesh.triangles.len() {
        let [a, b, c] = scan.mesh.corners(t);
        assert!((b - a).cross(&(c - a)).dot(&(eye - a)) > 0.0);
        assert!((b - a).norm() < scale * (settings.jump_mm + 4.0));
    }
    let facing = scan.points.points.iter().zip(&scan.points.normals).all(|(p, n)| (eye - p).dot(n) > 0.0);
    assert!(facing && scan.points.normals.iter().all(|n| (n.norm() - 1.0).abs() < 1e-9));
    assert!(scan.points.triangles.is_empty());
}

#[test]
fn a_noiseless_scan_is_exact_up_to_the_grey_levels() {
    let truth = truth();
    let settings = Settings { noise_mm: 0.0, smooth_noise_mm: 0.0, ..Settings::small() };
    let scan = scan(&truth, Kind::Front, &settings, 6);
    let bvh = Bvh::new(&truth);
    let points = back_in_model_frame(&scan, &scan.mesh.points);
    let far = points.iter().filter(|p| bvh.closest(p, 0.5 / UNITS_PER_MM + 1e-6).is_none()).count();
    assert!(far < points.len() / 50, "{far} of {}", points.len());
}

#[test]
fn further_views_are_a_little_beside_the_first() {
    let truth = truth();
    let bvh = Bvh::new(&truth);
    let rms_of_views = |registration_mm: f64| -> Vec<f64> {
        let exact = Settings { noise_mm: 0.0, smooth_noise_mm: 0.0, registration_mm, ..Settings::small() };
        let scan = scan(&truth, Kind::Stitched, &exact, 6);
        let rms = |view: &DepthView| {
            let pixels = (0..view.height).flat_map(|row| (0..view.width).map(move |column| (column, row)));
            let points: Vec<Point> = pixels.filter_map(|(column, row)| view.point(column, row)).collect();
            let hits = back_in_model_frame(&scan, &points).into_iter().filter_map(|p| bvh.closest(&p, 1.5));
            let squares: Vec<f64> = hits.map(|hit| hit.squared_distance).collect();
            (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
        };
        scan.views.iter().map(rms).collect()
    };
    let (exact, off) = (rms_of_views(0.0), rms_of_views(0.3));
    assert!(exact.iter().all(|&rms| rms < 0.05), "{exact:?}");
    assert!(off[0] == exact[0] && off[1..].iter().all(|rms| (0.1..1.2).contains(rms)), "{off:?}");
}

#[test]
fn missing_vertices_are_those_far_from_the_mesh() {
    let truth = truth();
    let scan = scan(&truth, Kind::Side, &Settings::small(), 7);
    let bvh = Bvh::new(&Mesh { points: back_in_model_frame(&scan, &scan.mesh.points), ..scan.mesh.clone() });
    for (p, &missing) in truth.points.iter().zip(&scan.missing) {
        let distance = bvh.closest(p, 99.0).map_or(f64::INFINITY, |hit| hit.squared_distance.sqrt());
        assert!(missing == (distance > 2.0) || (distance - 2.0).abs() < 1e-9);
    }
}

#[test]
fn what_hides_a_thing_is_not_what_was_measured_of_it() {
    let truth = truth();
    let (low, high) = truth.bounds().unwrap();
    let middle = nalgebra::center(&low, &high);
    let mut hood = truth.clone();
    // A millimetre before it, where it is 100 mm wide.
    hood.points.iter_mut().for_each(|p| *p = middle + (*p - middle) * 1.01);
    let bare = scan(&truth, Kind::Front, &Settings::small(), 3);
    let hidden = scan_among(&truth, &hood, Kind::Front, &Settings::small(), 3);
    assert!(missing_share(&bare) < 0.8 && missing_share(&hidden) > 0.95, "{}", missing_share(&hidden));
}

#[test]
fn a_scan_does_not_depend_on_the_number_of_threads() {
    let truth = truth();
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| scan(&truth, Kind::Stitched, &Settings::small(), 8))
    };
    let one = with(1);
    assert!(one == with(3));
    assert!(one != scan(&truth, Kind::Stitched, &Settings::small(), 9));
}

#[test]
fn nothing_to_see_is_an_empty_scan() {
    let cloud = Mesh { points: vec![Point::new(1.0, 2.0, 3.0)], ..Mesh::default() };
    for mesh in [Mesh::default(), cloud] {
        let scan = scan(&mesh, Kind::Front, &Settings::small(), 1);
        assert!(scan.mesh.points.is_empty() && scan.missing.iter().all(|&m| m));
    }
}

/// Size and digest of one scan, see the golden head.
#[test]
fn golden() {
    let scan = scan(&truth(), Kind::Side, &Settings::small(), 10);
    let depths = scan.views[0].depth.iter().map(|&d| u64::from(d));
    let pose = scan.model_to_scan.iter().map(|x| x.to_bits());
    let digest = depths.chain(pose).fold(0xcbf2_9ce4_8422_2325, |hash: u64, word| {
        (hash ^ word).wrapping_mul(0x0100_0000_01b3).rotate_left(23)
    });
    assert_eq!((scan.mesh.points.len(), digest), (25_814, 12_856_892_528_052_803_875));
}
