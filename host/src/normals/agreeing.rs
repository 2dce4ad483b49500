//! Makes the normals that a cloud came with agree.

use super::neighbourhoods::{distinct, neighbourhoods, separated};
use super::sides::{agree, turn_outwards};
use crate::mesh::{Point, Vector};

/// Neighbours that rise more than this out of a point's plane, as a share of their distance, are on the other side of a sheet.
const SHEET: f64 = 0.5;
/// A side that so few of a piece's normals face is the wrong one. Of six scans with the sign of the largest component 63 to 77 %
/// faced inwards, so a mere majority tells nothing.
const FEW_FACE: f64 = 0.1;

/// The normals of a cloud, some of them turned so that those of each connected piece agree: to the side that nearly all of them
/// face, or else to that of [`estimate`](super::estimate).
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
