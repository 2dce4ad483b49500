//! Points of a cloud that are there twice: clouds that were put together with a part in common. They would make it seem denser
//! than it is.

use super::{Checked, counted};
use crate::io::Weld;
use crate::surface::keep;

/// Takes out points at the place of an earlier one that face its way. Those of the two sides of a sheet stay.
pub(super) fn check(checked: &mut Checked) {
    let mesh = &checked.mesh;
    let mut weld = Weld::for_triangles(mesh.points.len());
    let places: Result<Vec<u32>, _> = mesh.points.iter().map(|p| weld.add((*p).into())).collect();
    let Ok(places) = places else { return };
    let mut first = vec![usize::MAX; weld.points.len()];
    let is_copy = |i: usize| {
        let earlier = &mut first[places[i] as usize];
        *earlier = (*earlier).min(i);
        let one_way = |at: usize| mesh.normals.get(i).is_none_or(|n| n.dot(&mesh.normals[at]) >= 0.0);
        *earlier != i && one_way(*earlier)
    };
    let copies: Vec<bool> = (0..mesh.points.len()).map(is_copy).collect();
    let count = copies.iter().filter(|&&copy| copy).count();
    if count > 0 {
        checked.mesh = keep(mesh, |i| !copies[i]);
        let what = counted(count, "point that is", "points that are");
        checked.repaired(format!("{what} there twice left out"));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Mesh, Point, Vector};

    fn checked(normals: &[f64]) -> Checked {
        let points =
            [[1.0, 2.0, 0.0], [3.0, 4.0, 5.0], [1.0, 2.0, -0.0], [1.0, 2.0, 0.0]].map(Point::from).into();
        let normals = normals.iter().map(|&z| Vector::z() * z).collect();
        let mut checked = Checked { mesh: Mesh { points, normals, triangles: vec![] }, findings: vec![] };
        check(&mut checked);
        checked
    }

    #[test]
    fn points_at_one_place_count_once_and_both_sides_of_a_sheet_stay() {
        let without = checked(&[]);
        assert_eq!((without.mesh.points.len(), without.findings.len()), (2, 1));
        assert!(without.findings[0].text.starts_with("2 points that are there twice"));
        let sheet = checked(&[1.0, 1.0, -1.0, 1.0]);
        assert_eq!(sheet.mesh.normals, [Vector::z(), Vector::z(), -Vector::z()]);
        assert_eq!((sheet.mesh.points.len(), sheet.findings.len()), (3, 1));
        assert!(checked(&[1.0, 1.0, -1.0, -1.0]).findings.is_empty());
    }
}
