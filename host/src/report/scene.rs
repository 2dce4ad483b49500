//! What the interactive view shows, small enough for a page: coordinates in 16 bits, corners as differences.

use super::html::base64;
use crate::mesh::{Mesh, Point};
use rustc_hash::FxHashMap;
use serde::Serialize;

/// More triangles, or points of a cloud, than this are thinned for the view.
const MOST: usize = 160_000;

/// Meshes in one frame; the order of the fields is of no meaning to the viewer.
#[derive(Serialize)]
pub struct Scene {
    /// Symbol of the unit.
    pub unit: &'static str,
    /// Lower corner of the box that coordinates are relative to.
    low: [f64; 3],
    /// Length of a coordinate's step.
    step: f64,
    /// Distances that fill the scale of colours, ascending.
    pub ranges: [f64; 3],
    /// Columns of a turn that brings the front towards the viewer: right, up, front.
    pub axes: [[f64; 3]; 3],
    surfaces: Vec<Packed>,
}

/// A surface to choose.
pub struct Surface<'a> {
    /// What it is called.
    pub name: &'static str,
    /// Its mesh, in the frame of the scene.
    pub mesh: &'a Mesh,
    /// What its vertices' distances are measured to.
    pub distance_to: &'static str,
    /// Distances, one a vertex.
    pub distances: Vec<f32>,
    /// Expected errors, one a vertex.
    pub errors: Option<&'a [f32]>,
    /// Labels as in [`crate::complete::merge`], one a vertex.
    pub labels: Option<&'a [u8]>,
}

#[derive(Serialize)]
struct Packed {
    name: &'static str,
    vertices: usize,
    thinned: bool,
    /// Three u16 a vertex, little endian.
    points: String,
    /// Corners as differences to the corner before, zigzag, seven bits a byte.
    corners: String,
    distance_to: &'static str,
    /// A byte b a vertex stands for (b / 255)^2 of the largest of the ranges.
    distances: String,
    /// Expected errors, as the distances.
    errors: Option<String>,
    /// A byte a vertex.
    labels: Option<String>,
}

impl Scene {
    /// Packs surfaces; see the fields.
    pub fn new(unit: &'static str, ranges: [f64; 3], axes: [[f64; 3]; 3], surfaces: &[Surface<'_>]) -> Self {
        let bounds = surfaces.iter().filter_map(|s| s.mesh.bounds());
        let bounds = bounds.reduce(|a, b| (a.0.inf(&b.0), a.1.sup(&b.1)));
        let (low, high) = bounds.unwrap_or((Point::origin(), Point::new(1.0, 1.0, 1.0)));
        let step = ((high - low).max() / f64::from(u16::MAX)).max(f64::MIN_POSITIVE);
        let frame = Frame { low, step, farthest: ranges[2] };
        let surfaces = surfaces.iter().map(|surface| frame.pack(surface)).collect();
        Self { unit, low: low.into(), step, ranges, axes, surfaces }
    }
}

struct Frame {
    low: Point,
    step: f64,
    farthest: f64,
}

impl Frame {
    fn pack(&self, surface: &Surface<'_>) -> Packed {
        let place = |p: &Point| -> [u16; 3] { ((p - self.low) / self.step).map(|c| c.round() as u16).into() };
        let places: Vec<[u16; 3]> = surface.mesh.points.iter().map(place).collect();
        let thin = thin(&places, &surface.mesh.triangles);
        let kept = |v: &u32| *v as usize;
        let points = thin.kept.iter().flat_map(|v| places[kept(v)]).flat_map(u16::to_le_bytes);
        let level =
            |d: f32| (255.0 * (f64::from(d.abs()) / self.farthest).clamp(0.0, 1.0).sqrt()).round() as u8;
        let levels = |values: &[f32]| -> Vec<u8> {
            thin.kept.iter().map(|v| level(values.get(kept(v)).copied().unwrap_or(0.0))).collect()
        };
        let labels =
            surface.labels.map(|labels| thin.kept.iter().map(|v| labels[kept(v)]).collect::<Vec<u8>>());
        Packed {
            name: surface.name,
            vertices: thin.kept.len(),
            thinned: thin.kept.len() < places.len(),
            points: base64(&points.collect::<Vec<u8>>()),
            corners: base64(&differences(&thin.triangles)),
            distance_to: surface.distance_to,
            distances: base64(&levels(&surface.distances)),
            errors: surface.errors.map(|errors| base64(&levels(errors))),
            labels: labels.map(|labels| base64(&labels)),
        }
    }
}

/// A mesh with fewer vertices.
struct Thin {
    kept: Vec<u32>,
    triangles: Vec<[u32; 3]>,
}

/// Lets vertices of one cube be one, in cubes just large enough; all of them stay if there are few.
fn thin(places: &[[u16; 3]], triangles: &[[u32; 3]]) -> Thin {
    let mut result = Thin { kept: (0..places.len() as u32).collect(), triangles: triangles.to_vec() };
    let mut bits = 5;
    while result.triangles.len() > MOST || (triangles.is_empty() && result.kept.len() > MOST) {
        bits += 1;
        result = joined(places, triangles, bits);
        if bits == 16 {
            break;
        }
    }
    result
}

/// The first vertex of each cube of 2^`bits` steps stands for all of them.
fn joined(places: &[[u16; 3]], triangles: &[[u32; 3]], bits: u32) -> Thin {
    let mut cubes: FxHashMap<[u16; 3], u32> = FxHashMap::default();
    let mut kept = Vec::new();
    let cube = |place: &[u16; 3]| place.map(|c| c.checked_shr(bits).unwrap_or(0));
    let numbers: Vec<u32> = (0u32..)
        .zip(places)
        .map(|(v, place)| {
            *cubes.entry(cube(place)).or_insert_with(|| {
                kept.push(v);
                kept.len() as u32 - 1
            })
        })
        .collect();
    let moved = triangles.iter().map(|t| t.map(|v| numbers[v as usize]));
    Thin { kept, triangles: moved.filter(|[a, b, c]| a != b && b != c && c != a).collect() }
}

/// Corners as differences to the one before; neighbours in the list are neighbours in number.
fn differences(triangles: &[[u32; 3]]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut before = 0i64;
    for &corner in triangles.as_flattened() {
        let difference = i64::from(corner) - before;
        before = i64::from(corner);
        let mut rest = ((difference << 1) ^ (difference >> 63)) as u64;
        while rest >= 128 {
            bytes.push(rest as u8 | 128);
            rest >>= 7;
        }
        bytes.push(rest as u8);
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As the viewer reads them.
    fn corners(bytes: &[u8]) -> Vec<i64> {
        let (mut corners, mut before, mut at) = (vec![], 0, 0);
        while at < bytes.len() {
            let (mut value, mut shift) = (0i64, 0);
            while bytes[at] >= 128 {
                value |= i64::from(bytes[at] & 127) << shift;
                (shift, at) = (shift + 7, at + 1);
            }
            value |= i64::from(bytes[at]) << shift;
            at += 1;
            before += (value >> 1) ^ -(value & 1);
            corners.push(before);
        }
        corners
    }

    #[test]
    fn corners_come_back() {
        let triangles = [[0, 1, 2], [70_000, 2, 1], [3, 4_000_000_000, 5]];
        let expected: Vec<i64> = triangles.as_flattened().iter().map(|&c| i64::from(c)).collect();
        assert_eq!(corners(&differences(&triangles)), expected);
    }

    #[test]
    fn a_large_mesh_is_thinned_and_a_small_one_is_not() {
        let side = 400u32;
        let places: Vec<[u16; 3]> =
            (0..side * side).map(|i| [(i % side * 160) as u16, (i / side * 160) as u16, 0]).collect();
        let square = |i: u32| [[i, i + 1, i + side], [i + 1, i + side + 1, i + side]];
        let inner = (0..side * (side - 1)).filter(|i| i % side < side - 1);
        let triangles: Vec<[u32; 3]> = inner.flat_map(square).collect();
        let result = thin(&places, &triangles);
        assert!(result.triangles.len() <= MOST && result.triangles.len() > MOST / 8);
        assert!(result.triangles.as_flattened().iter().all(|&v| (v as usize) < result.kept.len()));
        let few = thin(&places[..800], &triangles[..500]);
        assert_eq!((few.kept.len(), few.triangles.len()), (800, 500));
        let cloud = thin(&vec![[7, 7, 7]; MOST + 1], &[]);
        assert_eq!(cloud.kept.len(), 1);
    }
}
