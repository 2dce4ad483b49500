//! The surface that a depth image shows: neighbouring pixels joined by triangles.

use super::DepthView;
use crate::mesh::Mesh;

/// A pixel: column and row.
type Pixel = (usize, usize);

impl DepthView {
    /// Triangulates the pixel grid, in the scan frame; triangles face the camera.
    ///
    /// No triangle has an unmeasured corner, none spans more than `max_jump_mm` in depth. Of the
    /// two ways to cut four pixels, the diagonal with the smaller step is taken. Pixels without
    /// a triangle give no vertex.
    pub fn mesh(&self, max_jump_mm: f64) -> Mesh {
        let mut sheet = Sheet { view: self, index: vec![u32::MAX; self.depth.len()], mesh: Mesh::default() };
        let mirrored = self.camera_to_scan.fixed_view::<3, 3>(0, 0).determinant() < 0.0;
        for v in 1..self.height {
            for u in 1..self.width {
                for [a, b, c] in self.cell(u, v).into_iter().filter(|t| self.is_joined(t, max_jump_mm)) {
                    sheet.add(if mirrored { [a, c, b] } else { [a, b, c] });
                }
            }
        }
        sheet.mesh
    }

    /// The two triangles between pixel (`u`, `v`) and its upper left neighbour, counter-clockwise
    /// as the camera sees them (its y points down).
    fn cell(&self, u: usize, v: usize) -> [[Pixel; 3]; 2] {
        let [a, b, c, d] = [(u - 1, v - 1), (u, v - 1), (u - 1, v), (u, v)];
        let step = |p: Pixel, q: Pixel| match (self.at(p.0, p.1), self.at(q.0, q.1)) {
            (0, _) | (_, 0) => u16::MAX,
            (p, q) => p.abs_diff(q),
        };
        if step(a, d) <= step(b, c) { [[a, c, d], [a, d, b]] } else { [[a, c, b], [b, c, d]] }
    }

    fn is_joined(&self, triangle: &[Pixel; 3], max_jump_mm: f64) -> bool {
        let depths = triangle.map(|(u, v)| self.at(u, v));
        let (low, high) = (depths.iter().min(), depths.iter().max());
        let (low, high) = (low.copied().unwrap_or(0), high.copied().unwrap_or(0));
        low > 0 && f64::from(high - low) * self.unit_mm <= max_jump_mm
    }
}

/// A mesh in the making and which pixels are in it already.
struct Sheet<'a> {
    view: &'a DepthView,
    index: Vec<u32>,
    mesh: Mesh,
}

impl Sheet<'_> {
    fn add(&mut self, triangle: [Pixel; 3]) {
        let corners = triangle.map(|pixel| self.vertex(pixel));
        self.mesh.triangles.push(corners);
    }

    fn vertex(&mut self, (u, v): Pixel) -> u32 {
        let slot = &mut self.index[v * self.view.width + u];
        if *slot == u32::MAX {
            *slot = self.mesh.points.len() as u32;
            self.mesh.points.extend(self.view.point(u, v));
        }
        *slot
    }
}

#[cfg(test)]
mod tests {
    use crate::depth_view::tests::view;

    #[test]
    fn measured_neighbours_are_joined_and_face_the_camera() {
        let mesh = view().mesh(0.5);
        assert_eq!((mesh.points.len(), mesh.triangles.len()), (5, 3));
        for t in 0..3 {
            let [a, b, c] = mesh.corners(t);
            assert!((b - a).cross(&(c - a)).z < 0.0);
        }
    }

    #[test]
    fn triangles_face_the_camera_of_a_mirroring_pose_too() {
        let mut mirrored = view();
        mirrored.camera_to_scan[(2, 2)] = -1.0;
        let [a, b, c] = mirrored.mesh(1.0).corners(0);
        assert!((b - a).cross(&(c - a)).z > 0.0);
    }

    #[test]
    fn nothing_is_joined_across_a_jump() {
        let mesh = view().mesh(0.4);
        assert_eq!((mesh.points.len(), mesh.triangles.len()), (4, 2));
    }

    #[test]
    fn four_pixels_are_cut_along_the_smaller_step() {
        let mut view = view();
        view.depth = vec![9, 4, 0, 4, 9, 0];
        assert_eq!(view.mesh(1.0).triangles.len(), 0, "both triangles would span the jump");
        view.depth = vec![9, 9, 0, 9, 1, 0];
        assert_eq!(view.mesh(1.0).triangles.len(), 1);
    }
}
