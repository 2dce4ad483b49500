//! One side for all normals of a connected piece of a cloud, and which of the two is the outer one.

use crate::cubes::{Cube, around, cube};
use crate::mesh::{Point, Vector};
use rayon::prelude::*;
use std::collections::HashMap;

/// Edge of the cubes whose centroids tell outside from inside, in half extents of the cloud.
const CUBE: f64 = 0.125;
/// A vote on the side of a piece counts from this height over the centroid, in half extents of the cloud.
const LEVEL: f64 = 1e-9;
/// Mean normals longer than this are those of a view from one side: a hemisphere has 1/2, a plane 1.
const ONE_SIDED: f64 = 0.65;
/// A piece with less of its mean normal along the view decides by itself.
const CLEARLY: f64 = 0.2;

/// Makes the normals of each connected piece agree; returns a representative of the piece for each place.
pub(super) fn agree(pieces: &[Vec<u32>], normals: &mut [Vector]) -> Vec<usize> {
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

/// Turns each piece outwards, by the rules of [`estimate`](super::estimate).
pub(super) fn turn_outwards(places: &[Point], roots: &[usize], normals: &mut [Vector]) {
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
