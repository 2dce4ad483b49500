//! The plane a class is symmetric about, found from the shapes themselves.
//!
//! Of three planes through the middle of all shapes, across their principal axes, each is moved by Gauss-Newton until
//! the mirror images of the shapes' vertices lie on the shapes; the best one is taken. For a vertex p with its image
//! p' = p - 2 (n·p - d) n and the closest surface's distance r and normal g there,
//!
//! ```text
//! ∂r/∂d = 2 g·n,     ∂r/∂n along e = -2 ((e·p) (g·n) + (n·p - d) (g·e)),     w = 1 / (1 + (r / c)²)
//! ```

use super::Error;
use crate::distance::Surface;
use crate::mesh::{Mesh, Point, Vector};
use crate::picks::evenly;
use crate::volume::Lattice;
use lacuna::format::Symmetry;
use nalgebra::{Matrix3, SymmetricEigen, Vector3};
use rayon::prelude::*;

/// Shapes the plane is searched on, evenly taken from all.
const SHAPES: usize = 12;
/// Vertices of each of them.
const VERTICES: usize = 300;
/// Gauss-Newton steps.
const STEPS: usize = 20;
/// Misfit c at first and at last, as shares of the shapes' size.
const MISFIT: [f64; 2] = [0.05, 0.008];
/// Largest deviation of a symmetric class, as a share of its size.
const LARGEST: f64 = 0.015;

/// A plane n·p = d in the shapes' frame and unit.
#[derive(Clone, Copy, Debug)]
pub struct Plane {
    /// Unit normal n.
    pub normal: Vector,
    /// Offset d.
    pub offset: f64,
    /// Root mean square distance of the shapes' mirror images from the shapes.
    pub deviation: f64,
}

impl Plane {
    /// The same plane in the voxels of a lattice.
    pub fn in_voxels(&self, lattice: &Lattice) -> Symmetry {
        let offset = self.offset - self.normal.dot(&lattice.origin.coords);
        Symmetry {
            normal: self.normal.map(|v| v as f32).into(),
            offset: (offset / lattice.spacing) as f32,
            deviation: (self.deviation / lattice.spacing) as f32,
        }
    }

    fn reflect(&self, p: &Point) -> Point {
        p - self.normal * (2.0 * (self.normal.dot(&p.coords) - self.offset))
    }
}

/// A vertex and the surface of its shape.
type Sample<'a> = (Point, &'a Surface);

/// The plane that most nearly maps every shape onto itself.
///
/// # Errors
/// [`Error::NotSymmetric`] when none does so well enough.
pub fn find(shapes: &[Mesh], surfaces: &[Surface]) -> Result<Plane, Error> {
    let samples = samples(shapes, surfaces);
    let middle = samples.iter().map(|(p, _)| p.coords).sum::<Vector>() / samples.len().max(1) as f64;
    let spread = samples.iter().fold(Matrix3::zeros(), |sum, (p, _)| {
        let v = p.coords - middle;
        sum + v * v.transpose()
    });
    let size = (spread.trace() / samples.len().max(1) as f64).sqrt() * 2.0;
    let axes = SymmetricEigen::new(spread).eigenvectors;
    let start = |axis: usize| {
        let normal: Vector = axes.column(axis).into();
        Plane { normal, offset: normal.dot(&middle), deviation: 0.0 }
    };
    let [x, y, z] = [0, 1, 2].map(|axis| moved(start(axis), &samples, middle, size));
    let better = |a: Plane, b: Plane| if b.deviation < a.deviation { b } else { a };
    let best = better(better(x, y), z);
    if best.deviation > LARGEST * size {
        return Err(Error::NotSymmetric { deviation: best.deviation / size, limit: LARGEST });
    }
    Ok(upright(best))
}

fn samples<'a>(shapes: &[Mesh], surfaces: &'a [Surface]) -> Vec<Sample<'a>> {
    let of_one = |shape: usize| {
        let points = &shapes[shape].points;
        evenly(points.len(), VERTICES).map(move |i| (points[i], &surfaces[shape]))
    };
    evenly(shapes.len(), SHAPES).flat_map(of_one).collect()
}

/// A plane after all steps, with its deviation.
fn moved(mut plane: Plane, samples: &[Sample<'_>], middle: Vector, size: f64) -> Plane {
    for step in 0..STEPS {
        let along = step as f64 / (STEPS - 1) as f64;
        let misfit = size * MISFIT[0] * libm::pow(MISFIT[1] / MISFIT[0], along);
        plane = improved(&plane, samples, middle, misfit);
    }
    let squares: Vec<f64> = samples.par_iter().filter_map(|s| Some(image(&plane, s)?.0.powi(2))).collect();
    // An image that is all beyond the border says nothing.
    let enough = squares.len() * 4 > samples.len();
    let mean = squares.iter().sum::<f64>() / squares.len().max(1) as f64;
    plane.deviation = if enough { mean.sqrt() } else { f64::INFINITY };
    plane
}

/// Distance r and unit normal g where a vertex's image lies; `None` beyond the shape's border.
fn image(plane: &Plane, (p, surface): &Sample<'_>) -> Option<(f64, Vector)> {
    let at = surface.distance(&plane.reflect(p), f64::INFINITY)?;
    let normal = at.normal.try_normalize(0.0)?;
    (!at.on_border).then_some((at.value, normal))
}

fn improved(plane: &Plane, samples: &[Sample<'_>], middle: Vector, misfit: f64) -> Plane {
    let n = plane.normal;
    let across = n.cross(&Vector::ith(n.iamin(), 1.0)).normalize();
    let tangents = [across, n.cross(&across)];
    let local = plane.offset - n.dot(&middle);
    let row = |sample: &Sample<'_>| {
        let (r, g) = image(plane, sample)?;
        let p = sample.0.coords - middle;
        let turn = |e: &Vector| -2.0 * (e.dot(&p) * g.dot(&n) + (n.dot(&p) - local) * g.dot(e));
        let row = Vector3::new(turn(&tangents[0]), turn(&tangents[1]), 2.0 * g.dot(&n));
        let weight = 1.0 / (1.0 + (r / misfit).powi(2));
        Some((row, r, weight))
    };
    let rows: Vec<_> = samples.par_iter().filter_map(row).collect();
    let (mut matrix, mut vector) = (Matrix3::zeros(), Vector3::zeros());
    for (row, r, weight) in rows {
        matrix += row * row.transpose() * weight;
        vector -= row * (r * weight);
    }
    let Some(x) =
        (matrix + Matrix3::identity() * (1e-9 * matrix.trace() + 1e-30)).cholesky().map(|c| c.solve(&vector))
    else {
        return *plane;
    };
    let normal = (n + tangents[0] * x[0] + tangents[1] * x[1]).normalize();
    Plane { normal, offset: local + x[2] + normal.dot(&middle), deviation: 0.0 }
}

/// The same plane with the normal's largest component positive.
fn upright(plane: Plane) -> Plane {
    if plane.normal[plane.normal.iamax()] < 0.0 {
        return Plane { normal: -plane.normal, offset: -plane.offset, ..plane };
    }
    plane
}
