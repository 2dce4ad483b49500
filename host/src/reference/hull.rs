//! Distances of a scan in a thin hull along the lines of sight (CL96 in section 3.2).
//!
//! A point claims the voxels along its normal: up to `front` on both sides of its tangent plane, up to
//! `lateral` beside its normal. The nearest of all points that claim a voxel gives the distance, which is
//! measured to that point's tangent plane. Voxels more than `behind` behind the surface are claimed, but then
//! left out.

use super::{Grid, Hull};

/// How far a point reaches, voxels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reach {
    /// In front of the surface, and claimed behind it.
    pub front: f64,
    /// Behind the surface, in the hull.
    pub behind: f64,
    /// Sideways.
    pub lateral: f64,
}

/// A point of a scan and its outward unit normal, voxels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Oriented {
    /// Position.
    pub point: [f64; 3],
    /// Unit normal.
    pub normal: [f64; 3],
}

/// What a point says about a voxel.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
struct Claim {
    /// Squared distance to the point itself: the smallest wins.
    squared: f64,
    /// Absolute distance to its tangent plane: decides between equals.
    size: f64,
    /// The same with its sign: behind wins between mirror images.
    distance: f64,
}

impl Oriented {
    fn claim(&self, voxel: [usize; 3], reach: &Reach) -> Option<Claim> {
        let offset: [f64; 3] = std::array::from_fn(|axis| voxel[axis] as f64 - self.point[axis]);
        let distance: f64 = offset.iter().zip(self.normal).map(|(o, n)| o * n).sum();
        let squared: f64 = offset.iter().map(|o| o * o).sum();
        let beside = squared - distance * distance;
        let reached = distance.abs() <= reach.front && beside <= reach.lateral * reach.lateral;
        reached.then_some(Claim { squared, size: distance.abs(), distance })
    }
}

/// Distances of the voxels that points claim.
pub fn hull(grid: Grid, points: &[Oriented], reach: &Reach) -> Hull {
    let mut claims: Vec<Option<Claim>> = vec![None; grid.len()];
    let ball = libm::hypot(reach.front, reach.lateral);
    for point in points {
        let low = point.point.map(|p| (p - ball).floor() as i64);
        let high = point.point.map(|p| (p + ball).ceil() as i64);
        for voxel in grid.within(low, high) {
            let Some(new) = point.claim(voxel, reach) else { continue };
            let claim = &mut claims[grid.index(voxel)];
            if claim.is_none_or(|old| new < old) {
                *claim = Some(new);
            }
        }
    }
    let measured = |claim: Option<Claim>| claim.map(|c| c.distance).filter(|&d| d >= -reach.behind);
    claims.into_iter().map(measured).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const GRID: Grid = Grid { sides: [9, 9, 9] };
    const REACH: Reach = Reach { front: 3.0, behind: 1.0, lateral: 0.8 };

    /// Points half a voxel apart on the plane z = `height`, x from 2 to 6.
    fn sheet(height: f64, up: f64) -> Vec<Oriented> {
        let place = |i: usize| [2.0 + (i % 9) as f64 / 2.0, (i / 9) as f64 / 2.0, height];
        (0..9 * 17).map(|i| Oriented { point: place(i), normal: [0.0, 0.0, up] }).collect()
    }

    fn column(hull: &Hull, x: usize) -> Vec<Option<f64>> {
        (0..9).map(|z| hull[GRID.index([x, 4, z])]).collect()
    }

    #[test]
    fn a_plane_reaches_far_ahead_and_one_voxel_behind() {
        let found = column(&hull(GRID, &sheet(4.25, 1.0), &REACH), 4);
        let (n, s) = (None, Some);
        assert_eq!(found, [n, n, n, n, s(-0.25), s(0.75), s(1.75), s(2.75), n]);
    }

    #[test]
    fn beyond_the_border_is_no_hull() {
        let found = hull(GRID, &sheet(4.0, 1.0), &REACH);
        assert!(column(&found, 2).iter().any(Option::is_some));
        assert!(column(&found, 1).iter().all(Option::is_none));
    }

    #[test]
    fn the_back_of_a_thin_part_is_not_reached_through_it() {
        let mut points = sheet(6.0, 1.0);
        points.extend(sheet(4.0, -1.0));
        let found = column(&hull(GRID, &points, &REACH), 4);
        assert_eq!(found[3], Some(1.0));
        assert_eq!(found[7], Some(1.0));
        assert_eq!(found[5], Some(-1.0));
    }

    #[test]
    fn the_order_of_points_does_not_matter() {
        let mut points = sheet(6.0, 1.0);
        points.extend(sheet(4.3, -1.0));
        let forth = hull(GRID, &points, &REACH);
        points.reverse();
        assert_eq!(forth, hull(GRID, &points, &REACH));
    }
}
