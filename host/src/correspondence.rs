//! The correspondence model of section 2.1, eqs. (1)-(3): principal components of vertex positions, for meshes
//! that share their connectivity. It is the baseline of figure 2.

use crate::mesh::{Mesh, Point};
use crate::register::umeyama::similarity;
use nalgebra::{DMatrix, DVector, Similarity3, SymmetricEigen};

/// Modes with less than this share of the strongest one's variance are rounding, not shape.
const WEAKEST: f64 = 1e-12;
/// Largest number of rounds in which pose and weights are found in turn.
const ROUNDS: usize = 100;
/// Rounds end when no weight moves by more than this, standard deviations.
const STILL: f64 = 1e-4;

/// Mean and modes of vertex positions: C = C_mean + A w, eq. (2), with w = s v.
#[derive(Clone, Debug)]
pub struct Correspondence {
    /// C_mean, three coordinates a vertex.
    mean: DVector<f64>,
    /// A: orthonormal columns, strongest mode first.
    axes: DMatrix<f64>,
    /// s_k: standard deviation of each weight over the training set.
    deviations: DVector<f64>,
    triangles: Vec<[u32; 3]>,
}

/// Why there is no correspondence model.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Error {
    /// Fewer than two shapes.
    #[error("a correspondence model needs at least 2 shapes, {0} given")]
    TooFew(usize),
    /// A training mesh with vertices or triangles of its own, counted from zero.
    #[error(
        "the correspondence model needs meshes with the same triangles: shape {} differs from the first",
        .0 + 1
    )]
    Connectivity(usize),
    /// A mesh to approximate that has other vertices or triangles than the model.
    #[error("the correspondence model cannot approximate a mesh with other triangles than its own")]
    Target,
    /// Equal shapes.
    #[error("the shapes do not differ")]
    NoVariation,
}

/// Whether the vertices of two meshes correspond.
pub fn correspond(a: &Mesh, b: &Mesh) -> bool {
    a.points.len() == b.points.len() && a.triangles == b.triangles
}

impl Correspondence {
    /// Trains on aligned meshes of one connectivity, eq. (1).
    ///
    /// # Errors
    /// Fewer than two shapes, equal ones, or meshes whose vertices do not correspond.
    pub fn train(shapes: &[&Mesh]) -> Result<Self, Error> {
        let [first, rest @ ..] = shapes else { return Err(Error::TooFew(0)) };
        if rest.is_empty() {
            return Err(Error::TooFew(1));
        }
        if let Some(other) = rest.iter().position(|shape| !correspond(first, shape)) {
            return Err(Error::Connectivity(other + 1));
        }
        let m = shapes.len();
        let columns: Vec<DVector<f64>> = shapes.iter().map(|shape| coordinates(&shape.points)).collect();
        let mean = columns.iter().fold(DVector::zeros(columns[0].len()), |sum, c| sum + c) / m as f64;
        let centred = DMatrix::from_columns(&columns.iter().map(|c| c - &mean).collect::<Vec<_>>());
        let eigen = SymmetricEigen::new(centred.tr_mul(&centred));
        let mut order: Vec<usize> = (0..m).collect();
        order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
        order.truncate(m - 1);
        let least = WEAKEST * eigen.eigenvalues[order[0]];
        order.retain(|&k| eigen.eigenvalues[k] > least && eigen.eigenvalues[k] > 0.0);
        if order.is_empty() {
            return Err(Error::NoVariation);
        }
        let axis = |&k: &usize| &centred * eigen.eigenvectors.column(k) / eigen.eigenvalues[k].sqrt();
        let axes = DMatrix::from_columns(&order.iter().map(axis).collect::<Vec<_>>());
        let deviation = |&k: &usize| (eigen.eigenvalues[k] / (m - 1) as f64).sqrt();
        let deviations = DVector::from_iterator(order.len(), order.iter().map(deviation));
        Ok(Self { mean, axes, deviations, triangles: first.triangles.clone() })
    }

    /// Modes.
    pub fn modes(&self) -> usize {
        self.deviations.len()
    }

    /// The mesh for weights in standard deviations, eq. (2).
    pub fn instance(&self, sigmas: &DVector<f64>) -> Mesh {
        let position = &self.mean + &self.axes * sigmas.component_mul(&self.deviations);
        let points = position.as_slice().as_chunks::<3>().0.iter().map(|&p| Point::from(p)).collect();
        Mesh { points, normals: Vec::new(), triangles: self.triangles.clone() }
    }

    /// w_opt = Aᵀ (C - C_mean), the weights of least squared vertex distance, in standard deviations.
    ///
    /// # Errors
    /// A mesh whose vertices do not correspond.
    pub fn weights(&self, mesh: &Mesh) -> Result<DVector<f64>, Error> {
        if mesh.points.len() * 3 != self.mean.len() || mesh.triangles != self.triangles {
            return Err(Error::Target);
        }
        Ok(self.projected(&mesh.points))
    }

    fn projected(&self, points: &[Point]) -> DVector<f64> {
        self.axes.tr_mul(&(coordinates(points) - &self.mean)).component_div(&self.deviations)
    }

    /// The best approximation of a mesh, in the mesh's frame. With `moving` its pose and size are found as well,
    /// in turn with the weights; without, the mesh is in the model's frame.
    ///
    /// # Errors
    /// A mesh whose vertices do not correspond.
    pub fn approximate(&self, mesh: &Mesh, moving: bool) -> Result<Mesh, Error> {
        let mut weights = self.weights(mesh)?;
        let mut motion = Similarity3::identity();
        for _ in 0..if moving { ROUNDS } else { 0 } {
            let made = self.instance(&weights);
            let pairs: Vec<(Point, Point)> = mesh.points.iter().copied().zip(made.points).collect();
            let Some(next) = similarity(&pairs) else { break };
            motion = next;
            let moved: Vec<Point> = mesh.points.iter().map(|p| motion * p).collect();
            let before = std::mem::replace(&mut weights, self.projected(&moved));
            if (&weights - before).amax() < STILL {
                break;
            }
        }
        let mut made = self.instance(&weights);
        let back = motion.inverse();
        made.points.iter_mut().for_each(|p| *p = back * *p);
        Ok(made)
    }
}

/// C of eq. (1): x, y, z of each vertex in turn.
fn coordinates(points: &[Point]) -> DVector<f64> {
    DVector::from_iterator(3 * points.len(), points.iter().flat_map(|p| [p.x, p.y, p.z]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synth::Head;
    use nalgebra::{Translation3, UnitQuaternion, Vector3};

    /// Bent copies of one head: their own tessellations would not correspond.
    fn heads(count: u64) -> Vec<Mesh> {
        let head = Head::sample(5, 0).mesh();
        let bent = |i: u64| {
            let (a, b) = (0.02 * i as f64, 0.01 * (i * i) as f64);
            let bend = |p: &Point| Point::new(p.x * (1.0 + a), p.y + b * p.x, p.z - a * p.y);
            let points = head.points.iter().map(bend).collect();
            Mesh { points, normals: Vec::new(), triangles: head.triangles.clone() }
        };
        (0..count).map(bent).collect()
    }

    fn largest(a: &Mesh, b: &Mesh) -> f64 {
        a.points.iter().zip(&b.points).map(|(p, q)| (p - q).norm()).fold(0.0, f64::max)
    }

    #[test]
    fn every_training_shape_is_an_instance_of_its_weights() {
        let heads = heads(4);
        let model = Correspondence::train(&heads.iter().collect::<Vec<_>>()).unwrap();
        for head in &heads {
            let weights = model.weights(head).unwrap();
            assert!(largest(&model.instance(&weights), head) < 1e-6);
        }
    }

    #[test]
    fn whitened_weights_of_the_training_set_have_unit_variance() {
        let heads = heads(5);
        let model = Correspondence::train(&heads.iter().collect::<Vec<_>>()).unwrap();
        let weights: Vec<_> = heads.iter().map(|head| model.weights(head).unwrap()).collect();
        for k in 0..model.modes() {
            let sum: f64 = weights.iter().map(|w| w[k] * w[k]).sum();
            assert!((sum / 4.0 - 1.0).abs() < 1e-6, "mode {k}: {sum}");
        }
    }

    #[test]
    fn a_moved_and_scaled_shape_is_found_again() {
        let heads = heads(4);
        let model = Correspondence::train(&heads.iter().collect::<Vec<_>>()).unwrap();
        let turn = UnitQuaternion::from_euler_angles(0.05, -0.03, 0.02);
        let motion = Similarity3::from_parts(Translation3::new(3.0, -2.0, 1.0), turn, 1.03);
        let mut moved = heads[2].clone();
        moved.points.iter_mut().for_each(|p| *p = motion * *p);
        let still = largest(&model.approximate(&moved, false).unwrap(), &moved);
        let found = largest(&model.approximate(&moved, true).unwrap(), &moved);
        assert!(found < 0.1 * still, "{found} against {still} mm");
    }

    #[test]
    fn other_connectivity_is_refused() {
        let mut heads = heads(3);
        heads[1].triangles.pop();
        let refused = Correspondence::train(&heads.iter().collect::<Vec<_>>());
        assert_eq!(refused.unwrap_err(), Error::Connectivity(1));
        assert_eq!(Correspondence::train(&[]).unwrap_err(), Error::TooFew(0));
        let model = Correspondence::train(&[&heads[0], &heads[2]]).unwrap();
        assert_eq!(model.weights(&heads[1]).unwrap_err(), Error::Target);
    }

    #[test]
    fn equal_shapes_make_no_model() {
        let head = &heads(1)[0];
        assert_eq!(Correspondence::train(&[head, head]).unwrap_err(), Error::NoVariation);
    }

    #[test]
    fn instances_have_the_unit_of_the_meshes() {
        let heads = heads(3);
        let model = Correspondence::train(&heads.iter().collect::<Vec<_>>()).unwrap();
        let mean = model.instance(&DVector::zeros(model.modes()));
        let middle = heads.iter().fold(Vector3::zeros(), |sum, head| sum + head.points[7].coords) / 3.0;
        assert!((mean.points[7].coords - middle).norm() < 1e-9);
    }
}
