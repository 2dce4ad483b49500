//! Points of a cloud so far from all others that they are of no object.

use super::{Checked, counted};
use crate::mesh::Point;
use crate::size::{longest, usual_bounds};
use crate::surface::keep;

/// A stray is so many lengths of the cloud away from it.
const FAR: f64 = 10.0;

/// Takes them out: few, or they would count for the length.
pub(super) fn check(checked: &mut Checked) {
    let mesh = &checked.mesh;
    let bounds = usual_bounds(mesh);
    let length = longest(&bounds);
    let reach = FAR * length;
    let near = |p: &Point| {
        bounds.iter().zip(p.iter()).all(|([low, high], c)| (low - reach..=high + reach).contains(c))
    };
    let kept = keep(mesh, |i| near(&mesh.points[i]));
    let strays = mesh.points.len() - kept.points.len();
    if strays == 0 || length == 0.0 {
        return;
    }
    checked.mesh = kept;
    let what = counted(strays, "point", "points");
    checked.repaired(format!("{what} more than {FAR} lengths of the cloud away from it left out"));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Mesh, Vector};

    #[test]
    fn a_point_far_away_is_left_out_and_a_second_object_is_not() {
        let points: Vec<Point> =
            (0..1000).map(|i| Point::new(f64::from(i % 40), f64::from(i / 40), 0.0)).collect();
        let normals = (0..1001).map(|i| Vector::new(f64::from(i), 0.0, 0.0)).collect();
        let with = |x: f64| {
            let mut mesh = Mesh { points: points.clone(), normals: Vec::clone(&normals), triangles: vec![] };
            mesh.points.insert(7, Point::new(x, 0.0, 0.0));
            let mut checked = Checked { mesh, findings: vec![] };
            check(&mut checked);
            checked
        };
        let far = with(1e12);
        assert_eq!((far.mesh.points.len(), far.mesh.normals.len(), far.findings.len()), (1000, 1000, 1));
        assert!(far.mesh.normals.iter().all(|n| n.x != 7.0));
        assert!(with(-200.0).findings.is_empty());
    }
}
