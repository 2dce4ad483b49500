//! The last checks, common to all formats.

use super::error::{Fault, Problem};
use super::{Loaded, unknown};
use crate::mesh::{Mesh, Point, Vector};

/// Turns what a reader collected into a mesh that keeps the promises of this module.
///
/// Normals become unit vectors; if all are zero, or their number is not that of the points, they
/// are dropped. Triangles that name a vertex twice are dropped, they cover nothing; a mesh of nothing else is taken as a cloud,
/// with a note. Single vertices without finite coordinates, and pixels of clouds without a measurement, are left out with a note.
pub(super) fn finish(mut mesh: Mesh) -> Result<Loaded, Fault> {
    if mesh.points.is_empty() {
        return Err(Problem::NoVertices.in_whole());
    }
    check_indices(&mesh)?;
    let unmatched = unmatched_normals(&mut mesh);
    let not_finite = unknown::leave_out(&mut mesh)?;
    let of_vertices = unmatched.into_iter().chain(not_finite).chain(unknown::leave_out_origin(&mut mesh));
    let mut repairs: Vec<String> = of_vertices.collect();
    repairs.extend(without_empty_triangles(&mut mesh));
    mesh.normals = unit(mesh.normals);
    mesh.points.shrink_to_fit();
    mesh.triangles.shrink_to_fit();
    Ok(Loaded { mesh, repairs })
}

/// Leaves out triangles that name a vertex twice.
fn without_empty_triangles(mesh: &mut Mesh) -> Option<String> {
    let before = mesh.triangles.len();
    mesh.triangles.retain(|[a, b, c]| a != b && b != c && c != a);
    let text = format!("none of its {before} triangles has three vertices: taken as a cloud");
    (before > 0 && mesh.triangles.is_empty()).then_some(text)
}

/// Leaves out normals that cannot be told which vertices they belong to.
fn unmatched_normals(mesh: &mut Mesh) -> Option<String> {
    let (normals, points) = (mesh.normals.len(), mesh.points.len());
    if normals == points {
        return None;
    }
    mesh.normals.clear();
    (normals > 0).then(|| format!("{normals} normals for {points} vertices were left out"))
}

/// Whether all coordinates are finite.
pub(super) fn is_finite(point: &Point) -> bool {
    // The sum of zeros is a NaN if one coordinate is infinite or NaN: no branch per coordinate.
    (point.x * 0.0 + point.y * 0.0 + point.z * 0.0) == 0.0
}

/// The number of the next vertex, as triangles name it.
pub(super) fn next_index(points: &[Point]) -> Result<u32, Problem> {
    u32::try_from(points.len()).map_err(|_| Problem::TooMany)
}

fn check_indices(mesh: &Mesh) -> Result<(), Fault> {
    let vertices = mesh.points.len();
    let largest = mesh.triangles.iter().flatten().max().copied().unwrap_or(0);
    if largest as usize >= vertices {
        return Err(Problem::Index { index: i64::from(largest), vertices }.in_whole());
    }
    Ok(())
}

/// Normals of unit length, zero where there is none; empty if there is none at all.
fn unit(mut normals: Vec<Vector>) -> Vec<Vector> {
    let mut any = false;
    for normal in &mut normals {
        // A scale first, or the square of a tiny or huge component leaves the range of f64.
        let scaled = *normal / normal.amax();
        *normal = scaled.try_normalize(0.0).filter(|n| n.x.is_finite()).unwrap_or_else(Vector::zeros);
        any |= normal.x != 0.0 || normal.y != 0.0 || normal.z != 0.0;
    }
    if any { normals } else { Vec::new() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mesh(normals: Vec<Vector>) -> Mesh {
        let points = vec![Point::origin(), Point::new(1.0, 0.0, 0.0), Point::new(0.0, 1.0, 0.0)];
        Mesh { points, normals, triangles: vec![[0, 1, 2], [0, 1, 1]] }
    }

    #[test]
    fn triangles_that_name_a_vertex_twice_are_dropped() {
        let loaded = finish(mesh(vec![])).unwrap();
        assert_eq!((loaded.mesh.triangles.as_slice(), loaded.repairs.len()), ([[0, 1, 2]].as_slice(), 0));
        let loaded = finish(Mesh { triangles: vec![[0, 0, 0]; 7], ..mesh(vec![]) }).unwrap();
        assert_eq!(loaded.repairs, ["none of its 7 triangles has three vertices: taken as a cloud"]);
    }

    #[test]
    fn normals_become_unit_vectors_even_if_tiny_or_huge() {
        let normals = vec![Vector::x() * 1e-300, Vector::y() * 1e300, Vector::new(0.0, 3.0, 4.0)];
        let unit = finish(mesh(normals)).unwrap().mesh.normals;
        assert_eq!(unit, [Vector::x(), Vector::y(), Vector::new(0.0, 0.6, 0.8)]);
    }

    #[test]
    fn normals_of_another_number_are_left_out_and_told() {
        let loaded = finish(mesh(vec![Vector::x(); 2])).unwrap();
        assert!(loaded.mesh.normals.is_empty());
        assert_eq!(loaded.repairs, ["2 normals for 3 vertices were left out"]);
        assert!(finish(mesh(vec![])).unwrap().repairs.is_empty());
    }

    #[test]
    fn single_unusable_normals_become_zero() {
        let normals = vec![Vector::zeros(), Vector::x() * f64::NAN, Vector::z() * 2.0];
        let unit = finish(mesh(normals)).unwrap().mesh.normals;
        assert_eq!(unit, [Vector::zeros(), Vector::zeros(), Vector::z()]);
    }

    #[test]
    fn normals_that_are_all_zero_are_absent() {
        assert!(finish(mesh(vec![Vector::zeros(); 3])).unwrap().mesh.normals.is_empty());
    }

    #[test]
    fn an_infinite_coordinate_names_its_vertex() {
        let mut bad = mesh(vec![]);
        bad.points[1].z = f64::NEG_INFINITY;
        assert_eq!(finish(bad).unwrap_err().problem, Problem::NotFinite { vertex: 1, count: 1 });
    }

    #[test]
    fn huge_finite_coordinates_are_finite() {
        assert!(is_finite(&Point::new(f64::MAX, -f64::MAX, f64::MIN_POSITIVE)));
    }
}
