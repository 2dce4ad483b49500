//! Small pieces of a scan that belong to the shape after all: the rim of an ear that looks out behind a cheek is no larger
//! than a speck. What tells them apart is where they lie: a piece belongs if it is an inlier of the surface that is fitted to
//! the rest. What floats farther off may be a speck, and would leave a bump where nothing else was seen.

use super::clean::Cleaned;
use super::start::Known;
use crate::mesh::{Mesh, Point, Vector, twice_area_vector};
use crate::register::{Registration, refine_hint};
use crate::surface::keep;
use lacuna::corners::Weights;
use lacuna::cube::Cube;
use lacuna::{Model, Standing};

/// Fewest triangles (of a cloud, points) of a piece whose direction can be told.
const FEWEST: usize = 8;

/// The small pieces that belong to the shape of which the scan is the rest, `known` to lie so. None where the rest is too
/// little to fit the shape to.
pub fn belonging(model: &Model<'_>, Cleaned { scan, small, pieces, .. }: &Cleaned, known: &Known) -> Mesh {
    let mut means = vec![Mean::default(); pieces.iter().max().map_or(0, |&p| p as usize + 1)];
    for (i, &piece) in pieces.iter().enumerate() {
        means[piece as usize].add(small, i);
    }
    if means.iter().all(|mean| mean.members < FEWEST) {
        return Mesh::default();
    }
    // With a pose that is exact no shape was fitted: one is, to a pose that may differ a little.
    let found = known.registration.clone().or_else(|| refine_hint(model, scan, &known.placed).ok());
    let Some(found) = found else { return Mesh::default() };
    let belongs: Vec<bool> = means.iter().map(|mean| mean.belongs(model, &found)).collect();
    keep(small, |i| belongs[pieces[i] as usize])
}

/// Where a piece lies and which way it faces.
#[derive(Clone, Default)]
struct Mean {
    members: usize,
    area: f64,
    position: Vector,
    /// Sum of the triangles' normals times twice their areas.
    normal: Vector,
}

impl Mean {
    /// Adds a triangle of a mesh, or a point of a cloud, as one of area 1.
    fn add(&mut self, mesh: &Mesh, i: usize) {
        let (position, normal) = if mesh.is_cloud() {
            (mesh.points[i].coords, mesh.normals.get(i).copied().unwrap_or_default())
        } else {
            let [a, b, c] = mesh.corners(i);
            ((a.coords + b.coords + c.coords) / 3.0, twice_area_vector(&[a, b, c]))
        };
        let area = if mesh.is_cloud() { 1.0 } else { normal.norm() };
        self.members += 1;
        self.area += area;
        self.position += position * area;
        self.normal += normal;
    }

    fn belongs(&self, model: &Model<'_>, found: &Registration) -> bool {
        let position = Point::from(self.position / self.area);
        let Some(normal) = self.normal.try_normalize(0.0).filter(|_| self.members >= FEWEST) else {
            return false;
        };
        let placed = &found.placed;
        let at = placed.to_voxels(&position);
        let normal = placed.pose.rotate(normal.map(|c| c as f32).into());
        let shape = Weights::new(&found.shape);
        let mut cube = Cube::new(model, &shape);
        let sample = cube.find(at).map(Cube::distance);
        sample.is_some_and(|sample| Standing::from_sample(model, sample, normal) == Standing::Inlier)
    }
}
