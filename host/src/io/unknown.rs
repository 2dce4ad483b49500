//! Vertices whose coordinates are not numbers, or several at 0 0 0 in a cloud: pixels without a measurement in clouds, damage
//! in meshes.

use super::error::{Fault, Problem};
use super::finish::is_finite;
use crate::mesh::{Mesh, Vector};

/// Largest share of a mesh's vertices that is left out; a mesh that lacks more is damaged. Organised clouds
/// have any number of pixels without a measurement.
const MOST: f64 = 0.1;

/// Takes vertices out whose coordinates are not finite, with the triangles at them; tells how many.
///
/// # Errors
/// [`Problem::NotFinite`], if too many are missing.
pub(super) fn leave_out(mesh: &mut Mesh) -> Result<Option<String>, Fault> {
    let Some(vertex) = mesh.points.iter().position(|p| !is_finite(p)) else { return Ok(None) };
    let known: Vec<bool> = mesh.points.iter().map(is_finite).collect();
    let missing = known.iter().filter(|known| !**known).count();
    let most = if mesh.triangles.is_empty() { 1.0 } else { MOST };
    let too_many = Problem::NotFinite { vertex, count: missing };
    if missing == known.len() || missing as f64 > most * known.len() as f64 {
        return Err(too_many.in_whole());
    }
    let had = !mesh.triangles.is_empty();
    mesh.triangles.retain(|corners| corners.iter().all(|&v| known[v as usize]));
    if had && mesh.triangles.is_empty() {
        return Err(too_many.in_whole());
    }
    let mut next = 0;
    let moved: Vec<u32> = known.iter().map(|&known| (next, next += u32::from(known)).0).collect();
    mesh.triangles.iter_mut().flatten().for_each(|v| *v = moved[*v as usize]);
    let mut kept = known.iter();
    mesh.points.retain(|_| kept.next() == Some(&true));
    let mut kept = known.iter();
    mesh.normals.retain(|_| kept.next().is_none_or(|&known| known));
    let what = if missing == 1 { "1 vertex" } else { &format!("{missing} vertices") };
    Ok(Some(format!("{what} without finite coordinates left out")))
}

/// Takes the points of a cloud out that are all at 0 0 0, as scanners write pixels without a measurement; tells how many. A
/// single one may be a point.
pub(super) fn leave_out_origin(mesh: &mut Mesh) -> Option<String> {
    let at_origin: Vec<bool> = mesh.points.iter().map(|p| p.coords == Vector::zeros()).collect();
    let count = at_origin.iter().filter(|&&at| at).count();
    if !mesh.triangles.is_empty() || count < 2 || count == at_origin.len() {
        return None;
    }
    let mut left_out = at_origin.iter();
    mesh.points.retain(|_| left_out.next() == Some(&false));
    let mut left_out = at_origin.iter();
    mesh.normals.retain(|_| left_out.next() == Some(&false));
    Some(format!("{count} points at 0 0 0 left out: pixels without a measurement"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Point;

    fn strip(count: u32) -> Mesh {
        Mesh {
            points: (0..count).map(|i| Point::new(f64::from(i), f64::from(i % 2), 0.0)).collect(),
            normals: (0..count).map(|i| Vector::new(f64::from(i), 0.0, 1.0)).collect(),
            triangles: (2..count).map(|i| [i - 2, i - 1, i]).collect(),
        }
    }

    #[test]
    fn a_few_vertices_and_their_triangles_are_left_out() {
        let mut mesh = strip(12);
        mesh.points[3].y = f64::NAN;
        assert_eq!(leave_out(&mut mesh), Ok(Some("1 vertex without finite coordinates left out".into())));
        assert_eq!((mesh.points.len(), mesh.normals.len(), mesh.triangles.len()), (11, 11, 7));
        assert_eq!((mesh.triangles[0], mesh.triangles[1]), ([0, 1, 2], [3, 4, 5]));
        assert_eq!((mesh.points[3].x, mesh.normals[3].x), (4.0, 4.0));
    }

    #[test]
    fn points_of_a_cloud_at_the_origin_are_left_out_unless_there_is_one_or_nothing_else() {
        let mut cloud = Mesh { triangles: vec![], ..strip(6) };
        assert_eq!(leave_out_origin(&mut cloud), None, "a single one");
        cloud.points[4] = Point::new(0.0, -0.0, 0.0);
        let note = leave_out_origin(&mut cloud);
        assert!(note.is_some_and(|note| note.starts_with("2 points at 0 0 0")));
        assert_eq!((cloud.points.len(), cloud.normals.len(), cloud.normals[3].x), (4, 4, 5.0));
        let mut heap = Mesh { points: vec![Point::origin(); 9], ..Mesh::default() };
        assert_eq!(leave_out_origin(&mut heap), None);
        let mut mesh = strip(6);
        mesh.points[4] = Point::origin();
        assert_eq!(leave_out_origin(&mut mesh), None, "meshes have triangles at them");
    }

    #[test]
    fn a_mesh_that_lacks_many_is_refused_and_a_cloud_is_not() {
        let mut mesh = strip(12);
        mesh.points[3].x = f64::INFINITY;
        mesh.points[4].x = f64::NAN;
        assert_eq!(leave_out(&mut mesh), Err(Problem::NotFinite { vertex: 3, count: 2 }.in_whole()));
        mesh.triangles.clear();
        mesh.normals.clear();
        assert!(leave_out(&mut mesh).is_ok_and(|note| note.is_some_and(|n| n.starts_with("2 vertices"))));
        mesh.points.iter_mut().for_each(|p| p.x = f64::NAN);
        assert!(leave_out(&mut mesh).is_err());
    }
}
