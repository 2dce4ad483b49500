//! The scan for closest point queries.

use super::Error;
use crate::distance::Surface;
use crate::mesh::Mesh;
use crate::points::{OrientedPoints, thin};
use lacuna::Model;

/// A scan as a surface.
pub struct Measured {
    /// Its triangles.
    pub surface: Surface,
    /// How far sideways a triangle that stands for a point may be met; none where they are the scan's own.
    pub sideways: Option<f64>,
}

/// Edge of a cloud's cubes where its points are close together, and where they are far apart, voxels.
const SURFEL: [f64; 2] = [0.3, 1.0];
/// Cubes are large enough when at most this share of the points is left.
const LEFT: f64 = 0.7;

/// A mesh as it is; a cloud as one small triangle a point, about as large as points are apart.
///
/// # Errors
/// Triangles without area, or a cloud without oriented points.
pub fn scan_surface(scan: &Mesh, model: &Model<'_>) -> Result<Measured, Error> {
    if !scan.triangles.is_empty() {
        let surface = Surface::new(scan).ok_or(Error::NoSurface("the scan's triangles have no area"))?;
        return Ok(Measured { surface, sideways: None });
    }
    let [mut cell, widest] = SURFEL.map(|voxels| voxels * f64::from(model.header().spacing));
    let mut points = thin(scan, cell);
    while cell < widest && points.points.len() as f64 > LEFT * scan.points.len() as f64 {
        cell *= 1.25;
        points = thin(scan, cell);
    }
    let surface = Surface::new(&surfels(&points, cell));
    let surface = surface.ok_or(Error::NoSurface("the scan has no oriented points"))?;
    Ok(Measured { surface, sideways: Some(1.5 * cell) })
}

fn surfels(points: &OrientedPoints, size: f64) -> Mesh {
    let mut mesh = Mesh::default();
    for (point, normal) in points.points.iter().zip(&points.normals) {
        let first = mesh.points.len() as u32;
        let across = nalgebra::Vector3::ith(normal.iamin(), 1.0).cross(normal).normalize() * size;
        let along = normal.cross(&across);
        mesh.points.extend([
            point + across,
            point - across * 0.5 + along * 0.8,
            point - across * 0.5 - along * 0.8,
        ]);
        mesh.triangles.push([first, first + 1, first + 2]);
    }
    mesh
}
