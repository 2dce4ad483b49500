//! Is there enough surface to fit a model to?

use super::Checked;
use crate::train::SIDE;
use lacuna::Model;

/// Least share of the class's surface: less does not determine a pose.
const LEAST: f64 = 0.03;
/// Fewest points of a cloud.
const FEWEST: usize = 60;

/// Refuses a scan with too little surface for the model, or too few points.
pub(super) fn check(checked: &mut Checked, model: &Model<'_>) {
    let mesh = &checked.mesh;
    if mesh.triangles.is_empty() {
        if mesh.points.len() < FEWEST {
            let text = format!(
                "the scan has {} points, at least {FEWEST} are needed: export it in full",
                mesh.points.len()
            );
            checked.refused(text);
        }
        return;
    }
    let header = model.header();
    let millimetre = f64::from(header.scales.millimetre) * f64::from(header.spacing);
    let share = mesh.area() / (SIDE * millimetre).powi(2);
    if share < LEAST {
        let text = format!(
            "the scan shows {:.1} % of the surface of a shape of the class, at least {:.0} % are needed: scan more \
             of it",
            100.0 * share,
            100.0 * LEAST
        );
        checked.refused(text);
    } else if mesh.triangles.len() < FEWEST {
        let text = format!(
            "the scan has only {}: that is no measured surface; export it in full",
            super::counted(mesh.triangles.len(), "triangle", "triangles")
        );
        checked.refused(text);
    }
}
