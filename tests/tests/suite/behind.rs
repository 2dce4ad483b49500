//! What was measured deep behind the fitted surface is part of the completed one: the scanner has looked through there.

use lacuna::Fixed;
use lacuna_host::complete::{Options, complete};
use lacuna_host::distance::Surface;
use lacuna_host::mesh::{Mesh, Point, Vector};
use lacuna_host::synth::{Head, Kind, ScannerSettings, scan};
use lacuna_tests::model;

/// A head with a dent in its face as no head of the class has, and where that is deep.
fn dented(depth: f64) -> (Mesh, Vec<bool>) {
    let mut head = Head::sample(1, 1003).mesh();
    let (low, high) = head.bounds().expect("a head");
    let middle = Point::new(0.0, low.y + 0.3 * (high.y - low.y), high.z);
    let across = |p: &Point| ((p.x - middle.x).hypot(p.y - middle.y) / 30.0).min(1.0);
    let front = |p: &Point| p.z > low.z + 0.5 * (high.z - low.z);
    let deep = head.points.iter().map(|p| front(p) && across(p) < 0.5).collect();
    for p in head.points.iter_mut().filter(|p| front(p)) {
        let share = 1.0 - across(p).powi(2);
        *p += Vector::z() * (-depth * share * share);
    }
    (head, deep)
}

#[test]
fn a_dent_that_no_shape_of_the_class_has_is_kept_as_it_was_measured() {
    let model = model();
    let (head, deep) = dented(25.0);
    let made = scan(&head, Kind::Front, &ScannerSettings::default(), 4);
    let found = complete::<Fixed>(&model, &made.mesh, &Options::of(&model)).expect("a completion");
    let surface = Surface::new(&found.merged.mesh).expect("a surface");
    let seen = head
        .points
        .iter()
        .zip(deep.iter().zip(&made.missing))
        .filter(|(_, (deep, missing))| **deep && !**missing);
    let off: Vec<f64> = seen
        .map(|(p, _)| {
            let at = Point::from_homogeneous(made.model_to_scan * p.to_homogeneous()).expect("an affine map");
            surface.distance(&at, 100.0).map_or(100.0, |found| found.value.abs())
        })
        .collect();
    let rms = (off.iter().map(|d| d * d).sum::<f64>() / off.len() as f64).sqrt();
    // 4.6 mm and 2.6 % without what is drawn to the scan.
    assert!(
        off.len() > 100 && rms < 1.0 && found.clutter.area_share < 0.005,
        "{rms} {}",
        found.clutter.area_share
    );
}
