//! Normals of random sign, as what estimates them of points alone leaves them: each faces either way.

use super::Checked;
use crate::normals::{estimate, neighbours};

/// Share of a cloud's normals that face against their neighbours', from which on nothing can be told of them: of random
/// signs it is a half, of eleven scans of faces and femurs, ears among them, a ten-thousandth at most.
const RANDOM: f64 = 0.25;

/// Estimates the normals of such a cloud anew.
pub(super) fn check(checked: &mut Checked) {
    let mesh = &mut checked.mesh;
    if mesh.normals.is_empty() {
        return;
    }
    let pairs = neighbours(&mesh.points, &mesh.normals, 1);
    let against = pairs.iter().filter(|(_, cosine)| *cosine < 0.0).count();
    let share = against as f64 / pairs.len().max(1) as f64;
    if share > RANDOM {
        mesh.normals = estimate(&mesh.points);
        checked.repaired(format!(
            "{:.0} % of the normals face against their neighbours': all were estimated anew",
            100.0 * share
        ));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Mesh;
    use crate::surface::shapes::ball;

    #[test]
    fn normals_of_random_sign_are_estimated_anew_and_others_stay() {
        let mesh = ball(24, 9.0);
        let cloud = Mesh { normals: mesh.vertex_normals(), triangles: vec![], ..mesh };
        let mut good = Checked { mesh: cloud.clone(), findings: vec![] };
        check(&mut good);
        assert!(good.mesh == cloud && good.findings.is_empty(), "{:?}", good.findings);
        let mut random = cloud.clone();
        random.normals.iter_mut().enumerate().filter(|(i, _)| i * i % 7 > 2).for_each(|(_, n)| *n = -*n);
        let mut checked = Checked { mesh: random, findings: vec![] };
        check(&mut checked);
        assert_eq!(checked.findings.len(), 1);
        assert!(checked.mesh.normals.iter().zip(&cloud.normals).all(|(a, b)| a.dot(b) > 0.8));
    }
}
