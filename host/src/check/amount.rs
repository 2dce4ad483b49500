//! Is there enough surface to fit a model to?

use super::Checked;
use crate::class::SIDE;
use crate::register::FEWEST_POINTS;
use lacuna::Model;

/// Least share of the class's surface: less does not determine a pose.
const LEAST: f64 = 0.03;
/// Width of the square a lone point stands for, voxels: clouds of 60 to 500 points on a face came out measured on as much.
const COVERED: f64 = 2.0;
/// A cloud that cannot cover this share of the class's surface is worth a note.
const SPARSE: f64 = 0.14;

/// Refuses a scan with too little surface for the model, or too few points.
pub(super) fn check(checked: &mut Checked, model: &Model<'_>) {
    let header = model.header();
    let spacing = f64::from(header.spacing);
    let surface = (SIDE * f64::from(header.scales.millimetre) * spacing).powi(2);
    let mesh = &checked.mesh;
    if mesh.triangles.is_empty() {
        let count = mesh.points.len();
        let most = count as f64 * (COVERED * spacing).powi(2) / surface;
        if count < FEWEST_POINTS {
            checked.refused(format!(
                "the scan has {count} points, at least {FEWEST_POINTS} are needed: export it in full"
            ));
        } else if most < SPARSE {
            checked.note(format!(
                "{count} points measure at most {:.0} % of the surface of a shape of the class, the rest will be \
                 inferred: export more points",
                100.0 * most
            ));
        }
        return;
    }
    let share = mesh.area() / surface;
    if share < LEAST {
        let text = format!(
            "the scan shows {:.1} % of the surface of a shape of the class, at least {:.0} % are needed: scan more \
             of it",
            100.0 * share,
            100.0 * LEAST
        );
        checked.refused(text);
    } else if mesh.triangles.len() < FEWEST_POINTS {
        let text = format!(
            "the scan has only {}: that is no measured surface; export it in full",
            super::counted(mesh.triangles.len(), "triangle", "triangles")
        );
        checked.refused(text);
    }
}
