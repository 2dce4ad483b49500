//! Carries motions of some vertices over to their neighbours.

use crate::mesh::{Mesh, Vector};

/// Motions of all vertices, where those of some are known: a vertex without one takes the mean of its neighbours'
/// times `fade`, over `rings` rings. Beyond them nothing moves.
pub fn carry(mesh: &Mesh, motions: &[Option<Vector>], fade: f64, rings: usize) -> Vec<Vector> {
    let mut current: Vec<Vector> = motions.iter().map(|m| m.unwrap_or_else(Vector::zeros)).collect();
    let mut reached: Vec<bool> = motions.iter().map(Option::is_some).collect();
    for _ in 0..rings {
        let mut sums = vec![(Vector::zeros(), 0.0f64); current.len()];
        for triangle in &mesh.triangles {
            for i in 0..3 {
                let (to, from) = (triangle[i] as usize, triangle[(i + 1) % 3] as usize);
                for (to, from) in [(to, from), (from, to)] {
                    if motions[to].is_none() && reached[from] {
                        sums[to].0 += current[from];
                        sums[to].1 += 1.0;
                    }
                }
            }
        }
        for (i, (sum, count)) in sums.into_iter().enumerate() {
            if count > 0.0 {
                current[i] = sum / count * fade;
                reached[i] = true;
            }
        }
    }
    current
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
}
