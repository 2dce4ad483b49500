//! The nearest neighbours of a cloud's points, on their distinct positions.
//!
//! These are scaled to [−1, 1] and rounded to multiples of 2⁻⁴⁸. Exact copies of a point therefore do not fill up
//! neighbourhoods, no square overflows, and every midpoint that the search tree computes is exact, without which it need not
//! end.

use super::spread;
use crate::mesh::Point;
use nabo::{KDTree, NotNan};
use rayon::prelude::*;

/// Points in a neighbourhood, its centre included.
const FEW: u32 = 16;
/// The same where the nearest lie on a line, as they do along the stripes of a line scanner.
const MANY: u32 = 64;
/// Farther than this many radii of its own neighbourhood, a point belongs to another piece of surface.
const REACH: f64 = 3.0;
/// Steps of the rounded coordinates in a unit.
const STEPS: f64 = (1u64 << 48) as f64;

/// The distinct positions on the grid, sorted, and for each point the index of its own.
pub(super) fn distinct(points: &[Point]) -> (Vec<Point>, Vec<Option<usize>>) {
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
pub(super) struct Neighbourhood {
    /// Their numbers.
    pub members: Vec<u32>,
    /// Distance of the last.
    pub radius: f64,
}

/// Those of all places.
pub(super) fn neighbourhoods(places: &[Point]) -> Vec<Neighbourhood> {
    let (cloud, tree) = tree(places);
    let search = |place: &Place| {
        let few = nearest(&tree, place, FEW);
        if spread(places, &few.members).is_some() { few } else { nearest(&tree, place, MANY) }
    };
    cloud.par_iter().map(search).collect()
}

/// The search tree of places.
pub(super) fn tree(places: &[Point]) -> (Vec<Place>, KDTree<f64, Place>) {
    let cloud: Vec<Place> = places.iter().map(|p| Place(p.coords.into())).collect();
    let tree = KDTree::new(&cloud);
    (cloud, tree)
}

/// The `count` nearest of a place.
pub(super) fn nearest(tree: &KDTree<f64, Place>, place: &Place, count: u32) -> Neighbourhood {
    let found = tree.knn(count, place);
    let radius = found.last().map_or(0.0, |n| n.dist2.sqrt());
    Neighbourhood { members: found.iter().map(|n| n.index).collect(), radius }
}

/// The members of each neighbourhood without those of another piece: a stray point sees the surface as its
/// neighbour, but is far away for the surface.
pub(super) fn separated(places: &[Point], neighbourhoods: &[Neighbourhood]) -> Vec<Vec<u32>> {
    let keep = |(place, near): (&Point, &Neighbourhood)| {
        let reaches = |&&m: &&u32| {
            let other = m as usize;
            (places[other] - place).norm() <= REACH * neighbourhoods[other].radius
        };
        near.members.iter().filter(reaches).copied().collect()
    };
    places.par_iter().zip(neighbourhoods).map(keep).collect()
}

/// A position as the search tree wants it.
#[derive(Clone, Copy, Default)]
pub(super) struct Place([f64; 3]);

impl nabo::Point<f64> for Place {
    const DIM: u32 = 3;

    fn set(&mut self, i: u32, value: NotNan<f64>) {
        self.0[i as usize] = value.into_inner();
    }

    fn get(&self, i: u32) -> NotNan<f64> {
        NotNan::new(self.0[i as usize]).expect("positions on the grid are finite")
    }
}
