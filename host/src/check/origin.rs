//! Coordinates so far from the origin that their digits are used up.

use super::Checked;
use crate::mesh::Point;

/// Steps between neighbouring coordinates, share of the extent: told from the first on, refused from the second.
const COARSE: [f64; 2] = [2e-5, 2e-3];

/// Judges the steps in which coordinates can be written at their distance from the origin, in single precision
/// if all of them are single precision numbers, as most files have it.
pub(super) fn check(checked: &mut Checked) {
    let Some((low, high)) = checked.mesh.bounds() else { return };
    let extent = (high - low).max();
    let farthest = low.coords.abs().sup(&high.coords.abs()).max();
    if !extent.is_finite() || farthest > 1e30 {
        let text = format!("coordinates reach {farthest:e}: that is no object; export it again");
        return checked.refused(text);
    }
    if checked.mesh.points.len() == 1 {
        return checked.refused("it is a single vertex; export the scan itself".into());
    }
    if extent == 0.0 {
        return checked.refused("all vertices are in one place; export it again".into());
    }
    let step = if single(&checked.mesh.points) { single_step(farthest) } else { farthest * f64::EPSILON };
    let share = step / extent;
    let told = || {
        format!(
            "the coordinates lie {farthest:.0} from the origin and have steps of {step:.2e} at an extent of \
             {extent:.4}: move the object to the origin before it is exported"
        )
    };
    if share > COARSE[1] {
        checked.refused(told());
    } else if share > COARSE[0] {
        checked.note(told());
    }
}

fn single(points: &[Point]) -> bool {
    points.iter().all(|p| p.iter().all(|&c| f64::from(c as f32) == c))
}

/// Distance of single precision numbers near `value`.
fn single_step(value: f64) -> f64 {
    let single = value as f32;
    f64::from(single.next_up()) - f64::from(single)
}
