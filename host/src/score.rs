//! How far a surface is from a complete target.

use crate::distance::Surface;
use crate::mesh::Mesh;
use crate::quantile::quantile;
use crate::surface::largest_component;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Distances of a surface's vertices to a target, in the target's unit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Score {
    /// Root mean square, eq. (17) with the mean inside the root.
    pub rms: f64,
    /// 95th percentile.
    pub p95: f64,
}

impl Score {
    /// The score of distances, none of which is negative; `None` of nothing.
    pub fn of(mut distances: Vec<f64>) -> Option<Self> {
        distances.sort_by(f64::total_cmp);
        let p95 = quantile(&distances, 0.95)?;
        let squares: f64 = distances.iter().map(|d| d * d).sum();
        Some(Self { rms: (squares / distances.len() as f64).sqrt(), p95 })
    }
}

/// Scores the largest piece of a surface. Vertices whose closest point is on the target's border are left out;
/// `None` where no vertex is left.
pub fn score(result: &Mesh, target: &Surface) -> Option<Score> {
    let piece = largest_component(result);
    let distance = |p| target.distance(p, f64::INFINITY).filter(|found| !found.on_border);
    Score::of(piece.points.par_iter().filter_map(|p| Some(distance(p)?.value.abs())).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Point;

    fn square(size: f64, height: f64) -> Mesh {
        let corner = |x: f64, y: f64| Point::new(x * size, y * size, height);
        let points = vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
        Mesh { points, normals: vec![], triangles: vec![[0, 1, 2], [0, 2, 3]] }
    }

    #[test]
    fn a_sheet_above_a_sheet_is_its_height_away() {
        let target = Surface::new(&square(10.0, 0.0)).unwrap();
        let found = score(&square(5.0, -2.0), &target).unwrap();
        assert_eq!(found, Score { rms: 2.0, p95: 2.0 });
    }

    #[test]
    fn what_is_beyond_the_border_does_not_count() {
        let target = Surface::new(&square(10.0, 0.0)).unwrap();
        let mut result = square(5.0, 2.0);
        result.points[2].x = 40.0;
        assert_eq!(score(&result, &target).unwrap().rms, 2.0);
        assert_eq!(score(&square(20.0, 1.0), &target), None);
    }

    #[test]
    fn only_the_largest_piece_counts() {
        let target = Surface::new(&square(10.0, 0.0)).unwrap();
        let mut result = square(5.0, 1.0);
        result.points.extend([[0., 0., 9.], [1., 0., 9.], [0., 1., 9.]].map(Point::from));
        result.triangles.push([4, 5, 6]);
        assert_eq!(score(&result, &target).unwrap().rms, 1.0);
    }
}
