//! Was the scan filled by other software? A scanner leaves holes; a closed surface has none, and what was invented to close it
//! cannot be told from what was measured.

use super::{Checked, winding};

/// Notes that a mesh is closed.
pub(super) fn check(checked: &mut Checked) {
    if winding::encloses(&checked.mesh) {
        checked.note(
            "the scan has no holes: if software closed them, what it invented counts as measured; export the scan without that \
             (of a Poisson reconstruction cut off what few points support)"
                .into(),
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::shapes::ball;

    #[test]
    fn a_closed_scan_is_told_and_one_with_a_hole_is_not() {
        let told = |open: usize| {
            let mut mesh = ball(12, 4.0);
            mesh.triangles.truncate(mesh.triangles.len() - open);
            let mut checked = Checked { mesh, findings: vec![] };
            check(&mut checked);
            checked.findings.len()
        };
        assert_eq!([0, 1].map(told), [1, 0]);
    }
}
