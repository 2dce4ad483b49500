//! A depth image as a triangulated sheet, the way a scanner's own software would join it: always along the same
//! diagonal. Images that are read are cut along the smaller step ([`DepthView::mesh`]); these stay as they are, for
//! another cut would change the bits of every simulated scan.

use crate::depth_view::DepthView;
use crate::mesh::{Mesh, Point, Vector};

/// The measured pixels of a view and the triangles between neighbours, in the scan frame. No edge
/// spans a jump of more than `jump_mm` in depth; pixels without any triangle stay, without a normal.
pub(super) fn sheet(view: &DepthView, jump_mm: f64) -> Mesh {
    let mut vertex = vec![u32::MAX; view.depth.len()];
    let mut mesh = Mesh::default();
    for (i, slot) in vertex.iter_mut().enumerate() {
        if let Some(point) = view.point(i % view.width, i / view.width) {
            *slot = mesh.points.len() as u32;
            mesh.points.push(point);
        }
    }
    for row in 1..view.height {
        for column in 1..view.width {
            let corner = |back: usize, up: usize| (row - up) * view.width + column - back;
            let quad = [corner(1, 1), corner(1, 0), corner(0, 0), corner(0, 1)];
            let whole = halves(quad).into_iter().filter(|half| joined(view, half, jump_mm));
            mesh.triangles.extend(whole.map(|half| half.map(|i| vertex[i])));
        }
    }
    mesh
}

/// The triangles of a quad, seen from the camera counter-clockwise.
fn halves([a, b, c, d]: [usize; 4]) -> [[usize; 3]; 2] {
    [[a, b, c], [a, c, d]]
}

fn joined(view: &DepthView, corners: &[usize; 3], jump_mm: f64) -> bool {
    let depths = corners.map(|i| view.depth[i]);
    let (low, high) = (depths.iter().min(), depths.iter().max());
    low > Some(&0) && high.zip(low).is_some_and(|(h, l)| f64::from(h - l) * view.unit_mm <= jump_mm)
}

/// Vertices that have a normal, as a point cloud.
pub(super) fn cloud(sheet: &Mesh) -> Mesh {
    let normals = sheet.vertex_normals();
    let known: Vec<(Point, Vector)> =
        sheet.points.iter().copied().zip(normals).filter(|(_, n)| *n != Vector::zeros()).collect();
    let (points, normals) = known.into_iter().unzip();
    Mesh { points, normals, triangles: vec![] }
}
