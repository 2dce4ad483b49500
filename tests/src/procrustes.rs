//! Shapes whose vertices correspond, brought together.

use lacuna_host::mesh::{Mesh, Point, Vector};
use lacuna_host::register::umeyama::similarity;
use nalgebra::Similarity3;

/// Generalised Procrustes analysis of shapes whose vertices correspond: from each shape to their common frame, and their
/// mean there.
///
/// # Panics
/// Without shapes, or with fewer than eight vertices.
pub fn procrustes(shapes: &[Mesh]) -> (Vec<Similarity3<f64>>, Vec<Point>) {
    let mut motions = vec![Similarity3::identity(); shapes.len()];
    let mut mean = Vec::new();
    for _ in 0..50 {
        mean = (0..shapes[0].points.len()).map(|v| mean_of(shapes, &motions, v)).collect();
        motions = shapes.iter().map(|shape| corresponding(&shape.points, &mean)).collect();
    }
    (motions, mean)
}

fn mean_of(shapes: &[Mesh], motions: &[Similarity3<f64>], vertex: usize) -> Point {
    let moved = shapes.iter().zip(motions).map(|(shape, motion)| (motion * shape.points[vertex]).coords);
    Point::from(moved.sum::<Vector>() / shapes.len() as f64)
}

/// The similarity between points that correspond.
///
/// # Panics
/// Fewer than eight points.
pub fn corresponding(from: &[Point], to: &[Point]) -> Similarity3<f64> {
    let pairs: Vec<(Point, Point)> = from.iter().copied().zip(to.iter().copied()).collect();
    similarity(&pairs).expect("a similarity")
}
