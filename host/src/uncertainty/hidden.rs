//! What a scan that was stitched from several views is off without showing it.
//!
//! Views are put beside each other with an error of their own, which neighbouring points share: a fit follows it. The scan
//! then lies as near to the fitted surface as one view does, and nothing in it tells of the error but that there were
//! several views. The amount is not learned: it is that of the [simulated scanner](crate::synth::ScannerSettings), of
//! which training makes its scans, by shifts and turns together. Views that were aligned worse lie apart where they
//! [overlap](crate::complete::layers): two that err alike, each by σ, by √2 σ.

use crate::mesh::Vector;
use crate::unit::digits;
use std::f64::consts::FRAC_1_SQRT_2;

/// One sigma of what views are off beside each other, class millimetres.
const STITCHING: f32 = 0.11;
/// Share of the points of one view that may face away from it: noise at its rim, specks.
const AWAY: f64 = 0.02;
/// Rounds of the search.
const ROUNDS: usize = 30;

/// What a scan with these normals is off without showing it, whose views lie so far apart where they overlap; both in class
/// millimetres.
pub fn error(normals: &[Vector], layers: Option<f64>) -> f32 {
    let stitching = if stitched(normals) { STITCHING } else { 0.0 };
    stitching.max((layers.unwrap_or(0.0) * FRAC_1_SQRT_2) as f32)
}

/// What is said of that error behind the expected ones, of which it is a part; nothing of none.
pub fn told(error: f32, unit: &str) -> String {
    let digits = digits(error.into(), 2);
    if error > 0.0 {
        format!("; {digits} {unit} of it for what the scan does not show")
    } else {
        String::new()
    }
}

/// Whether normals are those of several views. One view shows what faces it: there is a direction that its normals have an
/// angle of less than 90 degrees with. It is searched from their mean, towards those that face away.
fn stitched(normals: &[Vector]) -> bool {
    let mut pole: Vector = normals.iter().sum();
    for _ in 0..ROUNDS {
        let away = normals.iter().filter(|normal| normal.dot(&pole) <= 0.0);
        let (sum, count) =
            away.fold((Vector::zeros(), 0.0), |(sum, count), normal| (sum + normal, count + 1.0));
        if count <= AWAY * normals.len() as f64 {
            return false;
        }
        pole += sum;
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synth::{Head, Kind, ScannerSettings, scan};

    #[test]
    fn three_views_are_told_from_one() {
        let head = Head::sample(1, 5).mesh();
        for (kind, several) in [(Kind::Front, false), (Kind::Side, false), (Kind::Stitched, true)] {
            let made = scan(&head, kind, &ScannerSettings::small(), 2);
            let normals = &made.points.normals;
            assert_eq!(stitched(normals), several, "{kind:?}");
            let least = if several { STITCHING } else { 0.0 };
            assert_eq!(
                [None, Some(0.1)].map(|layers| error(normals, layers)),
                [least, least.max(0.070_710_68)]
            );
            assert_eq!(error(normals, Some(2.0)), std::f32::consts::SQRT_2);
        }
    }

    #[test]
    fn one_view_may_show_much_of_one_side_and_little_of_the_other() {
        let towards =
            |degrees: f64| Vector::new(libm::sin(degrees.to_radians()), 0.0, libm::cos(degrees.to_radians()));
        let sides = |left: f64, right: f64| -> Vec<Vector> {
            (0..100).map(|i| towards(if i < 95 { left } else { right })).collect()
        };
        assert!(!stitched(&sides(-70.0, 70.0)), "140 degrees apart");
        let round: Vec<Vector> = (0..36).map(|i| towards(10.0 * f64::from(i))).collect();
        assert!(stitched(&round));
        let cube: Vec<Vector> = (0..3).flat_map(|i| [1.0, -1.0].map(|s| Vector::ith(i, s))).collect();
        assert!(stitched(&cube), "their mean says nothing");
        assert!(!stitched(&[]));
    }
}
