use super::*;
use crate::mesh::Vector;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

fn uniform(rng: &mut ChaCha8Rng) -> f64 {
    (rng.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
}

fn random_point(rng: &mut ChaCha8Rng, size: f64) -> Point {
    Point::new(uniform(rng) * size, uniform(rng) * size, uniform(rng) * size)
}

/// Loose triangles of all shapes; every fourth is a needle, every eighth has no area at all.
fn soup(rng: &mut ChaCha8Rng, count: u32) -> Mesh {
    let mut mesh = Mesh::default();
    for i in 0..count {
        let a = random_point(rng, 10.0);
        let mut offset = || (random_point(rng, 2.0) - Point::new(1.0, 1.0, 1.0)) * 1.0;
        let (b, mut c) = (a + offset(), a + offset());
        match i % 8 {
            1 => c = a + (b - a) * 0.3,
            3 => c = a,
            5 => c = a + (b - a) * 0.5 + offset() * 1e-4,
            _ => {}
        }
        mesh.points.extend([a, b, c]);
        mesh.triangles.push([3 * i, 3 * i + 1, 3 * i + 2]);
    }
    mesh
}

fn on_segment(p: &Point, a: Point, b: Point) -> Point {
    let edge = b - a;
    let length = edge.norm_squared();
    a + edge * if length > 0.0 { ((p - a).dot(&edge) / length).clamp(0.0, 1.0) } else { 0.0 }
}

/// Foot on the plane if it lies inside the triangle, else the best of the edges.
fn brute_distance(mesh: &Mesh, p: &Point) -> f64 {
    let distance = |i: usize| {
        let [a, b, c] = mesh.corners(i);
        let edges = [(a, b), (b, c), (c, a)];
        let normal = (b - a).cross(&(c - a));
        let foot = normal.try_normalize(1e-9).map(|n| p - n * n.dot(&(p - a)));
        let inside = |q: &Point| edges.iter().all(|(u, v)| (v - u).cross(&(q - u)).dot(&normal) >= 0.0);
        let on_edges = edges.iter().map(|(u, v)| (p - on_segment(p, *u, *v)).norm()).fold(f64::MAX, f64::min);
        foot.filter(inside).map_or(on_edges, |q| (p - q).norm())
    };
    (0..mesh.triangles.len()).map(distance).fold(f64::MAX, f64::min)
}

#[test]
fn closest_equals_brute_force() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    for count in [1, 2, 5, 40, 600] {
        let mesh = soup(&mut rng, count);
        let bvh = Bvh::new(&mesh);
        for _ in 0..400 {
            let p = random_point(&mut rng, 14.0);
            let hit = bvh.closest(&p, f64::INFINITY).expect("there are triangles");
            let expected = brute_distance(&mesh, &p);
            assert!((hit.squared_distance.sqrt() - expected).abs() < 1e-6, "{hit:?} {expected}");
            assert!((p - hit.point).norm_squared() == hit.squared_distance);
            assert_feature_holds(&mesh, &hit);
            assert_eq!(bvh.closest(&p, expected + 1e-5), Some(hit));
            assert_eq!(bvh.closest(&p, expected - 1e-5), None);
        }
    }
}

fn assert_feature_holds(mesh: &Mesh, hit: &Hit) {
    let corners = mesh.corners(hit.triangle as usize);
    match hit.feature {
        Feature::Vertex(i) => assert_eq!(hit.point, corners[i as usize]),
        Feature::Edge(i) => {
            let (a, b) = (corners[i as usize], corners[(i as usize + 1) % 3]);
            assert!((on_segment(&hit.point, a, b) - hit.point).norm() < 1e-9);
        }
        Feature::Face => {}
    }
}

/// Two triangles over the unit square; the diagonal runs from (0, 0) to (1, 1).
fn square() -> Mesh {
    let points = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(|(x, y)| Point::new(x, y, 0.0));
    Mesh { points: points.to_vec(), normals: vec![], triangles: vec![[0, 1, 2], [0, 2, 3]] }
}

#[test]
fn features_are_named() {
    let bvh = Bvh::new(&square());
    let feature = |x: f64, y: f64| bvh.closest(&Point::new(x, y, 0.5), 9.0).map(|h| (h.triangle, h.feature));
    assert_eq!(feature(0.7, 0.3), Some((0, Feature::Face)));
    assert_eq!(feature(0.3, 0.7), Some((1, Feature::Face)));
    assert_eq!(feature(0.5, -1.0), Some((0, Feature::Edge(0))));
    assert_eq!(feature(2.0, 0.5), Some((0, Feature::Edge(1))));
    assert_eq!(feature(0.5, 0.5), Some((0, Feature::Edge(2))));
    assert_eq!(feature(-1.0, 0.5), Some((1, Feature::Edge(2))));
    assert_eq!(feature(-1.0, -1.0), Some((0, Feature::Vertex(0))));
    assert_eq!(feature(2.0, 2.0), Some((0, Feature::Vertex(2))));
    assert_eq!(feature(-1.0, 2.0), Some((1, Feature::Vertex(2))));
}

#[test]
fn ties_go_to_the_lowest_index() {
    let mut mesh = square();
    mesh.triangles = [[0, 1, 2]; 50].to_vec();
    let bvh = Bvh::new(&mesh);
    let p = Point::new(0.7, 0.3, 1.0);
    assert_eq!(bvh.closest(&p, 2.0).map(|h| h.triangle), Some(0));
    assert_eq!(bvh.cast(&p, &-Vector::z(), 9.0), Some((1.0, 0)));
}

#[test]
fn a_limit_is_inclusive() {
    let bvh = Bvh::new(&square());
    assert!(bvh.closest(&Point::new(0.7, 0.3, 1.0), 1.0).is_some());
    assert!(bvh.cast(&Point::new(0.7, 0.3, 1.0), &-Vector::z(), 1.0).is_some());
}

#[test]
fn nothing_panics_on_odd_meshes() {
    let empty = Bvh::new(&Mesh::default());
    let origin = Point::origin();
    assert_eq!(empty.closest(&origin, 1.0), None);
    assert_eq!(empty.cast(&origin, &Vector::x(), 1.0), None);
    assert!(!empty.occluded(&origin, &Point::new(1.0, 0.0, 0.0)));
    let mut mesh = square();
    mesh.points[3].x = f64::NAN;
    mesh.triangles = (0..100).map(|i| [[0, 1, 2], [0, 2, 3], [1, 1, 1]][i % 3]).collect();
    let bvh = Bvh::new(&mesh);
    assert_eq!(bvh.closest(&Point::new(0.7, 0.3, 1.0), 9.0).map(|h| h.triangle), Some(0));
    assert_eq!(bvh.closest(&Point::new(f64::NAN, 0.3, 1.0), 9.0), None);
}

fn brute_cast(mesh: &Mesh, origin: &Point, direction: &Vector) -> Option<f64> {
    let meet = |i: usize| {
        let [a, b, c] = mesh.corners(i);
        let solved =
            nalgebra::Matrix3::from_columns(&[-direction, b - a, c - a]).try_inverse()? * (origin - a);
        (solved.x >= 0.0 && solved.y >= 0.0 && solved.z >= 0.0 && solved.y + solved.z <= 1.0)
            .then_some(solved.x)
    };
    (0..mesh.triangles.len()).filter_map(meet).min_by(f64::total_cmp)
}

#[test]
fn rays_equal_brute_force() {
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let mut mesh = soup(&mut rng, 400);
    mesh.triangles.retain(|t| t[0] % 2 == 0); // the odd ones are flat: either answer is right
    let bvh = Bvh::new(&mesh);
    for i in 0..2000 {
        let (origin, target) = (random_point(&mut rng, 12.0), random_point(&mut rng, 12.0));
        let direction = if i % 4 == 0 { Vector::y() } else { target - origin };
        let expected = brute_cast(&mesh, &origin, &direction);
        let found = bvh.cast(&origin, &direction, f64::INFINITY).map(|(t, _)| t);
        assert_eq!(found.is_some(), expected.is_some());
        assert!((found.unwrap_or(0.0) - expected.unwrap_or(0.0)).abs() < 1e-6);
        let end = origin + direction;
        assert_eq!(bvh.occluded(&origin, &end), expected.is_some_and(|t| t > 1e-6 && t < 1.0 - 1e-6));
    }
}

#[test]
fn a_surface_point_does_not_hide_itself() {
    let bvh = Bvh::new(&square());
    let (above, on) = (Point::new(0.6, 0.2, 3.0), Point::new(0.3, 0.1, 0.0));
    assert!(!bvh.occluded(&above, &on) && !bvh.occluded(&on, &above));
    assert!(bvh.occluded(&above, &Point::new(0.3, 0.1, -0.1)));
}
