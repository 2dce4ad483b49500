//! Marching cubes on a signed-distance volume, with a manifold result.
//!
//! The surface is closed wherever it does not reach the rim of the volume or an unknown voxel; all
//! its edges have one or two triangles, and the fan of triangles around an inner vertex is a single
//! cycle. Only where unknown cells meet at an edge of the grid can two fans share a vertex.

use super::cases::{CASES, low_corner};
use super::signs::Signs;
use crate::mesh::{Mesh, Point};

/// A vertex keeps at least this part of an edge's length away from both ends, however close to zero
/// a value is, so that no triangle loses its area.
pub const CLAMP: f64 = 1.0 / 256.0;

/// Signed distances on a regular grid.
#[derive(Clone, Copy, Debug)]
pub struct Volume<'a> {
    /// Number of voxels along x, y and z.
    pub dims: [usize; 3],
    /// dims\[0\] dims\[1\] dims\[2\] values, x fastest. Negative is inside, zero counts as outside.
    /// A cell with an unknown corner, NaN or infinite, has no surface.
    pub values: &'a [f32],
}

impl Volume<'_> {
    fn holds_cells(&self) -> bool {
        let voxels = self.dims.iter().try_fold(1_usize, |product, &n| product.checked_mul(n));
        voxels == Some(self.values.len()) && self.dims.iter().all(|&n| n > 1)
    }
}

/// Extracts the zero surface. `origin` is the place of the first voxel, `spacing` the distance
/// between two voxels, both in the unit of the result. Triangles run counter-clockwise seen from
/// the positive side; their order follows the grid. Empty for a volume without cells, or when the
/// number of values does not match `dims`.
pub fn marching_cubes(volume: &Volume, origin: &Point, spacing: f64) -> Mesh {
    if !volume.holds_cells() {
        return Mesh::default();
    }
    let [_, ny, nz] = volume.dims;
    let mut sweep = Sweep::new(volume, origin, spacing);
    for z in 0..nz - 1 {
        sweep.enter(z);
        (0..ny - 1).for_each(|y| sweep.row(y, z));
    }
    sweep.mesh
}

const NONE: u32 = u32::MAX;

/// Walks the volume slice by slice and remembers the vertices on the edges of the current one.
struct Sweep<'a> {
    volume: Volume<'a>,
    origin: Point,
    spacing: f64,
    signs: Signs,
    /// Vertex on each edge, in five layers: x and y edges of even and odd slices, z edges between.
    vertices: Vec<u32>,
    /// From a cell's first voxel to the place of each of its edges in `vertices`.
    offsets: [usize; 12],
    mesh: Mesh,
}

impl<'a> Sweep<'a> {
    fn new(volume: &Volume<'a>, origin: &Point, spacing: f64) -> Self {
        let slice = volume.dims[0] * volume.dims[1];
        let (signs, vertices) = (Signs::new(volume), vec![NONE; 5 * slice]);
        Self {
            volume: *volume,
            origin: *origin,
            spacing,
            signs,
            vertices,
            offsets: [0; 12],
            mesh: Mesh::default(),
        }
    }

    /// Begins the cells between slices z and z + 1: forgets what is two slices old.
    fn enter(&mut self, z: usize) {
        let slice = self.volume.dims[0] * self.volume.dims[1];
        let stale = if z == 0 { vec![0, 1, 2, 3, 4] } else { vec![(z + 1) % 2, 2 + (z + 1) % 2, 4] };
        stale.iter().for_each(|layer| self.vertices[layer * slice..][..slice].fill(NONE));
        self.offsets = std::array::from_fn(|edge| {
            let (axis, low) = (edge / 4, low_corner(edge));
            let layer = if axis == 2 { 4 } else { 2 * axis + (z + (low >> 2)) % 2 };
            layer * slice + (low >> 1 & 1) * self.volume.dims[0] + (low & 1)
        });
    }

    fn row(&mut self, y: usize, z: usize) {
        let ny = self.volume.dims[1];
        let first = y + ny * z;
        for word in 0..self.signs.words() {
            for (bit, pattern) in self.signs.cells([first, first + 1, first + ny, first + ny + 1], word) {
                self.cell([64 * word + bit, y, z], pattern);
            }
        }
    }

    fn cell(&mut self, cell: [usize; 3], pattern: usize) {
        for triangle in CASES[pattern].triangles() {
            let corners = triangle.map(|edge| self.vertex(cell, usize::from(edge)));
            self.mesh.triangles.push(corners);
        }
    }

    /// The vertex on an edge, made when it is first asked for.
    fn vertex(&mut self, cell: [usize; 3], edge: usize) -> u32 {
        let place = self.offsets[edge] + cell[0] + self.volume.dims[0] * cell[1];
        if self.vertices[place] == NONE {
            self.vertices[place] = self.mesh.points.len() as u32;
            self.mesh.points.push(self.crossing(cell, edge));
        }
        self.vertices[place]
    }

    /// Where the surface crosses an edge, by linear interpolation.
    fn crossing(&self, cell: [usize; 3], edge: usize) -> Point {
        let (axis, low) = (edge / 4, low_corner(edge));
        let voxel: [usize; 3] = std::array::from_fn(|i| cell[i] + (low >> i & 1));
        let [nx, ny, _] = self.volume.dims;
        let index = voxel[0] + nx * (voxel[1] + ny * voxel[2]);
        let start = f64::from(self.volume.values[index]);
        let end = f64::from(self.volume.values[index + [1, nx, nx * ny][axis]]);
        let mut place = voxel.map(|i| i as f64);
        place[axis] += (start / (start - end)).clamp(CLAMP, 1.0 - CLAMP);
        self.origin + Point::from(place).coords * self.spacing
    }
}

#[cfg(test)]
mod tests {
    use super::super::shapes::{assert_oriented, ball, fans, volume_of};
    use super::super::{Edges, is_manifold};
    use super::*;
    use proptest::prelude::*;

    const N: usize = 6;

    fn extract(values: &[f32]) -> Mesh {
        marching_cubes(&Volume { dims: [N; 3], values }, &Point::origin(), 1.0)
    }

    fn is_rim(index: usize) -> bool {
        [index % N, index / N % N, index / N / N].iter().any(|&i| i == 0 || i == N - 1)
    }

    fn random_values() -> impl Strategy<Value = Vec<f32>> {
        let value = prop_oneof![8 => -1.0_f32..1.0, 1 => Just(0.0), 1 => Just(-0.0), 1 => Just(-1e-30)];
        prop::collection::vec(value, N * N * N)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(300))]

        #[test]
        fn closed_and_manifold_inside_a_positive_rim(mut values in random_values()) {
            (0..values.len()).filter(|&i| is_rim(i)).for_each(|i| values[i] = 1.0);
            let mesh = extract(&values);
            prop_assert!(is_manifold(&mesh));
            prop_assert_eq!(Edges::of(&mesh).boundary().count(), 0);
            prop_assert!(fans(&mesh).iter().all(|&fans| fans == 1));
            prop_assert!(mesh.triangles.is_empty() || volume_of(&mesh) > 0.0);
        }

        #[test]
        fn no_triangle_loses_its_area(values in random_values()) {
            let mesh = extract(&values);
            for index in 0..mesh.triangles.len() {
                let [a, b, c] = mesh.corners(index);
                prop_assert!((b - a).cross(&(c - a)).norm() > 1e-5);
            }
        }

        #[test]
        fn open_only_at_unknown_cells(
            mut values in random_values(),
            holes in prop::collection::vec(0..N * N * N, 1..12),
        ) {
            (0..values.len()).filter(|&i| is_rim(i)).for_each(|i| values[i] = 1.0);
            holes.iter().for_each(|&i| values[i] = f32::NAN);
            let mesh = extract(&values);
            let edges = Edges::of(&mesh);
            prop_assert_eq!(edges.non_manifold(), 0);
            for [a, b] in edges.boundary() {
                let middle = nalgebra::center(&mesh.points[a as usize], &mesh.points[b as usize]);
                let near = |&i: &usize| (0..3).all(|k| {
                    let place = (i / N.pow(k as u32) % N) as f64;
                    (middle[k] - place).abs() <= 1.0
                });
                prop_assert!(holes.iter().any(near));
            }
        }
    }

    #[test]
    fn a_ball_has_its_volume_and_its_area_and_faces_outward() {
        let mesh = ball(40, 12.0);
        assert!(is_manifold(&mesh));
        assert_oriented(&mesh, &Point::new(0.5, 0.25, 0.125));
        let area: f64 = (0..mesh.triangles.len())
            .map(|t| mesh.corners(t))
            .map(|[a, b, c]| (b - a).cross(&(c - a)).norm() / 2.0)
            .sum();
        let exact = std::f64::consts::PI * 12.0 * 12.0;
        assert!((area / (4.0 * exact) - 1.0).abs() < 0.005, "{area}");
        assert!((volume_of(&mesh) / (16.0 * exact) - 1.0).abs() < 0.005);
    }

    #[test]
    fn origin_and_spacing_place_the_surface() {
        let values = [-1.0, 3.0, -1.0, 3.0, -1.0, 3.0, -1.0, 3.0];
        let volume = Volume { dims: [2; 3], values: &values };
        let mesh = marching_cubes(&volume, &Point::new(10.0, 20.0, 30.0), 4.0);
        assert_eq!(mesh.triangles.len(), 2);
        assert!(mesh.points.iter().all(|p| p.x == 11.0));
        assert_eq!(mesh.bounds(), Some((Point::new(11.0, 20.0, 30.0), Point::new(11.0, 24.0, 34.0))));
    }

    #[test]
    fn odd_volumes_are_empty() {
        for (dims, len) in [([0, 0, 0], 0), ([1, 5, 5], 25), ([2, 2, 2], 7), ([usize::MAX; 3], 8)] {
            let values = vec![-1.0; len];
            assert_eq!(
                marching_cubes(&Volume { dims, values: &values }, &Point::origin(), 1.0),
                Mesh::default()
            );
        }
    }
}
