//! Normals for point clouds that come without them.
//!
//! After Hoppe et al., "Surface reconstruction from unorganized points", SIGGRAPH 1992: a plane through the
//! nearest neighbours of each point, then one side for all of a connected piece, carried along the minimum
//! spanning tree of the neighbourhood graph with weights 1 − |nᵢ·nⱼ|. The data alone do not tell outside from
//! inside. The last step is a heuristic: see [`estimate`].
//!
//! The work is done on the distinct positions, scaled to [−1, 1] and rounded to multiples of 2⁻⁴⁸. Exact copies
//! of a point therefore do not fill up neighbourhoods, no square overflows, and every midpoint that the
//! search tree computes is exact, without which it need not end.

use crate::cubes::{Cube, around, cube};
use crate::mesh::{Point, Vector};
use crate::picks::evenly;
use nabo::{KDTree, NotNan};
use nalgebra::{Matrix3, SymmetricEigen};
use rayon::prelude::*;
use std::collections::HashMap;

/// Points in a neighbourhood, its centre included.
const FEW: u32 = 16;
/// The same where the nearest lie on a line, as they do along the stripes of a line scanner.
const MANY: u32 = 64;
/// Farther than this many radii of its own neighbourhood, a point belongs to another piece of surface.
const REACH: f64 = 3.0;
/// Neighbours spread over a strip this narrow, width² : length², are collinear up to single precision.
const NARROW: f64 = 1e-6;
/// Steps of the rounded coordinates in a unit.
const STEPS: f64 = (1u64 << 48) as f64;
/// Edge of the cubes whose centroids tell outside from inside, in half extents of the cloud.
const CUBE: f64 = 0.125;
/// A vote on the side of a piece counts from this height over the centroid, in half extents of the cloud.
const LEVEL: f64 = 1e-9;
/// Mean normals longer than this are those of a view from one side: a hemisphere has 1/2, a plane 1.
const ONE_SIDED: f64 = 0.65;
/// A piece with less of its mean normal along the view decides by itself.
const CLEARLY: f64 = 0.2;

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

/// Neighbours that rise more than this out of a point's plane, as a share of their distance, are on the other side of a sheet.
const SHEET: f64 = 0.5;
/// A side that so few of a piece's normals face is the wrong one. Of six scans with the sign of the largest component 63 to 77 %
/// faced inwards, so a mere majority tells nothing.
const FEW_FACE: f64 = 0.1;

/// The normals of a cloud, some of them turned so that those of each connected piece agree: to the side that nearly all of them
/// face, or else to that of [`estimate`].
pub fn agreeing(points: &[Point], normals: &[Vector]) -> Vec<Vector> {
    let (places, place_of) = distinct(points);
    let mut given = vec![Vector::zeros(); places.len()];
    for (normal, place) in normals.iter().zip(&place_of) {
        place.iter().for_each(|&place| given[place] = *normal);
    }
    let beside = |(place, near): (usize, Vec<u32>)| {
        let rises = |other: u32| {
            let offset = places[other as usize] - places[place];
            given[place].dot(&offset).abs() > SHEET * offset.norm()
        };
        near.into_iter().filter(|&other| !rises(other)).collect()
    };
    let near = separated(&places, &neighbourhoods(&places));
    let pieces: Vec<Vec<u32>> = near.into_iter().enumerate().map(beside).collect();
    let mut agreed = given.clone();
    let roots = agree(&pieces, &mut agreed);
    let mut outward = agreed.clone();
    turn_outwards(&places, &roots, &mut outward);
    let mut sums = vec![(0.0, 0.0); places.len()];
    for (place, &root) in roots.iter().enumerate() {
        let (count, kept) = &mut sums[root];
        (*count, *kept) = (*count + 1.0, *kept + f64::from(agreed[place].dot(&given[place]) >= 0.0));
    }
    let side = |place: usize| {
        let (count, kept) = sums[roots[place]];
        let clear = f64::min(kept, count - kept) < FEW_FACE * count;
        let turned = if clear { 2.0 * kept < count } else { outward[place].dot(&agreed[place]) < 0.0 };
        if turned { -agreed[place] } else { agreed[place] }
    };
    let turned = |(normal, place): (&Vector, &Option<usize>)| {
        let against = place.is_some_and(|place| side(place).dot(normal) < 0.0);
        if against { -*normal } else { *normal }
    };
    normals.iter().zip(&place_of).map(turned).collect()
}

/// Points that are asked for a neighbour.
const ASKED: usize = 20_000;

/// How a neighbour of a point lies to it.
#[derive(Clone, Copy, Debug)]
pub struct Neighbour {
    /// Number of the point that was asked.
    pub point: usize,
    /// How far away it is.
    pub distance: f64,
    /// The cosine between the normals.
    pub cosine: f64,
    /// How far it lies out of the plane across the point's normal, as a share of the distance: 1 on the other side of a sheet.
    pub rise: f64,
}

/// Some points of a cloud, evenly chosen: how the `number`-th nearest place of each that is not its own lies to it.
pub fn neighbours(points: &[Point], normals: &[Vector], number: u32) -> Vec<Neighbour> {
    let (places, place_of) = distinct(points);
    let mut point_at = vec![0; places.len()];
    for (point, place) in place_of.iter().enumerate() {
        place.iter().for_each(|&place| point_at[place] = point);
    }
    let cloud: Vec<Place> = places.iter().map(|p| Place(p.coords.into())).collect();
    let tree = KDTree::new(&cloud);
    let neighbour = |place: usize| {
        let near = nearest(&tree, &cloud[place], number + 1).members;
        let other = near.into_iter().map(|m| m as usize).filter(|&m| m != place).nth(number as usize - 1)?;
        let [a, b] = [place, other].map(|place| point_at[place]);
        let (offset, cosine) = (points[b] - points[a], normals[a].dot(&normals[b]));
        let distance = offset.norm();
        let rise = normals[a].dot(&offset).abs() / distance.max(f64::MIN_POSITIVE);
        Some(Neighbour { point: a, distance, cosine, rise })
    };
    evenly(places.len(), ASKED).filter_map(neighbour).collect()
}

/// The distinct positions on the grid, sorted, and for each point the index of its own.
fn distinct(points: &[Point]) -> (Vec<Point>, Vec<Option<usize>>) {
    let mut keys = grid_keys(points);
    keys.par_sort_unstable();
    let (mut places, mut place_of) = (Vec::new(), vec![None; points.len()]);
    for same in keys.chunk_by(|a, b| a.0 == b.0) {
        for &(_, point) in same {
            place_of[point] = Some(places.len());
        }
        places.push(Point::from(same[0].0.map(|c| c as f64 / STEPS)));
    }
    (places, place_of)
}

/// Coordinates in steps of the grid, with the index of the point; finite points only.
fn grid_keys(points: &[Point]) -> Vec<([i64; 3], usize)> {
    let finite = |p: &Point| p.iter().all(|c| c.is_finite());
    let Some(&first) = points.iter().find(|p| finite(p)) else { return Vec::new() };
    let bounds = |(low, high): (Point, Point), p: &Point| (low.inf(p), high.sup(p));
    let (low, high) = points.iter().filter(|p| finite(p)).fold((first, first), bounds);
    // Halved before they are subtracted: the extent of finite coordinates need not be finite.
    let (centre, half) = (low.coords / 2.0 + high.coords / 2.0, (high.coords / 2.0 - low.coords / 2.0).max());
    let unit = if half > 0.0 { half } else { 1.0 };
    let key = |p: &Point| (p.coords - centre).map(|c| (c / unit * STEPS).round() as i64).into();
    points.iter().enumerate().filter(|(_, p)| finite(p)).map(|(i, p)| (key(p), i)).collect()
}

/// The nearest points of one, itself included, nearest first, and the distance of the last.
struct Neighbourhood {
    members: Vec<u32>,
    radius: f64,
}

fn neighbourhoods(places: &[Point]) -> Vec<Neighbourhood> {
    let cloud: Vec<Place> = places.iter().map(|p| Place(p.coords.into())).collect();
    let tree = KDTree::new(&cloud);
    let search = |place: &Place| {
        let few = nearest(&tree, place, FEW);
        if spread(places, &few.members).is_some() { few } else { nearest(&tree, place, MANY) }
    };
    cloud.par_iter().map(search).collect()
}

fn nearest(tree: &KDTree<f64, Place>, place: &Place, count: u32) -> Neighbourhood {
    let found = tree.knn(count, place);
    let radius = found.last().map_or(0.0, |n| n.dist2.sqrt());
    Neighbourhood { members: found.iter().map(|n| n.index).collect(), radius }
}

/// The members of each neighbourhood without those of another piece: a stray point sees the surface as its
/// neighbour, but is far away for the surface.
fn separated(places: &[Point], neighbourhoods: &[Neighbourhood]) -> Vec<Vec<u32>> {
    let keep = |(place, near): (&Point, &Neighbourhood)| {
        let reaches = |&&m: &&u32| {
            let other = m as usize;
            (places[other] - place).norm() <= REACH * neighbourhoods[other].radius
        };
        near.members.iter().filter(reaches).copied().collect()
    };
    places.par_iter().zip(neighbourhoods).map(keep).collect()
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

/// Makes the normals of each connected piece agree; returns a representative of the piece for each place.
fn agree(pieces: &[Vec<u32>], normals: &mut [Vector]) -> Vec<usize> {
    let mut forest = Forest::new(normals.len());
    for (_, a, b) in edges(pieces, normals) {
        let (a, b) = (a as usize, b as usize);
        forest.join(a, b, normals[a].dot(&normals[b]) < 0.0);
    }
    let mut root_of = |(place, normal): (usize, &mut Vector)| {
        let (root, opposed) = forest.find(place);
        *normal *= if opposed { -1.0 } else { 1.0 };
        root
    };
    normals.iter_mut().enumerate().map(&mut root_of).collect()
}

/// All pairs of neighbours with a normal each, once, least weight 1 − |nᵢ·nⱼ| first.
fn edges(pieces: &[Vec<u32>], normals: &[Vector]) -> Vec<(u64, u32, u32)> {
    let from = |(index, near): (usize, &Vec<u32>)| {
        let (a, n) = (index as u32, normals[index]);
        let first = |b: u32| a < b || (a > b && !pieces[b as usize].contains(&a));
        let known = |&b: &u32| first(b) && n != Vector::zeros() && normals[b as usize] != Vector::zeros();
        // The bits of floats that are not negative sort like their values.
        let weight = |b: u32| (1.0 - n.dot(&normals[b as usize]).abs()).max(0.0).to_bits();
        near.iter().copied().filter(known).map(|b| (weight(b), a.min(b), a.max(b))).collect::<Vec<_>>()
    };
    let mut edges: Vec<_> = pieces.par_iter().enumerate().flat_map_iter(from).collect();
    edges.par_sort_unstable();
    edges
}

/// Turns each piece outwards, by the rules of [`estimate`].
fn turn_outwards(places: &[Point], roots: &[usize], normals: &mut [Vector]) {
    let pieces = census(places, roots, normals);
    let largest = pieces.iter().max_by(|a, b| a.count.total_cmp(&b.count)).cloned().unwrap_or_default();
    let view = View::of(largest.mean() * largest.sign());
    let sign = |piece: &Piece| view.side_of(&piece.mean()).unwrap_or_else(|| piece.sign());
    let signs: Vec<f64> = pieces.iter().map(sign).collect();
    normals.iter_mut().zip(roots).for_each(|(normal, &root)| *normal *= signs[root]);
}

/// From where a scan was seen, as far as the largest of its pieces tells: the smaller ones face the same side.
#[derive(Clone, Copy, Debug, Default)]
pub struct View(Vector);

impl View {
    /// By the mean normal of the largest piece: nothing unless it is seen from one side.
    pub fn of(mean: Vector) -> Self {
        if mean.norm() > ONE_SIDED { Self(mean) } else { Self::default() }
    }

    /// Whether a piece with this mean normal faces the view, 1, or away from it, -1; none where that is not clear.
    pub fn side_of(self, mean: &Vector) -> Option<f64> {
        let towards = mean.dot(&self.0);
        (towards.abs() > CLEARLY).then(|| towards.signum())
    }
}

/// What is counted over a connected piece of surface.
#[derive(Clone, Default)]
struct Piece {
    count: f64,
    normals: Vector,
    votes: i64,
}

impl Piece {
    fn mean(&self) -> Vector {
        self.normals / self.count.max(1.0)
    }

    fn sign(&self) -> f64 {
        let side = self.normals[self.normals.iamax()];
        if self.votes < 0 || (self.votes == 0 && side < 0.0) { -1.0 } else { 1.0 }
    }
}

/// The pieces, each at the index of its root.
fn census(places: &[Point], roots: &[usize], normals: &[Vector]) -> Vec<Piece> {
    let centroids = nearby_centroids(places, roots);
    let mut pieces = vec![Piece::default(); places.len()];
    for ((place, normal), &root) in places.iter().zip(normals).zip(roots) {
        let height = normal.dot(&(place.coords - centroids[&(root, cube(place, CUBE))]));
        let piece = &mut pieces[root];
        piece.count += 1.0;
        piece.normals += normal;
        piece.votes += i64::from(height > LEVEL) - i64::from(height < -LEVEL);
    }
    pieces
}

/// A cube of space, one of a piece's.
type PartCube = (usize, Cube);

/// For each cube of a piece, the centroid of what the piece has in the 27 cubes around it.
fn nearby_centroids(places: &[Point], roots: &[usize]) -> HashMap<PartCube, Vector> {
    let mut sums: HashMap<PartCube, (f64, Vector)> = HashMap::new();
    for (place, &root) in places.iter().zip(roots) {
        let sum = sums.entry((root, cube(place, CUBE))).or_default();
        *sum = (sum.0 + 1.0, sum.1 + place.coords);
    }
    let centroid = |&(root, cube): &PartCube| {
        let cubes = around(cube).map(|near| (root, near));
        let add = |sum: (f64, Vector), near: &(f64, Vector)| (sum.0 + near.0, sum.1 + near.1);
        let (count, sum) = cubes.filter_map(|c| sums.get(&c)).fold((0.0, Vector::zeros()), add);
        sum / count
    };
    sums.keys().map(|cube| (*cube, centroid(cube))).collect()
}

/// Disjoint sets in which each member knows whether its normal opposes that of its parent. Joined along the
/// edges in order of weight, it is the minimum spanning tree (Kruskal) with the signs carried along.
struct Forest(Vec<(u32, bool)>);

impl Forest {
    fn new(count: usize) -> Self {
        Self((0..count as u32).map(|root| (root, false)).collect())
    }

    /// The root of a member and whether the two are opposed; halves the path on the way.
    fn find(&mut self, mut member: usize) -> (usize, bool) {
        let mut opposed = false;
        loop {
            let (parent, sign) = self.0[member];
            if parent as usize == member {
                return (member, opposed);
            }
            let (grand, parent_sign) = self.0[parent as usize];
            self.0[member] = (grand, sign != parent_sign);
            opposed ^= sign != parent_sign;
            member = grand as usize;
        }
    }

    fn join(&mut self, a: usize, b: usize, opposed: bool) {
        let ((a, a_sign), (b, b_sign)) = (self.find(a), self.find(b));
        if a != b {
            self.0[b] = (a as u32, opposed != (a_sign != b_sign));
        }
    }
}

/// A position as the search tree wants it.
#[derive(Clone, Copy, Default)]
struct Place([f64; 3]);

impl nabo::Point<f64> for Place {
    const DIM: u32 = 3;

    fn set(&mut self, i: u32, value: NotNan<f64>) {
        self.0[i as usize] = value.into_inner();
    }

    fn get(&self, i: u32) -> NotNan<f64> {
        NotNan::new(self.0[i as usize]).expect("positions on the grid are finite")
    }
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
