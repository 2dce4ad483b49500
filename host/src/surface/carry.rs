//! Carries motions of some vertices over to their neighbours.

use super::neighbours::Neighbours;
use crate::mesh::{Mesh, Vector};
use rayon::prelude::*;

/// Vertices that a thread takes at a time.
const SHARE: usize = 512;

/// Motions of all vertices, where those of some are known: a vertex without one takes the mean of its neighbours'
/// times `fade`, over `rings` rings. Beyond them nothing moves.
pub fn carry(mesh: &Mesh, motions: &[Option<Vector>], fade: f64, rings: usize) -> Vec<Vector> {
    steps(mesh, motions, fade, (0..rings).map(|step| step + 1))
}

/// The same for the vertices with a known motion and their neighbours only; those farther away have what was needed
/// for that: what is more than half of the rings away cannot reach them any more.
pub fn carry_next_to_known(mesh: &Mesh, motions: &[Option<Vector>], fade: f64, rings: usize) -> Vec<Vector> {
    steps(mesh, motions, fade, (0..rings).map(|step| (step + 1).min(rings - step)))
}

/// Means of the neighbours, again and again, each time of so many rings.
fn steps(
    mesh: &Mesh,
    motions: &[Option<Vector>],
    fade: f64,
    rings: impl Iterator<Item = usize> + Clone,
) -> Vec<Vector> {
    let mut current: Vec<Vector> = motions.iter().map(|m| m.unwrap_or_else(Vector::zeros)).collect();
    let around = Neighbours::new(mesh, |v| motions[v as usize].is_none());
    let (order, ring, ends) = rings_around(motions, &around, rings.clone().max().unwrap_or(0));
    for (before, rings) in rings.enumerate() {
        let mean = |&v: &u32| {
            let known = around.of(v).iter().filter(|&&n| ring[n as usize] <= before as u32);
            let (sum, count) = known
                .fold((Vector::zeros(), 0.0f64), |(sum, count), &n| (sum + current[n as usize], count + 1.0));
            sum / count * fade
        };
        let next: Vec<Vector> = order[..ends[rings - 1]].par_iter().with_min_len(SHARE).map(mean).collect();
        order.iter().zip(next).for_each(|(&v, motion)| current[v as usize] = motion);
    }
    current
}

/// The vertices of the first `most` rings around those with a motion, ring by ring; the ring of each vertex, 0 where
/// a motion is known, the largest number beyond; and where each ring ends in the list.
fn rings_around(
    motions: &[Option<Vector>],
    around: &Neighbours,
    most: usize,
) -> (Vec<u32>, Vec<u32>, Vec<usize>) {
    let mut ring: Vec<u32> = motions.iter().map(|m| if m.is_some() { 0 } else { u32::MAX }).collect();
    let first = |&v: &u32| around.of(v).iter().any(|&n| motions[n as usize].is_some());
    let mut order: Vec<u32> = (0..motions.len() as u32).filter(first).collect();
    let (mut ends, mut start) = (Vec::new(), 0);
    for number in 1..=most as u32 {
        order[start..].iter().for_each(|&v| ring[v as usize] = number);
        ends.push(order.len());
        let mut next = Vec::new();
        for &v in &order[start..] {
            for &n in around.of(v) {
                if ring[n as usize] == u32::MAX {
                    ring[n as usize] = number + 1;
                    next.push(n);
                }
            }
        }
        start = order.len();
        order.extend(next);
    }
    (order, ring, ends)
}

#[cfg(test)]
mod tests {
    use super::super::shapes::sheet;
    use super::*;

    #[test]
    fn a_motion_fades_ring_by_ring_and_known_ones_stay() {
        let mesh = sheet(8);
        let motions: Vec<Option<Vector>> = (0..64).map(|v| (v % 8 == 0).then(Vector::z)).collect();
        let carried = carry(&mesh, &motions, 0.5, 3);
        let heights: Vec<f64> = (0..8).map(|x| carried[8 * 4 + x].z).collect();
        assert_eq!((heights[0], heights[4]), (1.0, 0.0));
        assert!(heights[..4].windows(2).all(|w| w[0] > w[1] && w[1] > 0.0), "{heights:?}");
    }

    #[test]
    fn next_to_known_ones_it_is_the_same_bits() {
        let mesh = sheet(16);
        let height = |v: usize| Vector::new(v as f64 * 0.1, 1.0 / (v + 1) as f64, 1.0);
        let motions: Vec<Option<Vector>> = (0..256).map(|v| (v % 16 == 0).then(|| height(v))).collect();
        for rings in 1..=9 {
            let [all, near] = [carry, carry_next_to_known].map(|of| of(&mesh, &motions, 0.9, rings));
            let next = |&v: &usize| v % 16 < 2;
            assert!((0..256).filter(next).all(|v| all[v] == near[v]), "{rings} rings");
            assert!(rings < 3 || all != near, "{rings} rings: all of them were gone through");
        }
    }
}
