//! Needles: the few long, thin triangles around a vertex that flew away. They would count for the size of the mesh, and be
//! sampled all the way.

use super::{Checked, counted};
use crate::mesh::Mesh;
use crate::size::usual_side;

/// A needle is so many times as long as triangles of its mesh usually are, and as its own shortest side.
const LONG: f64 = 30.0;
/// Where more than this share of the triangles are needles, that is how the mesh was made.
const MOST: f64 = 0.01;

/// Takes the needles out.
pub(super) fn check(checked: &mut Checked) {
    let needles = needles(&checked.mesh);
    let count = needles.iter().filter(|&&needle| needle).count();
    if count == 0 || count as f64 > MOST * needles.len() as f64 {
        return;
    }
    let mut kept = needles.iter().map(|needle| !needle);
    checked.mesh.triangles.retain(|_| kept.next() == Some(true));
    let what = counted(count, "long, thin triangle that leads", "long, thin triangles that lead");
    checked.repaired(format!("{what} to vertices far from their neighbours left out"));
}

/// Whether each triangle is one.
fn needles(mesh: &Mesh) -> Vec<bool> {
    let usual = usual_side(mesh);
    let needle = |t: usize| {
        let [shortest, _, longest] = mesh.sides_of(t);
        longest > LONG * usual && longest > LONG * shortest
    };
    (0..mesh.triangles.len()).map(needle).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Point;
    use crate::surface::shapes::sheet;

    fn checked(mesh: Mesh) -> Checked {
        let mut checked = Checked { mesh, findings: vec![] };
        check(&mut checked);
        checked
    }

    #[test]
    fn a_vertex_that_flew_away_takes_its_triangles_along_and_no_other() {
        let mut mesh = sheet(30);
        mesh.points[30 * 15 + 15].z = 3e4;
        let found = checked(mesh.clone());
        assert_eq!(found.mesh.triangles.len(), mesh.triangles.len() - 6);
        assert!(found.findings[0].text.starts_with("6 long, thin triangles"), "{:?}", found.findings);
        // Two beside each other, at one place.
        mesh.points[30 * 15 + 16] = mesh.points[30 * 15 + 15];
        assert_eq!(checked(mesh.clone()).mesh.triangles.len(), mesh.triangles.len() - 10);
    }

    #[test]
    fn large_triangles_and_meshes_of_slivers_stay() {
        let mut mesh = sheet(30);
        mesh.append(&Mesh {
            points: [[0.0, 0.0, -9.0], [900.0, 0.0, -9.0], [900.0, 900.0, -9.0]].map(Point::from).into(),
            ..Mesh { triangles: vec![[0, 1, 2]], ..Mesh::default() }
        });
        let mut slivers = sheet(30);
        slivers.points.iter_mut().for_each(|p| p.x *= 100.0);
        for mesh in [mesh, slivers] {
            let found = checked(mesh.clone());
            assert!(found.mesh == mesh && found.findings.is_empty(), "{:?}", found.findings);
        }
    }
}
