//! How neighbours of a cloud's points lie to them.

use super::neighbourhoods::{distinct, nearest, tree};
use crate::mesh::{Point, Vector};
use crate::picks::evenly;

/// Points that are asked for a neighbour.
const ASKED: usize = 20_000;

/// How a neighbour of a point lies to it.
#[derive(Clone, Copy, Debug)]
pub struct Neighbour {
    /// Number of the point that was asked.
    pub point: usize,
    /// How far away it is, in the unit of the points.
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
    let (cloud, tree) = tree(&places);
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
