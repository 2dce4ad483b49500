//! Meshes and measures for the tests of this folder.

use super::{Volume, marching_cubes};
use crate::mesh::{Mesh, Point};
use rand::{RngExt, SeedableRng};

/// A ball about (1/2, 1/4, 1/8) in a grid of n^3 unit voxels around the origin.
pub fn ball(n: usize, radius: f64) -> Mesh {
    let first = -(n as f64 - 1.0) / 2.0;
    let at = |i: usize| first + i as f64;
    let distance = |i: usize| {
        let place = Point::new(at(i % n), at(i / n % n), at(i / n / n));
        (nalgebra::distance(&place, &Point::new(0.5, 0.25, 0.125)) - radius) as f32
    };
    let values: Vec<f32> = (0..n * n * n).map(distance).collect();
    marching_cubes(&Volume { dims: [n; 3], values: &values }, &Point::new(first, first, first), 1.0)
}

/// A flat square of n by n vertices in the plane z = 0, seen from above.
pub fn sheet(n: u32) -> Mesh {
    let points = (0..n * n).map(|i| Point::new(f64::from(i % n), f64::from(i / n), 0.0)).collect();
    let corners = (0..n * (n - 1)).filter(|i| i % n < n - 1);
    let triangles = corners.flat_map(|i| [[i, i + 1, i + n + 1], [i, i + n + 1, i + n]]).collect();
    Mesh { points, normals: Vec::new(), triangles }
}

/// A sheet of 60 by 60 points at heights, with noise of a standard deviation along z.
pub fn noisy(height: impl Fn(f64, f64) -> f64, deviation: f64) -> Mesh {
    let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(5);
    let mut normal = || (0..12).map(|_| random.random::<f64>()).sum::<f64>() - 6.0;
    let mut mesh = sheet(60);
    for p in &mut mesh.points {
        p.z = height(p.x, p.y) + deviation * normal();
    }
    mesh
}

/// Two meshes as one.
pub fn joined(a: &Mesh, b: &Mesh) -> Mesh {
    let mut mesh = a.clone();
    mesh.append(b);
    mesh
}

/// The volume a closed mesh encloses, positive if its triangles face outward.
pub fn volume_of(mesh: &Mesh) -> f64 {
    let part = |[a, b, c]: [Point; 3]| a.coords.dot(&b.coords.cross(&c.coords)) / 6.0;
    (0..mesh.triangles.len()).map(|t| part(mesh.corners(t))).sum()
}

/// All triangles face away from `centre`.
pub fn assert_oriented(mesh: &Mesh, centre: &Point) {
    for [a, b, c] in (0..mesh.triangles.len()).map(|t| mesh.corners(t)) {
        assert!((b - a).cross(&(c - a)).dot(&(a - centre)) > 0.0);
    }
}

/// For each vertex, how many fans of triangles meet there, counted literally.
pub fn fans(mesh: &Mesh) -> Vec<usize> {
    let mut spokes = vec![Vec::new(); mesh.points.len()];
    for t in &mesh.triangles {
        (0..3).for_each(|k| spokes[t[k] as usize].push((t[(k + 1) % 3], t[(k + 2) % 3])));
    }
    spokes.into_iter().map(count_fans).collect()
}

fn count_fans(mut spokes: Vec<(u32, u32)>) -> usize {
    let mut count = 0;
    while let Some((mut first, mut last)) = spokes.pop() {
        count += 1;
        while let Some(i) = spokes.iter().position(|&(a, b)| a == last || b == first) {
            let (a, b) = spokes.swap_remove(i);
            (first, last) = if a == last { (first, b) } else { (a, last) };
        }
    }
    count
}
