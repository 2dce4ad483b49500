//! Normals for point clouds that come without them.
//!
//! After Hoppe et al., "Surface reconstruction from unorganized points", SIGGRAPH 1992: a plane through the
//! nearest neighbours of each point, then one side for all of a connected piece, carried along the minimum
//! spanning tree of the neighbourhood graph with weights 1 − |nᵢ·nⱼ|. The data alone do not tell outside from
//! inside. The last step is a heuristic: see [`estimate`].

mod agreeing;
mod neighbourhoods;
mod neighbours;
mod sides;

pub use agreeing::agreeing;
pub use neighbours::{Neighbour, neighbours};
pub use sides::View;

use crate::mesh::{Point, Vector};
use nalgebra::{Matrix3, SymmetricEigen};
use neighbourhoods::{distinct, neighbourhoods, separated};
use rayon::prelude::*;
use sides::{agree, turn_outwards};

/// Neighbours spread over a strip this narrow, width² : length², are collinear up to single precision.
const NARROW: f64 = 1e-6;

/// Unit normals of a cloud, one a point, in the order of `points`; any unit, any position.
///
/// Normals are zero where there is no plane: points that are not finite, that stand alone, or whose
/// neighbours are all on a line. Copies of a point get the same normal.
///
/// Each connected piece is turned as a whole so that at most of its points the normal leads away from the
/// centroid c of the piece's part nearby (within a tenth or so of the cloud's extent), n·(p − c) > 0. This is
/// right for closed surfaces and for what a range scanner sees of a body that bulges towards it, bent limbs
/// included; it is wrong for a piece that is mostly hollow, such as the inside of a bowl. A flat piece has no
/// such side; there, the largest component of the sum of normals is positive. Where the largest piece is seen
/// from one side only, as in a single scan, the smaller ones are turned to the same side.
///
/// The result does not depend on the number of threads, nor on the order of the points.
pub fn estimate(points: &[Point]) -> Vec<Vector> {
    let (places, place_of) = distinct(points);
    let pieces = separated(&places, &neighbourhoods(&places));
    let fit = |near: &Vec<u32>| plane_normal(&places, near);
    let mut normals: Vec<Vector> = pieces.par_iter().map(fit).collect();
    let roots = agree(&pieces, &mut normals);
    turn_outwards(&places, &roots, &mut normals);
    place_of.iter().map(|place| place.map_or_else(Vector::zeros, |p| normals[p])).collect()
}

/// Covariance of the places of `members` at unit trace; `None` unless they span a plane.
fn spread(places: &[Point], members: &[u32]) -> Option<Matrix3<f64>> {
    let coords = || members.iter().map(|&m| places[m as usize].coords);
    let mean = coords().sum::<Vector>() / members.len() as f64;
    let sum: Matrix3<f64> = coords().map(|c| (c - mean) * (c - mean).transpose()).sum();
    let unit = sum / sum.trace();
    let minor = |i, j| unit[(i, i)] * unit[(j, j)] - unit[(i, j)] * unit[(j, i)];
    // The sum of the principal minors is λ₁λ₂ + λ₁λ₃ + λ₂λ₃: about λ₂ / λ₁ of a narrow strip.
    (minor(0, 1) + minor(0, 2) + minor(1, 2) > NARROW).then_some(unit)
}

/// Direction in which `members` spread least, of either sign; zero where they span no plane.
fn plane_normal(places: &[Point], members: &[u32]) -> Vector {
    let eigen = spread(places, members).and_then(|m| SymmetricEigen::try_new(m, f64::EPSILON, 100));
    let least = eigen.map(|e| e.eigenvectors.column(e.eigenvalues.imin()).into_owned());
    least.and_then(|n| n.try_normalize(0.0)).unwrap_or_else(Vector::zeros)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};

    /// `count` points over the unit sphere, evenly along a spiral.
    fn sphere(count: usize) -> Vec<Point> {
        let at = |i: usize| {
            let z = 1.0 - (2 * i + 1) as f64 / count as f64;
            let (sin, cos) = libm::sincos(2.399_963_229_728_653 * i as f64);
            Point::new(cos * (1.0 - z * z).sqrt(), sin * (1.0 - z * z).sqrt(), z)
        };
        (0..count).map(at).collect()
    }

    /// A square sheet of 100 × 100 points, z = `height`(x, y), x and y from −1 to 1.
    fn sheet(mut height: impl FnMut(f64, f64) -> f64) -> Vec<Point> {
        let along = |i: usize| (i as f64 - 49.5) / 49.5;
        let at = |i: usize| (along(i % 100), along(i / 100));
        (0..10_000).map(at).map(|(x, y)| Point::new(x, y, height(x, y))).collect()
    }

    fn share(of: impl Iterator<Item = bool>) -> f64 {
        let all: Vec<bool> = of.collect();
        all.iter().filter(|&&good| good).count() as f64 / all.len() as f64
    }

    #[test]
    fn a_sphere_has_its_radii_as_normals_wherever_it_is() {
        for (size, place) in [(1.0, 0.0), (1e-9, 0.0), (1e6, 1e8), (1e307, 1e308), (1e-200, 0.0)] {
            let unit = sphere(5000);
            let scaled: Vec<Point> = unit.iter().map(|p| (p * size) + Vector::repeat(place)).collect();
            let normals = estimate(&scaled);
            let cosine = normals.iter().zip(&unit).map(|(n, p)| n.dot(&p.coords));
            assert!(cosine.fold(1.0, f64::min) > 0.998, "size {size} at {place}");
        }
    }

    #[test]
    fn an_open_cap_faces_the_way_it_bulges() {
        let cap = sheet(|x, y| -0.4 * (x * x + y * y));
        let truth = cap.iter().map(|p| Vector::new(0.8 * p.x, 0.8 * p.y, 1.0).normalize());
        assert!(estimate(&cap).iter().zip(truth).all(|(n, t)| n.dot(&t) > 0.99));
    }

    #[test]
    fn a_step_in_a_noisy_plane_does_not_turn_its_other_half() {
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(1);
        let steps = sheet(|x, _| if x < 0.2 { 0.0 } else { 0.1 } + random.random_range(-0.002..0.002));
        let normals = estimate(&steps);
        let side = normals[0].z.signum();
        let on_flat = steps.iter().zip(&normals).filter(|(p, _)| (p.x - 0.2).abs() > 0.1);
        assert!(on_flat.map(|(_, n)| n.z * side).fold(1.0, f64::min) > 0.9);
    }

    #[test]
    fn copies_neither_crowd_out_neighbours_nor_differ() {
        let once = sphere(2000);
        let many: Vec<Point> = (0..50_000).map(|i| once[i % 2000]).collect();
        let (few, normals) = (estimate(&once), estimate(&many));
        assert!((0..50_000).all(|i| normals[i] == few[i % 2000]));
    }

    #[test]
    fn the_order_of_points_and_the_number_of_threads_do_not_matter() {
        let points = sheet(|x, y| 0.3 * (3.0 * x).sin() * (2.0 * y).cos());
        let reversed: Vec<Point> = points.iter().rev().copied().collect();
        let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
        let mut normals = alone.install(|| estimate(&reversed));
        normals.reverse();
        assert_eq!(normals, estimate(&points));
    }

    #[test]
    fn each_piece_is_turned_by_itself() {
        let mut two = sphere(3000);
        two.extend(sphere(3000).iter().map(|p| p + Vector::new(5.0, 0.0, 0.0)));
        let centre = |p: &Point| Vector::new(if p.x > 2.0 { 5.0 } else { 0.0 }, 0.0, 0.0);
        assert!(estimate(&two).iter().zip(&two).all(|(n, p)| n.dot(&(p.coords - centre(p))) > 0.9));
    }

    #[test]
    fn a_bent_limb_seen_from_its_hollow_side_faces_the_viewer() {
        // The upper half of a tube of radius 0.1 whose axis runs along an arc of radius 2 that sags.
        let at = |i: usize| {
            let (sin, cos) = ((i % 40) as f64 * 0.078 + 0.05).sin_cos();
            let (along, down) = ((i / 40) as f64 * 0.008 - 1.0).sin_cos();
            let reach = 2.0 - 0.1 * sin;
            (Point::new(reach * along, 0.1 * cos, -reach * down), Vector::new(-sin * along, cos, sin * down))
        };
        let (limb, truth): (Vec<Point>, Vec<Vector>) = (0..10_000).map(at).unzip();
        assert!(estimate(&limb).iter().zip(&truth).all(|(n, t)| n.dot(t) > 0.9));
    }

    #[test]
    fn small_pieces_of_a_view_face_the_same_way_as_the_large_one() {
        let mut view = sheet(|x, y| -0.4 * (x * x + y * y));
        view.extend(
            (0..100).map(|i| Point::new(1.4 + 0.01 * f64::from(i % 10), 0.01 * f64::from(i / 10), 0.0)),
        );
        let hollow = |p: &mut Point| p.z += 2.0 * ((p.x - 1.45).powi(2) + (p.y - 0.05).powi(2));
        view[10_000..].iter_mut().for_each(hollow);
        assert!(estimate(&view).iter().all(|n| n.z > 0.5));
    }

    #[test]
    fn stripes_of_a_line_scanner_are_a_surface() {
        let at = |i: usize| Point::new((i % 1000) as f64 * 0.001, (i / 1000) as f64 * 0.02, 0.0);
        let stripes: Vec<Point> = (0..20_000).map(at).collect();
        assert!(share(estimate(&stripes).iter().map(|n| n.z > 0.999)) > 0.999);
    }

    #[test]
    fn no_plane_no_normal() {
        let line: Vec<Point> = (0..500).map(|i| Point::new(1.0, 2.0, 0.3) * f64::from(i)).collect();
        let zero = |points: &[Point]| estimate(points) == vec![Vector::zeros(); points.len()];
        assert!(zero(&[]) && zero(&line[..1]) && zero(&line[..2]) && zero(&line));
        assert!(zero(&[Point::new(1.0, 2.0, 3.0); 40]));
        let mut stray = sphere(3000);
        stray.push(Point::new(3.0, 0.0, 0.0));
        stray.push(Point::new(f64::NAN, 0.0, 0.0));
        let normals = estimate(&stray);
        assert_eq!(normals[3000..], [Vector::zeros(); 2]);
        assert!(normals[..3000].iter().all(|n| (n.norm() - 1.0).abs() < 1e-9));
    }

    #[test]
    fn odd_clouds_do_not_panic() {
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(2);
        let scales = [0.0, 5e-324, 1e-300, 1e-17, 1.0, 1e150, f64::MAX];
        for _ in 0..300 {
            let count = random.random_range(0..200);
            let scale: [f64; 3] = std::array::from_fn(|_| scales[random.random_range(0..scales.len())]);
            let shift = f64::from(random.random_range(0..2u8));
            let mut coordinate = |s: f64| shift + s * f64::from(random.random_range(-9..=9i8)) / 9.0;
            let points: Vec<Point> = (0..count).map(|_| Point::from(scale.map(&mut coordinate))).collect();
            let unit_or_zero = |n: &Vector| *n == Vector::zeros() || (n.norm() - 1.0).abs() < 1e-9;
            assert!(estimate(&points).iter().all(unit_or_zero));
        }
    }
}
