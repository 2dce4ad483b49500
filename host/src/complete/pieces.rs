//! Small pieces of a scan that belong to the shape after all: the rim of an ear that looks out behind a cheek is no larger
//! than a speck. What tells them apart is where they lie: a piece belongs if it is an inlier of the surface that is fitted to
//! the rest. What floats farther off may be a speck, and would leave a bump where nothing else was seen.

use crate::mesh::{Mesh, Point, Vector};
use crate::register::{Placed, Registration, refine_hint};
use crate::surface::{components, keep_triangles};
use lacuna::corners::Weights;
use lacuna::cube::Cube;
use lacuna::{Model, Standing};

/// Fewest triangles of a piece whose direction can be told.
const FEWEST: usize = 8;

/// The pieces of `small` that belong to the shape of which `scan` is the rest, `known` to lie so. None where the rest is
/// too little to fit the shape to.
pub fn belonging(model: &Model<'_>, scan: &Mesh, small: &Mesh, known: &Placed) -> Mesh {
    let pieces = components(small);
    let mut means = vec![Mean::default(); pieces.iter().max().map_or(0, |&p| p as usize + 1)];
    for (t, &piece) in pieces.iter().enumerate() {
        means[piece as usize].add(&small.corners(t));
    }
    if means.iter().all(|mean| mean.triangles < FEWEST) {
        return Mesh::default();
    }
    let Ok(fitted) = refine_hint(model, scan, known) else { return Mesh::default() };
    let belongs: Vec<bool> = means.iter().map(|mean| mean.belongs(model, &fitted)).collect();
    keep_triangles(small, |t| belongs[pieces[t] as usize])
}

/// Where a piece lies and which way it faces.
#[derive(Clone, Default)]
struct Mean {
    triangles: usize,
    area: f64,
    position: Vector,
    /// Sum of the triangles' normals times twice their areas.
    normal: Vector,
}

impl Mean {
    fn add(&mut self, [a, b, c]: &[Point; 3]) {
        let cross = (b - a).cross(&(c - a));
        let area = cross.norm();
        self.triangles += 1;
        self.area += area;
        self.position += (a.coords + b.coords + c.coords) * (area / 3.0);
        self.normal += cross;
    }

    fn belongs(&self, model: &Model<'_>, fitted: &Registration) -> bool {
        let position = Point::from(self.position / self.area);
        let Some(normal) = self.normal.try_normalize(0.0).filter(|_| self.triangles >= FEWEST) else {
            return false;
        };
        let placed = &fitted.placed;
        let at = placed.to_model(&position).coords.map(|c| c as f32).into();
        let normal = placed.pose.rotate(normal.map(|c| c as f32).into());
        let shape = Weights::new(&fitted.shape);
        Standing::of(&mut Cube::new(model, &shape), at, normal) == Standing::Inlier
    }
}
