use super::*;
use crate::bvh::Bvh;
use crate::mesh::Vector;
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::LazyLock;

/// The same ten heads for all tests.
static HEADS: LazyLock<Vec<Mesh>> =
    LazyLock::new(|| (0..10).into_par_iter().map(|i| Head::sample(20, i).mesh()).collect());

fn for_heads(check: impl Fn(usize, &Mesh)) {
    HEADS.iter().enumerate().for_each(|(i, mesh)| check(i, mesh));
}

/// How often each directed edge occurs.
fn directed_edges(mesh: &Mesh) -> BTreeMap<[u32; 2], usize> {
    let mut edges = BTreeMap::new();
    for [a, b, c] in &mesh.triangles {
        [[*a, *b], [*b, *c], [*c, *a]].into_iter().for_each(|edge| *edges.entry(edge).or_default() += 1);
    }
    edges
}

/// The border edges, each from its start to its end.
fn border(mesh: &Mesh) -> Vec<[u32; 2]> {
    let edges = directed_edges(mesh);
    edges.keys().filter(|[a, b]| !edges.contains_key(&[*b, *a])).copied().collect()
}

#[test]
fn heads_are_discs() {
    for_heads(|i, mesh| {
        let edges = directed_edges(mesh);
        assert!(edges.values().all(|&count| count == 1), "head {i}: an edge with two triangles on one side");
        let next: BTreeMap<u32, u32> = border(mesh).into_iter().map(|[a, b]| (a, b)).collect();
        let start = *next.keys().next().expect("a rim");
        let mut walked = BTreeSet::new();
        let mut at = start;
        while walked.insert(at) {
            at = next[&at];
        }
        assert_eq!((at, walked.len()), (start, next.len()), "head {i}: more than one rim");
        // One component with one rim is a disc if V - E + F = 1; a second one would have no rim or another one.
        let undirected = (edges.len() + next.len()) / 2;
        assert_eq!(mesh.points.len() + mesh.triangles.len(), undirected + 1, "head {i}: not a disc");
        let used: BTreeSet<u32> = mesh.triangles.iter().flatten().copied().collect();
        assert_eq!(used.len(), mesh.points.len(), "head {i}: loose vertices");
    });
}

#[test]
fn heads_have_the_right_size_and_good_triangles() {
    for_heads(|i, mesh| {
        let (low, high) = mesh.bounds().expect("vertices");
        let size = high - low;
        assert!((150.0..220.0).contains(&size.x) && (190.0..270.0).contains(&size.y), "head {i}: {size}");
        assert!((125.0..200.0).contains(&size.z), "head {i}: {size}");
        assert!((8_000..=16_000).contains(&mesh.triangles.len()), "head {i}: {}", mesh.triangles.len());
        for t in 0..mesh.triangles.len() {
            let [a, b, c] = mesh.corners(t);
            let edges = [b - a, c - b, a - c].map(|e| e.norm());
            let longest = edges.iter().copied().fold(0.0, f64::max);
            let height = (b - a).cross(&(c - a)).norm() / longest;
            assert!(height > 0.05 * longest && longest < 12.0, "head {i}, triangle {t}: {edges:?}");
        }
    });
}

#[test]
fn heads_are_wound_outwards() {
    for_heads(|i, mesh| {
        let normals = mesh.vertex_normals();
        let centre = Point::new(0.0, 0.0, -10.0);
        let out = mesh.points.iter().zip(&normals).filter(|(p, n)| (*p - centre).dot(n) > 0.0).count();
        assert!(out > mesh.points.len() * 9 / 10, "head {i}: {out}");
    });
}

/// Edges that pass through a triangle with which they share no corner.
fn cuts(mesh: &Mesh) -> usize {
    let bvh = Bvh::new(mesh);
    let cut = |[a, b]: &[u32; 2]| {
        let (mut from, to) = (mesh.points[*a as usize], mesh.points[*b as usize]);
        for _ in 0..10 {
            let Some((t, triangle)) = bvh.cast(&from, &(to - from), 1.0) else { return false };
            let corners = mesh.triangles[triangle as usize];
            if !corners.contains(a) && !corners.contains(b) {
                return true;
            }
            from += (to - from) * (t + 1e-3).min(1.0);
        }
        false
    };
    directed_edges(mesh).into_keys().par_bridge().filter(cut).count()
}

#[test]
fn heads_do_not_cut_themselves() {
    for_heads(|i, mesh| assert_eq!(cuts(mesh), 0, "head {i}"));
    assert_eq!(cuts(&Head::sample(20, 3).with_relief(0.8, 1).mesh()), 0);
}

/// Two triangles through each other, to see that `cuts` finds them.
#[test]
fn cuts_are_found() {
    let points = [[0, 0, 0], [4, 0, 0], [0, 4, 0], [1, 1, -1], [1, 1, 1], [-5, -5, 0]];
    let points = points.map(|p| Point::from(p.map(f64::from))).to_vec();
    let mesh = Mesh { points, normals: vec![], triangles: vec![[0, 1, 2], [3, 4, 5]] };
    assert!(cuts(&mesh) > 0);
}

/// Where a ray from behind leaves the surface: the thickness of what lies between front and back.
#[test]
fn ears_are_thick() {
    let mesh = Head::with_parameters(Parameters::default(), 1).mesh();
    let (bvh, normals) = (Bvh::new(&mesh), mesh.vertex_normals());
    let thickness = |(p, n): (&Point, &Vector)| bvh.cast(&(p - n * 1e-3), &-n, 30.0).map(|(t, _)| t);
    let mut all: Vec<f64> =
        mesh.points.iter().zip(&normals).filter(|(p, _)| p.x.abs() > 80.0).filter_map(thickness).collect();
    all.sort_by(f64::total_cmp);
    assert!(all.len() > 60 && all[all.len() / 10] >= 6.0, "{} {:?}", all.len(), &all[..10]);
}

#[test]
fn samples_differ_and_repeat() {
    assert!(Parameters::NAMES.len() >= 24);
    let (a, b) = (Head::sample(1, 0), Head::sample(1, 1));
    assert_ne!(a.parameters(), b.parameters());
    assert_eq!(a.parameters(), Head::sample(1, 0).parameters());
    assert_ne!(a.mesh().triangles, b.mesh().triangles);
    assert_eq!(a.mesh(), Head::sample(1, 0).mesh());
    let again = Head::with_parameters(*a.parameters(), 99).mesh();
    assert_ne!(a.mesh().points.len(), again.points.len());
}

fn rms_distance(from: &Mesh, to: &Mesh) -> f64 {
    let bvh = Bvh::new(to);
    let squares: Vec<f64> =
        from.points.iter().filter_map(|p| bvh.closest(p, 40.0)).map(|hit| hit.squared_distance).collect();
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}

/// Every parameter moves the surface, none of them by centimetres; the triangulation hardly matters.
#[test]
fn parameters_have_a_visible_and_bounded_effect() {
    let mean = Head::with_parameters(Parameters::default(), 1).mesh();
    let other = rms_distance(&Head::with_parameters(Parameters::default(), 2).mesh(), &mean);
    assert!(other < 0.12, "{other}");
    let head = Head::with_parameters(Parameters::default(), 1);
    let places: Vec<[f64; 2]> =
        (0..4000).map(|i| [f64::from(i % 80) * 3.4 - 136.0, f64::from(i / 80) * 4.0 - 110.0]).collect();
    for (index, name) in Parameters::NAMES.iter().enumerate() {
        let mut parameters = Parameters::default();
        *parameters.get_mut(index).expect("named") = 1.0;
        let moved = Head::with_parameters(parameters, 1);
        let largest =
            places.iter().map(|&at| (moved.position(at) - head.position(at)).norm()).fold(0.0, f64::max);
        assert!((0.3..8.0).contains(&largest), "{name}: {largest} mm");
    }
}

#[test]
fn relief_has_the_size_asked_for() {
    let plain = Head::sample(1, 2);
    let rough = plain.clone().with_relief(0.6, 5).mesh();
    let rms = rms_distance(&rough, &plain.mesh());
    assert!((0.35..0.75).contains(&rms), "{rms}");
}

/// Size and digest of one head. A new digest at equal sizes means other values: on another machine
/// an error, after a change of the class a new class.
#[test]
fn golden() {
    let mesh = Head::sample(1, 0).mesh();
    let coordinates = mesh.points.iter().flat_map(|p| [p.x, p.y, p.z]).map(f64::to_bits);
    let corners = mesh.triangles.iter().flatten().map(|&v| u64::from(v));
    let digest = coordinates.chain(corners).fold(0xcbf2_9ce4_8422_2325, |hash: u64, word| {
        (hash ^ word).wrapping_mul(0x0100_0000_01b3).rotate_left(23)
    });
    assert_eq!((mesh.points.len(), digest), (6444, 18_106_263_505_558_371_643));
}
