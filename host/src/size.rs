//! Sizes of meshes, and in which unit they would fit.

use crate::mesh::Mesh;
use crate::picks::evenly;
use crate::quantile::median;
use crate::unit;
use lacuna::format::Unit;
use std::ops::RangeInclusive;

/// Largest factor between scan and model that is searched.
pub const LIMIT: f64 = 6.0;
/// Within this factor a size would fit.
const FITTING: f64 = 2.5;

/// Triangles that are asked how long they are.
const ASKED: usize = 1000;

/// Median of the longest sides of some triangles, evenly chosen; 0 without any.
pub fn usual_side(mesh: &Mesh) -> f64 {
    let longest = |t: usize| {
        let [_, _, longest] = mesh.sides_of(t);
        longest
    };
    median(evenly(mesh.triangles.len(), ASKED).map(longest).collect()).unwrap_or(0.0)
}

/// Share of the points that may lie anywhere, at either end of each axis: a speck some metres away is left out later.
const STRAY: f64 = 0.002;
/// The same of a mesh that is too long otherwise: between a shape and what stands behind it a scanner sees points in the
/// air.
const MANY_STRAY: f64 = 0.025;

/// Longest side of a mesh, stray points aside.
pub fn of_mesh(mesh: &Mesh) -> f64 {
    longest(&usual_bounds(mesh))
}

/// Longest side of what holds most points of a mesh, even if many are stray.
pub fn of_most(mesh: &Mesh) -> f64 {
    longest(&bounds_but(mesh, MANY_STRAY))
}

/// Longest side of a box.
pub fn longest(bounds: &[[f64; 2]; 3]) -> f64 {
    bounds.iter().map(|[low, high]| high - low).fold(0.0, f64::max)
}

/// Lowest and highest coordinate along each axis, stray points aside.
pub fn usual_bounds(mesh: &Mesh) -> [[f64; 2]; 3] {
    bounds_but(mesh, STRAY)
}

/// Lowest and highest coordinate along each axis of all points but a share at either end.
fn bounds_but(mesh: &Mesh, stray: f64) -> [[f64; 2]; 3] {
    let stray = (stray * mesh.points.len() as f64) as usize;
    [0, 1, 2].map(|axis| {
        let mut along: Vec<f64> = mesh.points.iter().map(|p| p[axis]).collect();
        along.sort_unstable_by(f64::total_cmp);
        along.len().checked_sub(stray + 1).map_or([0.0; 2], |last| [along[stray], along[last]])
    })
}

/// What to do about a size that does not fit, of a scan taken to be in the unit `own`; none if it does.
pub fn misfit(scan: f64, model: f64, own: Unit) -> Option<String> {
    let ratio = scan / model;
    if ratio < LIMIT && ratio > 1.0 / LIMIT {
        return None;
    }
    let class = "Is it a scan of this class?";
    let larger =
        if ratio > 1.0 { " If a floor, a wall or stray points are in it, cut them away" } else { "" };
    Some(unit_of(ratio, own).unwrap_or_else(|| format!("{class}{larger}")))
}

/// Units that a mesh may be in, and their names.
const KNOWN: [(Unit, &str); 4] = [
    (Unit::Millimetre, "millimetres"),
    (Unit::Metre, "metres"),
    (Unit::Inch, "inches"),
    (Unit::Micrometre, "micrometres"),
];

/// The unit in which a mesh that is `ratio` times too long, taken as `own`, would come nearest to the right size.
pub fn unit_of(ratio: f64, own: Unit) -> Option<String> {
    const CENTIMETRE: f64 = 10.0;
    let known = KNOWN.into_iter().map(|(unit, name)| (Some(unit), name)).chain([(None, "centimetres")]);
    let off = |unit: Option<Unit>| {
        let millimetres = unit.map_or(CENTIMETRE, unit::millimetres);
        libm::log(ratio * millimetres / unit::millimetres(own)).abs()
    };
    let others = known.filter(|&(unit, _)| unit != Some(own));
    let (unit, name) = others.min_by(|a, b| off(a.0).total_cmp(&off(b.0)))?;
    let fits = format!("Its size would fit if it were in {name}:");
    (off(unit) < libm::log(FITTING)).then(|| match unit {
        Some(unit) => format!("{fits} give --unit {}, or convert it", unit::symbol(unit)),
        None => format!("{fits} convert it to millimetres"),
    })
}

/// Longest sides of what is scanned by hand, millimetres: of an ear, of a person.
const USUAL: RangeInclusive<f64> = 15.0..=3000.0;

/// What to do about shapes of a length that is not of anything scanned by hand, if they might be in another unit.
pub fn unusual(length: f64, unit: Unit) -> Option<String> {
    let usual = |&other: &Unit| USUAL.contains(&(length * unit::millimetres(other)));
    if usual(&unit) {
        return None;
    }
    let option = |unit: Unit| format!("--unit {}", unit::symbol(unit));
    let others: Vec<String> = KNOWN.map(|(unit, _)| unit).into_iter().filter(usual).map(option).collect();
    let (own, others) = (unit::symbol(unit), others.join(" or "));
    (!others.is_empty())
        .then(|| format!("it is {length:.4} {own} long; if that is not its unit, give {others}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Point;

    #[test]
    fn a_face_in_metres_is_offered_its_unit_and_one_in_millimetres_is_not() {
        assert_eq!(unusual(230.0, Unit::Millimetre), None);
        assert_eq!(unusual(0.23, Unit::Metre), None);
        let text = unusual(0.23, Unit::Millimetre).expect("a note");
        assert_eq!(text, "it is 0.2300 mm long; if that is not its unit, give --unit m");
        assert!(unusual(2.4, Unit::Millimetre).is_some_and(|text| text.ends_with("--unit m or --unit in")));
        assert!(unusual(2.3e5, Unit::Millimetre).is_some_and(|text| text.ends_with("--unit um")));
        assert_eq!(unusual(1e-9, Unit::Millimetre), None, "no unit helps");
    }

    #[test]
    fn a_few_stray_points_do_not_make_a_scan_longer() {
        let mut scan = Mesh {
            points: (0..1000).map(|i| Point::new(0.0, f64::from(i), 0.0)).collect(),
            ..Mesh::default()
        };
        assert_eq!(of_mesh(&scan), 995.0, "two at either end may be stray");
        scan.points[500] = Point::new(-9e9, 500.0, 9e9);
        assert_eq!(of_mesh(&scan), 995.0);
        scan.points.iter_mut().take(24).for_each(|p| p.x = 9e9);
        assert_eq!((of_mesh(&scan), of_most(&scan)), (9e9, 949.0));
        scan.points.truncate(3);
        assert_eq!((of_mesh(&scan), of_most(&scan)), (2.0, 2.0), "of few points none is stray");
        assert_eq!(of_mesh(&Mesh::default()), 0.0);
    }

    #[test]
    fn the_unit_is_recognised_and_not_guessed() {
        assert_eq!(misfit(200.0, 230.0, Unit::Millimetre), None);
        for (length, unit) in
            [(0.2, "--unit m"), (8.0, "--unit in"), (2e5, "--unit um"), (20.0, "centimetres")]
        {
            let hint = misfit(length, 230.0, Unit::Millimetre).unwrap();
            assert!(hint.contains(unit), "{length}: {hint}");
        }
        assert!(misfit(230.0, 0.23, Unit::Metre).unwrap().contains("--unit mm"));
        let floor = misfit(1586.0, 230.0, Unit::Millimetre).unwrap();
        assert!(floor.contains("of this class? If a floor"), "{floor}");
    }
}
