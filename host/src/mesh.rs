//! Triangle meshes and point clouds as they come from files and go into them.

use nalgebra::Similarity3;

/// A point in space; the unit is the file's, millimetres unless said otherwise.
pub type Point = nalgebra::Point3<f64>;
/// A direction or a difference of points.
pub type Vector = nalgebra::Vector3<f64>;

/// A triangle mesh, or a point cloud when it has no triangles.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Vertices.
    pub points: Vec<Point>,
    /// Unit normals, one a vertex, or empty where the file has none.
    pub normals: Vec<Vector>,
    /// Corner indices into `points`, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
}

/// Smallest and largest coordinates; `None` of no point.
pub fn bounds(mut points: impl Iterator<Item = Point>) -> Option<(Point, Point)> {
    let first = points.next()?;
    Some(points.fold((first, first), |(low, high), p| (low.inf(&p), high.sup(&p))))
}

/// Normal of a triangle, twice its area long.
pub fn twice_area_vector([a, b, c]: &[Point; 3]) -> Vector {
    (b - a).cross(&(c - a))
}

impl Mesh {
    /// The corners of triangle `index`.
    pub fn corners(&self, index: usize) -> [Point; 3] {
        self.triangles[index].map(|v| self.points[v as usize])
    }

    /// Whether it has points only.
    pub const fn is_cloud(&self) -> bool {
        self.triangles.is_empty()
    }

    /// Number of its triangles; of a cloud, of its points.
    pub const fn elements(&self) -> usize {
        if self.is_cloud() { self.points.len() } else { self.triangles.len() }
    }

    /// Lengths of the sides of triangle `index`, the shortest first.
    pub fn sides_of(&self, index: usize) -> [f64; 3] {
        let [a, b, c] = self.corners(index);
        let mut sides = [(b - a).norm(), (c - b).norm(), (a - c).norm()];
        sides.sort_by(f64::total_cmp);
        sides
    }

    /// Area of triangle `index`.
    pub fn area_of(&self, index: usize) -> f64 {
        twice_area_vector(&self.corners(index)).norm() / 2.0
    }

    /// Whether triangle `index` has an area, however small it is.
    pub fn has_area(&self, index: usize) -> bool {
        let [a, b, c] = self.corners(index);
        let (u, v) = (b - a, c - a);
        // Scaled first, by a power of two and so exactly: the product of tiny edges would vanish.
        let (_, exponent) = libm::frexp(u.amax().max(v.amax()));
        let [u, v] = [u, v].map(|side| side.map(|c| libm::ldexp(c, -exponent)));
        u.cross(&v).norm() > 0.0
    }

    /// Unit normal of triangle `index`; zero for one without area.
    pub fn normal_of(&self, index: usize) -> Vector {
        twice_area_vector(&self.corners(index)).try_normalize(0.0).unwrap_or_else(Vector::zeros)
    }

    /// Area of all triangles.
    pub fn area(&self) -> f64 {
        // Plus 0: the sum of nothing is -0.
        (0..self.triangles.len()).map(|t| self.area_of(t)).sum::<f64>() + 0.0
    }

    /// Smallest and largest coordinates over all vertices; `None` for an empty mesh.
    pub fn bounds(&self) -> Option<(Point, Point)> {
        bounds(self.points.iter().copied())
    }

    /// The mesh somewhere else.
    #[must_use]
    pub fn moved(&self, motion: &Similarity3<f64>) -> Self {
        Self {
            points: self.points.iter().map(|p| motion * p).collect(),
            normals: self.normals.iter().map(|n| motion.isometry.rotation * n).collect(),
            triangles: self.triangles.clone(),
        }
    }

    /// Appends another mesh, which shares no vertex with this one; normals are in both or in neither.
    pub fn append(&mut self, other: &Self) {
        let offset = self.points.len() as u32;
        self.points.extend(&other.points);
        self.normals.extend(&other.normals);
        self.triangles.extend(other.triangles.iter().map(|t| t.map(|v| v + offset)));
    }

    /// Unit normals of the vertices: those of the file, or else [`Mesh::normals_of_triangles`].
    pub fn vertex_normals(&self) -> Vec<Vector> {
        if self.normals.len() == self.points.len() {
            return self.normals.clone();
        }
        self.normals_of_triangles()
    }

    /// Unit normals of the vertices: the normalised sum of the area-weighted normals of the adjacent triangles; zero for a
    /// vertex without any.
    pub fn normals_of_triangles(&self) -> Vec<Vector> {
        let mut sums = vec![Vector::zeros(); self.points.len()];
        for (index, triangle) in self.triangles.iter().enumerate() {
            let normal = twice_area_vector(&self.corners(index));
            for &v in triangle {
                sums[v as usize] += normal;
            }
        }
        sums.into_iter().map(|n| n.try_normalize(0.0).unwrap_or_else(Vector::zeros)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triangles_of_any_size_have_an_area_unless_they_are_flat() {
        for exponent in [-1000, -300, 0, 300] {
            let has_area = |apex: [f64; 2]| {
                let points = [[0.0, 0.0], [1.0, 3.0], apex].map(|[x, y]| Point::new(x, y, 0.0));
                let points = points.map(|p| p.map(|c| libm::ldexp(c, exponent))).to_vec();
                Mesh { points, triangles: vec![[0, 1, 2]], ..Mesh::default() }.has_area(0)
            };
            assert!(has_area([1.0, 0.0]), "2^{exponent}");
            // Three times as far: divided by nine, and rounded, they would not lie on a line.
            assert!(!has_area([3.0, 9.0]), "2^{exponent}");
        }
    }
}
