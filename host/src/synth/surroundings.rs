//! What is scanned along with a head though it is no part of the class: hair, a collar with shoulders, a table.

use super::Random;
use crate::mesh::{Mesh, Point, Vector};
use std::f64::consts::TAU;

/// Stream of a seed from which surroundings are drawn.
const STREAM: u64 = 90;
/// Cells of a patch in each direction.
const CELLS: u32 = 80;

/// Something around a shape that looks towards +z, y up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Surrounding {
    /// A bumpy shock over its top and back, with a ragged rim.
    Hair,
    /// A band around its lower end that widens into shoulders.
    Collar,
    /// A square below it, two and a half times as wide as the shape is high.
    Table,
}

impl Surrounding {
    /// The surface, in proportion to a shape with the bounds `low` and `high`; the same seed gives the same one.
    pub fn mesh(self, (low, high): (Point, Point), seed: u64) -> Mesh {
        let (middle, half) = (nalgebra::center(&low, &high), (high - low) / 2.0);
        let mut random = Random::new(seed, STREAM + self as u64);
        let waves = Waves::new(&mut random);
        match self {
            Self::Hair => hair(middle, half, &waves),
            Self::Collar => collar(middle, half, random.range(0.86, 1.1), &waves),
            Self::Table => table(middle, half),
        }
    }

    /// The surfaces of several as one.
    pub fn meshes(things: impl IntoIterator<Item = Self>, bounds: (Point, Point), seed: u64) -> Mesh {
        let mut all = Mesh::default();
        things.into_iter().for_each(|thing| all.append(&thing.mesh(bounds, seed)));
        all
    }
}

fn hair(middle: Point, half: Vector, waves: &Waves) -> Mesh {
    let centre = middle + half.component_mul(&Vector::new(0.0, 0.25, -0.35));
    let radii = half.component_mul(&Vector::new(1.25, 0.95, 1.2));
    patch(|u, v| {
        let around = TAU * u;
        // It ends above the forehead and reaches down at the back.
        let fringe = waves.at(&Vector::new(libm::sin(around), libm::cos(around), 0.0));
        let rim = (78.0 - 38.0 * libm::cos(around)).to_radians() * (1.0 + 0.15 * fringe);
        let down = (1.0 - v) * rim;
        let direction = upright(around, libm::sin(down), libm::cos(down));
        centre + radii.component_mul(&direction) * (1.0 + 0.06 * waves.at(&(2.0 * direction)))
    })
}

/// `width` is that of the neck in terms of the shape's.
fn collar(middle: Point, half: Vector, width: f64, waves: &Waves) -> Mesh {
    patch(|u, v| {
        let around = TAU * u;
        let up = 0.47 * v - 0.35;
        let radius = half.x * (width + 3.5 * (-up - 0.1).max(0.0));
        let height = half.y * (up - 0.86 + 0.1 * libm::cos(around));
        let point = middle + upright(around, radius, height).component_mul(&Vector::new(1.1, 1.0, 0.9))
            - Vector::z() * (0.35 * half.z);
        point + upright(around, 1.0, 0.0) * (0.025 * half.x * waves.at(&upright(around, 1.0, up)))
    })
}

fn table(middle: Point, half: Vector) -> Mesh {
    let side = 5.0 * half.y;
    patch(|u, v| middle + Vector::new((v - 0.5) * side, -1.02 * half.y, (u - 0.5) * side))
}

/// A vector that reaches `out` from the vertical axis and `up` along it.
fn upright(around: f64, out: f64, up: f64) -> Vector {
    Vector::new(out * libm::sin(around), up, out * libm::cos(around))
}

/// A patch that faces to the left of its u as seen along its v.
fn patch(place: impl Fn(f64, f64) -> Point) -> Mesh {
    let share = |i: u32| f64::from(i) / f64::from(CELLS);
    let points = (0..=CELLS).flat_map(|j| (0..=CELLS).map(move |i| (i, j)));
    let points = points.map(|(i, j)| place(share(i), share(j))).collect();
    let cells = (0..CELLS).flat_map(|j| (0..CELLS).map(move |i| j * (CELLS + 1) + i));
    let halves = |a: u32| [[a, a + 1, a + CELLS + 1], [a + 1, a + CELLS + 2, a + CELLS + 1]];
    Mesh { points, normals: vec![], triangles: cells.flat_map(halves).collect() }
}

/// A smooth random function of deviation 1, with periods of about a fifth of the unit sphere's girth.
struct Waves([(Vector, f64); 12]);

impl Waves {
    fn new(random: &mut Random) -> Self {
        Self([(); 12].map(|()| {
            let direction = Vector::from_fn(|_, _| 5.0 * random.normal());
            (direction, random.range(0.0, TAU))
        }))
    }

    fn at(&self, p: &Vector) -> f64 {
        let sum: f64 = self.0.iter().map(|(wave, phase)| libm::sin(wave.dot(p) + phase)).sum();
        sum / (0.5 * self.0.len() as f64).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOUNDS: (Point, Point) = (Point::new(-80.0, -115.0, -40.0), Point::new(80.0, 115.0, 130.0));

    #[test]
    fn they_face_away_from_the_head_and_up() {
        let middle = nalgebra::center(&BOUNDS.0, &BOUNDS.1);
        for (thing, from) in [
            (Surrounding::Hair, middle),
            (Surrounding::Collar, middle - Vector::y() * 150.0),
            (Surrounding::Table, middle - Vector::y() * 1000.0),
        ] {
            let mesh = thing.mesh(BOUNDS, 1);
            let outwards = |t: &usize| {
                let [a, b, c] = mesh.corners(*t);
                (b - a).cross(&(c - a)).dot(&(a - from)) > 0.0
            };
            let share =
                (0..mesh.triangles.len()).filter(outwards).count() as f64 / mesh.triangles.len() as f64;
            assert!(share > 0.8, "{thing:?}: {share}");
        }
    }

    #[test]
    fn hair_leaves_the_face_free_and_seeds_make_other_hair() {
        let hair = |seed: u64| Surrounding::Hair.mesh(BOUNDS, seed);
        let over_the_face = |p: &&Point| p.z > 70.0 && p.y < 70.0;
        for seed in 1..20 {
            assert_eq!(hair(seed).points.iter().filter(over_the_face).count(), 0, "seed {seed}");
        }
        assert_eq!(hair(1), hair(1));
        assert_ne!(hair(1), hair(2));
    }
}
