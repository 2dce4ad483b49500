//! Normals of wrong sign, as what estimates them of points alone leaves them: each faces either way, or those of a part face
//! inwards.

use super::{Checked, counted};
use crate::normals::{agreeing, estimate, neighbours};

/// A neighbour that rises less than this out of a point's plane lies beside it; that on the other side of a sheet rises more.
const BESIDE: f64 = 0.3;
/// Share of a cloud's normals that face against those beside them, from which on nothing can be told of them: of random
/// signs it is a half, of eleven scans of faces and femurs, ears among them, a ten-thousandth at most.
const RANDOM: f64 = 0.25;
/// Normals whose cosine is below minus this are opposed; those of a noisy scan are rather askew.
const OPPOSED: f64 = 0.7;
/// Share of opposed ones from which on, if no more are askew, some face inwards. They are at the border of a part that does: of
/// clouds that have the sign of the largest component or turned patches 0.03 with 8,000 points and 0.004 with 60,000 and more;
/// of eleven scans none.
const TURNED: f64 = 0.002;

/// Estimates the normals of a cloud of random signs anew, and turns those of a cloud of which some face inwards.
pub(super) fn check(checked: &mut Checked) {
    let mesh = &mut checked.mesh;
    if mesh.normals.is_empty() {
        return;
    }
    let pairs = neighbours(&mesh.points, &mesh.normals, 1);
    let beside: Vec<f64> = pairs.iter().filter(|pair| pair.rise < BESIDE).map(|pair| pair.cosine).collect();
    let share = |counts: &dyn Fn(f64) -> bool| {
        beside.iter().filter(|&&cosine| counts(cosine)).count() as f64 / beside.len().max(1) as f64
    };
    let against = share(&|cosine| cosine < 0.0);
    let [opposed, askew] = [share(&|cosine| cosine < -OPPOSED), share(&|cosine| cosine.abs() <= OPPOSED)];
    if against > RANDOM {
        mesh.normals = estimate(&mesh.points);
        checked.repaired(format!(
            "{:.0} % of the normals face against their neighbours': all were estimated anew",
            100.0 * against
        ));
    } else if opposed > TURNED.max(askew) {
        turn(checked);
    }
}

/// Turns normals so that those beside each other agree.
fn turn(checked: &mut Checked) {
    let mesh = &mut checked.mesh;
    let agreeing = agreeing(&mesh.points, &mesh.normals);
    let turned = agreeing.iter().zip(&mesh.normals).filter(|(now, before)| now != before).count();
    mesh.normals = agreeing;
    let what = counted(turned, "normal that faces", "normals that face");
    checked.repaired(format!("{what} the other way than those beside turned round"));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Mesh, Point, Vector};
    use crate::surface::shapes::ball;
    use crate::synth::Random;

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

    #[test]
    fn normals_of_a_part_that_face_inwards_are_turned_and_those_of_thin_sheets_and_noisy_scans_stay() {
        let mesh = ball(24, 9.0);
        let cloud = Mesh { normals: mesh.vertex_normals(), triangles: vec![], ..mesh };
        // As the largest component tells, half of the ball faces inwards; and with one of the axes the other way, two thirds do.
        for (most, inwards) in [(false, 0.4..0.6), (true, 0.61..0.72)] {
            let mut part = cloud.clone();
            let faces_inwards = |n: &Vector| n[n.iamax()] < 0.0 || (most && n.iamax() == 0);
            part.normals.iter_mut().filter(|n| faces_inwards(n)).for_each(|n| *n = -*n);
            let turned = part.normals.iter().zip(&cloud.normals).filter(|(a, b)| a != b).count();
            assert!(inwards.contains(&(turned as f64 / part.normals.len() as f64)), "{turned}");
            let mut checked = Checked { mesh: part, findings: vec![] };
            check(&mut checked);
            assert!(checked.mesh.normals == cloud.normals, "{:?}", checked.findings);
            assert!(checked.findings[0].text.ends_with("the other way than those beside turned round"));
        }
        let few: Vec<usize> = (0..cloud.points.len()).filter(|&i| cloud.normals[i].z > 0.95).collect();
        // The inside of something hollow: its form tells the wrong side, nearly all of its normals the right one.
        let mut hollow = cloud.clone();
        hollow.normals.iter_mut().for_each(|n| *n = -*n);
        let mut part = hollow.clone();
        few.iter().for_each(|&i| part.normals[i] = -part.normals[i]);
        let mut checked = Checked { mesh: part, findings: vec![] };
        check(&mut checked);
        assert!(checked.mesh.normals == hollow.normals, "{:?}", checked.findings);
        let top = (0..900).map(|i| Point::new(f64::from(i % 30), f64::from(i / 30), 0.4));
        let points: Vec<Point> = top.clone().chain(top.map(|p| Point::new(p.x, p.y, 0.0))).collect();
        let normals = (0..1800).map(|i| Vector::z() * if i < 900 { 1.0 } else { -1.0 }).collect();
        let sheet = Mesh { points, normals, triangles: vec![] };
        // Beside the sheet, of which nothing is turned, a ball of which a part is.
        let mut beside = cloud.clone();
        few.iter().for_each(|&i| beside.normals[i] = -beside.normals[i]);
        let far = |p: &Point| p - Vector::x() * 60.0;
        let thicker = sheet.points.iter().map(|p| Point::new(p.x, p.y, 4.0 * p.z));
        beside.points = beside.points.iter().map(far).chain(thicker).collect();
        beside.normals.extend(sheet.normals.iter());
        let mut checked = Checked { mesh: beside, findings: vec![] };
        check(&mut checked);
        assert!(
            checked.mesh.normals == [&cloud.normals[..], &sheet.normals].concat(),
            "{:?}",
            checked.findings
        );
        let mut noisy = cloud.clone();
        let mut random = Random::new(1, 1);
        noisy.normals.iter_mut().for_each(|n| *n = (*n + 0.8 * random.direction()).normalize());
        noisy.normals.iter_mut().step_by(50).for_each(|n| *n = -*n);
        let mut checked = Checked { mesh: noisy.clone(), findings: vec![] };
        check(&mut checked);
        assert!(checked.mesh == noisy && checked.findings.is_empty(), "{:?}", checked.findings);
        let mut checked = Checked { mesh: sheet.clone(), findings: vec![] };
        check(&mut checked);
        assert!(checked.mesh == sheet && checked.findings.is_empty(), "{:?}", checked.findings);
    }
}
