//! Cubes of one edge that space is cut into: what is near a point lies in its own or in the 26 around it.

use crate::mesh::Point;

/// Number of a cube along x, y and z.
pub type Cube = [i64; 3];

/// The cube that a point lies in. Clamped, so that its neighbours have numbers too.
pub fn cube(p: &Point, edge: f64) -> Cube {
    const FARTHEST: f64 = (1u64 << 62) as f64;
    p.coords.map(|c| (c / edge).floor().clamp(-FARTHEST, FARTHEST) as i64).into()
}

/// A cube and those that touch it, x fastest.
pub fn around([x, y, z]: Cube) -> impl Iterator<Item = Cube> {
    (0..27).map(move |i| [x + i % 3 - 1, y + i / 3 % 3 - 1, z + i / 9 - 1])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cube_and_its_neighbours_hold_what_is_within_an_edge() {
        let p = Point::new(0.1, -3.9, 7.0);
        let cubes: Vec<Cube> = around(cube(&p, 2.0)).collect();
        assert_eq!((cubes.len(), cubes[13]), (27, [0, -2, 3]));
        for axis in 0..3 {
            for step in [-2.0, 2.0] {
                let mut other = p;
                other[axis] += step;
                assert!(cubes.contains(&cube(&other, 2.0)));
            }
        }
    }

    #[test]
    fn cubes_without_an_edge_and_points_without_end_have_neighbours() {
        for (place, edge) in [(f64::INFINITY, 1.0), (-1e300, 1e-300), (1.0, 0.0), (f64::NAN, 1.0)] {
            assert_eq!(around(cube(&Point::new(place, 0.5, 0.5), edge)).count(), 27);
        }
    }
}
