//! Rigid alignment of the training shapes with scale, without correspondences (paper, section 3.1): a coarse
//! search against the first one, then all of them to their common mean. Where the first one is like few of them, they are
//! searched for on others.
//!
//! Shapes that are in one pose already skip the search. They are drawn to their mean all the same: as they lie, a part
//! of the modes would be spent on how they lie, which the pose of a scan says anyway (30 faces lay 1.1 degrees and 1.7 mm
//! about each axis and 4.9 % of size apart: three stitched scans were completed to 1.35 instead of 1.75 mm).

use super::generalised::towards_mean;
use super::jitter::{Apart, apart, keep_frame};
use super::mean_shape::Shape;
use super::realign::realign;
use super::strangers::{Stranger, in_one_pose, length, most, patterns, scatter, sides, strangers};
use crate::check::encloses;
use crate::check::inwards::outwardness;
use crate::mesh::{Mesh, Point};
use crate::points::OrientedPoints;
use crate::register::field::Field;
use crate::register::partners::Side;
use crate::register::search::{Candidate, Effort, Search};
use nalgebra::{Similarity3, Translation3, UnitQuaternion};
use rayon::prelude::*;
use std::cmp::Ordering;
use std::sync::atomic::{self, AtomicU64};

/// Whether the shapes are aligned before training.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Align {
    /// By a search if they are not in one pose already; then, or else, drawn to their mean.
    Auto,
    /// By a search, however they lie.
    Always,
    /// Not at all.
    Never,
}

/// Aligned shapes and how.
pub struct Aligned {
    /// The shapes in a common frame, about that of the first one unless that is like few of them.
    pub shapes: Vec<Mesh>,
    /// From each given shape to the common frame.
    pub motions: Vec<Similarity3<f64>>,
    /// How they were.
    pub way: Way,
    /// Those that do not lie where most do, although they are trained on together.
    pub strangers: Vec<Stranger>,
}

/// How shapes came into one pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Way {
    /// They were left as they lay.
    Left,
    /// They were in one already, and drawn to their mean: so far.
    Drawn(Option<Apart>),
    /// They were in one already, but being drawn to their mean ran away, so far; they were left as they lay.
    Kept(Apart),
    /// By a search.
    Searched,
}

impl Way {
    /// How far shapes in one frame lay from their common pose, if they were moved to it.
    pub const fn apart(self) -> Option<Apart> {
        match self {
            Self::Drawn(apart) => apart,
            Self::Kept(_) | Self::Left | Self::Searched => None,
        }
    }
}

/// Why shapes cannot be aligned.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A shape without area.
    #[error("training shape {} has no triangles with an area: a model is trained on meshes, not on points", .0 + 1)]
    NoSurface(usize),
    /// A shape that matches no pose.
    #[error(
        "training shape {} could not be aligned to the others (the best pose explains {:.0} % of it): is it of the \
         same class?",
        .number + 1,
        100.0 * .explained
    )]
    NoMatch {
        /// Which, counted from zero.
        number: usize,
        /// What the best pose explains of it ([`Candidate::quality`]), 0 to 1.
        explained: f64,
    },
    /// A first shape that most others match no pose of, or that matches no pose of most others.
    #[error(
        "training shape 1, to which the others are aligned, is not like them: {unlike} of {others} match no pose of it; \
         is it of the same class?"
    )]
    OddFirst {
        /// Shapes that match no pose.
        unlike: usize,
        /// All shapes but the first.
        others: usize,
    },
    /// A shape that matches inside out, counted from zero.
    #[error(
        "training shape {} could not be aligned: its triangles face the other way than those of the others; turn \
         them round",
        .0 + 1
    )]
    Turned(usize),
}

/// Turn about each axis, root mean square, radians (12 degrees), beyond which shapes that were in one pose are looked at again
/// after they were drawn to their mean. Faces, insoles and vertebrae are turned by 1.2 degrees, caps of skulls by 6.5. Femurs
/// that had been spun came together by 15; caps whose rims end at different places ran away by 35, and their mean closed.
const FAR: f32 = 0.21;
/// Effort of the coarse search: the best candidate alone is looked at further.
const EFFORT: Effort = Effort { draws: 1500, kept: 24, candidates: 1 };
/// Share of a shape's area that its pose must explain, at least.
const LEAST: f64 = 0.3;
/// Open meshes from which on triangles face outwards without doubt (see [`outwardness`]): faces are at 0.64 or more, whole and
/// nearly whole scans at 0.59, those of one view at 0.46 at most.
const OUTWARDS: f64 = 0.5;

/// Aligns shapes of one class: to about the frame of the first, or, if they are in one pose, in their own frame.
///
/// # Errors
/// A shape without area, unlike the others, or inside out.
pub fn align(
    shapes: &[Mesh],
    mode: Align,
    seed: u64,
    progress: &(dyn Fn(u64, u64) + Sync),
) -> Result<Aligned, Error> {
    let still = vec![Similarity3::identity(); shapes.len()];
    if mode == Align::Never || shapes.len() < 2 {
        let strangers = strangers(shapes)?;
        return Ok(Aligned { shapes: shapes.to_vec(), motions: still, way: Way::Left, strangers });
    }
    let sides = sides(shapes)?;
    let size = length(&shapes[0]);
    let together =
        mode == Align::Auto && sides[1..].par_iter().all(|side| in_one_pose(side, &sides[0], size));
    let prepared: Vec<Shape> = shapes.par_iter().zip(&sides).map(prepared).collect();
    if together {
        let mut motions = still;
        towards_mean(&prepared, &mut motions);
        keep_frame(shapes, &mut motions);
        return Ok(drawn_or_kept(shapes, &sides, motions));
    }
    by_search(shapes, &prepared, seed, progress)
}

/// Aligned by searches on the first shape, or, where it is like few, on others until one is like most.
fn by_search(
    shapes: &[Mesh],
    prepared: &[Shape],
    seed: u64,
    progress: &(dyn Fn(u64, u64) + Sync),
) -> Result<Aligned, Error> {
    let (mut failed, mut best): (Vec<Searched>, Option<Aligned>) = (Vec::new(), None);
    for pattern in patterns(shapes.len()) {
        let searched = searched(shapes, prepared, pattern, seed, progress);
        let Some(mut motions) = searched.motions() else {
            if let Some(number) = inside_out(shapes, prepared, &searched, seed) {
                return Err(Error::Turned(number));
            }
            failed.push(searched);
            continue;
        };
        realign(prepared, &mut motions, seed);
        let aligned = moved(shapes, motions, |_| Way::Searched);
        let aligned = Aligned { strangers: strangers(&aligned.shapes)?, ..aligned };
        if !most(aligned.strangers.len(), shapes.len() - 1) {
            return Ok(aligned);
        }
        if best.as_ref().is_none_or(|best| aligned.strangers.len() < best.strangers.len()) {
            best = Some(aligned);
        }
    }
    best.ok_or_else(|| odd_one(&failed))
}

/// Searches for the poses of all shapes on one of them.
struct Searched {
    /// That one.
    pattern: usize,
    /// The motion of each to it, or what the best pose explains of it, which is too little.
    found: Vec<Result<Similarity3<f64>, f64>>,
}

impl Searched {
    /// All motions, if all were found.
    fn motions(&self) -> Option<Vec<Similarity3<f64>>> {
        self.found.iter().map(|found| found.ok()).collect()
    }

    /// Those that match no pose, and what the best one explains of them.
    fn unlike(&self) -> impl Iterator<Item = (usize, f64)> {
        self.found.iter().enumerate().filter_map(|(number, found)| Some((number, found.err()?)))
    }
}

/// From each shape to the pattern, roughly.
fn searched(
    shapes: &[Mesh],
    prepared: &[Shape],
    pattern: usize,
    seed: u64,
    progress: &(dyn Fn(u64, u64) + Sync),
) -> Searched {
    let done = AtomicU64::new(0);
    let search = |number: usize| {
        if number == pattern {
            return Ok(Similarity3::identity());
        }
        let size = size_of(shapes, pattern, number);
        let motion = pairwise(&prepared[number], &prepared[pattern], size, seed);
        progress(done.fetch_add(1, atomic::Ordering::Relaxed) + 1, shapes.len() as u64 - 1);
        motion
    };
    Searched { pattern, found: (0..shapes.len()).into_par_iter().map(search).collect() }
}

/// Why shapes cannot be aligned that match no pose of any pattern. Whoever matches none of the pattern that fewest are unlike is
/// the odd one.
fn odd_one(searched: &[Searched]) -> Error {
    let unlike = |searched: &Searched| searched.unlike().count();
    let fewest = searched.iter().min_by_key(|searched| unlike(searched));
    let odd = fewest.and_then(|fewest| Some((fewest, fewest.unlike().next()?)));
    let (fewest, (number, explained)) = odd.expect("searches that failed did for a shape");
    let others = fewest.found.len() - 1;
    let unlike_first = searched.iter().find(|searched| searched.pattern == 0).map_or(0, unlike);
    let alone = fewest.pattern == 0 && others > 1 && most(unlike_first, others);
    if unlike_first > 0 && (number == 0 || alone) {
        return Error::OddFirst { unlike: unlike_first, others };
    }
    Error::NoMatch { number, explained }
}

/// Size of one shape, a share of that of another one.
fn size_of(shapes: &[Mesh], one: usize, another: usize) -> f64 {
    (shapes[one].area() / shapes[another].area()).sqrt()
}

/// The shape that is inside out, if that is why some match no pose of the pattern. Those in the minority are; among
/// as many of either, those that seem to face inwards. None whose form says that it faces outwards: turned, a foot
/// matches the inside of a mug.
fn inside_out(shapes: &[Mesh], prepared: &[Shape], searched: &Searched, seed: u64) -> Option<usize> {
    let pattern = searched.pattern;
    let turned = |&number: &usize| {
        let points = inverted(&prepared[number].points);
        let best = best(&points, &prepared[pattern], size_of(shapes, pattern, number), seed);
        best.is_some_and(|best| best.quality > LEAST)
    };
    let turned: Vec<usize> = searched.unlike().map(|(number, _)| number).filter(turned).collect();
    let &odd = turned.first()?;
    let alike = searched.found.iter().filter(|result| result.is_ok()).count();
    let pattern_is = match turned.len().cmp(&alike) {
        Ordering::Less => false,
        Ordering::Equal => outwardness(&shapes[pattern]) < outwardness(&shapes[odd]),
        Ordering::Greater => true,
    };
    let blamed = if pattern_is { vec![pattern] } else { turned };
    blamed.into_iter().find(|&number| !faces_outwards(&shapes[number]))
}

/// Whether a mesh's form says that it faces outwards.
fn faces_outwards(mesh: &Mesh) -> bool {
    encloses(mesh) || outwardness(mesh).is_some_and(|outwards| outwards >= OUTWARDS)
}

fn inverted(points: &OrientedPoints) -> OrientedPoints {
    OrientedPoints { points: points.points.clone(), normals: points.normals.iter().map(|n| -n).collect() }
}

/// Shapes in one pose, drawn to their mean by these motions unless those ran away; `before` are the shapes as they lie.
fn drawn_or_kept(shapes: &[Mesh], before: &[Side], motions: Vec<Similarity3<f64>>) -> Aligned {
    let drawn = moved(shapes, motions, Way::Drawn);
    let far = drawn.way.apart().filter(|apart| apart.turn > FAR);
    let farther = || {
        let size = length(&shapes[0]);
        sides(&drawn.shapes).map_or(true, |drawn| scatter(&drawn, size) > scatter(before, size))
    };
    match far {
        Some(far) if farther() => {
            let still = vec![Similarity3::identity(); shapes.len()];
            Aligned { shapes: shapes.to_vec(), motions: still, way: Way::Kept(far), strangers: vec![] }
        }
        _ => drawn,
    }
}

fn moved(shapes: &[Mesh], motions: Vec<Similarity3<f64>>, way: impl FnOnce(Option<Apart>) -> Way) -> Aligned {
    let way = way(apart(shapes, &motions));
    let moved = shapes.iter().zip(&motions).map(|(mesh, motion)| mesh.moved(motion)).collect();
    Aligned { shapes: moved, motions, way, strangers: vec![] }
}

/// A shape's motion to another one, roughly, or what the best pose explains of it, which is too little.
fn pairwise(shape: &Shape, other: &Shape, sizes: f64, seed: u64) -> Result<Similarity3<f64>, f64> {
    match best(&shape.points, other, sizes, seed) {
        Some(best) if best.quality > LEAST => Ok(other.to_field.inverse() * best.pose),
        best => Err(best.map_or(0.0, |best| best.quality.max(0.0))),
    }
}

/// The best candidate of a coarse search for the pose of a shape's points on another one.
fn best(points: &OrientedPoints, other: &Shape, sizes: f64, seed: u64) -> Option<Candidate> {
    let search = Search::new(&other.field, points, other.to_field.scaling() * sizes, seed);
    search.candidates(0, EFFORT).into_iter().next()
}

/// The distances of a shape on its own lattice.
fn prepared((mesh, side): (&Mesh, &Side)) -> Shape {
    let (low, high) = mesh.bounds().unwrap_or((Point::origin(), Point::origin()));
    let (field, scale, shift) = Field::of_surface(&side.surface, low, high, mesh.area());
    let to_field = Similarity3::from_parts(Translation3::from(shift), UnitQuaternion::identity(), scale);
    Shape { field, to_field, points: side.points.clone() }
}

#[cfg(test)]
mod tests {
    use super::super::generalised::{TOGETHER, bend, lying};
    use super::*;
    use crate::check::alternatives::Alternative;
    use crate::mesh::Vector;
    use crate::surface::shapes::{ball, sheet};
    use crate::synth::Head;
    use std::f64::consts::TAU;

    fn refused(shapes: &[Mesh]) -> Error {
        align(shapes, Align::Auto, 1, &|_, _| ()).err().unwrap()
    }

    #[test]
    fn the_odd_one_is_told_wherever_it_stands() {
        let [a, b, c] = [0, 1, 2].map(|number| Head::sample(1, number).mesh());
        let plane = sheet(30);
        let first = refused(&[plane.clone(), a.clone(), b.clone(), c]);
        assert!(matches!(first, Error::OddFirst { unlike: 3, others: 3 }), "{first}");
        assert!(matches!(refused(&[a.clone(), b, plane.clone()]), Error::NoMatch { number: 2, .. }));
        assert!(matches!(refused(&[a, plane]), Error::NoMatch { number: 1, .. }));
    }

    #[test]
    fn shapes_in_one_pose_that_run_away_from_it_are_left_as_they_lie() {
        let heads = [0, 1].map(|number| Head::sample(1, number).mesh());
        let turned = |degrees: f64| {
            let turn = |sign: f64| Vector::y() * (sign * degrees.to_radians());
            [-1.0, 1.0].map(|sign| Similarity3::new(Vector::zeros(), turn(sign), 1.0)).to_vec()
        };
        let drawn_or_kept =
            |shapes: &[Mesh], motions| drawn_or_kept(shapes, &sides(shapes).unwrap(), motions);
        let away = drawn_or_kept(&heads, turned(30.0));
        assert!(matches!(away.way, Way::Kept(far) if far.turn > FAR), "{:?}", away.way);
        assert_eq!((away.shapes.as_slice(), away.way.apart()), (heads.as_slice(), None));
        assert!(away.motions.iter().all(|motion| *motion == Similarity3::identity()));
        let little = drawn_or_kept(&heads, turned(6.0));
        assert!(
            matches!(little.way, Way::Drawn(Some(_))) && little.shapes[0] != heads[0],
            "{:?}",
            little.way
        );
        // As far, but together.
        let back =
            [1.0, -1.0].map(|sign| Similarity3::new(Vector::zeros(), Vector::y() * (sign * 0.52), 1.0));
        let apart: Vec<Mesh> = heads.iter().zip(&back).map(|(head, motion)| head.moved(motion)).collect();
        let met = drawn_or_kept(&apart, back.iter().map(Similarity3::inverse).collect());
        assert!(matches!(met.way, Way::Drawn(Some(far)) if far.turn > FAR), "{:?}", met.way);
    }

    #[test]
    fn a_shape_that_is_inside_out_is_told_from_a_stranger() {
        let [a, b, c] = [0, 1, 2].map(|number| Head::sample(1, number).mesh());
        let turned = Alternative::Flipped.of(&c);
        assert!(matches!(refused(&[a.clone(), b.clone(), turned]), Error::Turned(2)));
        let turned = Alternative::Flipped.of(&a);
        assert!(matches!(refused(&[turned.clone(), b.clone(), c]), Error::Turned(0)));
        assert!(matches!(refused(&[turned, b.clone()]), Error::Turned(0)));
        assert!(matches!(refused(&[a, Alternative::Flipped.of(&b)]), Error::Turned(1)));
    }

    /// A bottle so long, with a body of this radius.
    fn bottle(length: f64, radius: f64) -> Mesh {
        const AROUND: u32 = 24;
        const RINGS: u32 = 40;
        let ring = |i: u32| {
            let z = length * f64::from(i) / f64::from(RINGS - 1);
            let neck = ((z / length - 0.55) / 0.25).clamp(0.0, 1.0);
            let r = radius + (13.0 - radius) * neck * neck * (3.0 - 2.0 * neck);
            (0..AROUND).map(move |j| {
                let (sin, cos) = (TAU * f64::from(j) / f64::from(AROUND)).sin_cos();
                Point::new(r * cos, r * sin, z)
            })
        };
        let mut points: Vec<Point> = (0..RINGS).flat_map(ring).collect();
        points.extend([Point::origin(), Point::new(0.0, 0.0, length)]);
        let (bottom, top) = (RINGS * AROUND, RINGS * AROUND + 1);
        let at = |i: u32, j: u32| i * AROUND + j % AROUND;
        let side = |(i, j)| {
            let [a, b, c, d] = [at(i, j), at(i, j + 1), at(i + 1, j), at(i + 1, j + 1)];
            [[a, b, d], [a, d, c]]
        };
        let sides = (0..RINGS - 1).flat_map(|i| (0..AROUND).map(move |j| (i, j))).flat_map(side);
        let ends = (0..AROUND)
            .flat_map(|j| [[bottom, at(0, j + 1), at(0, j)], [top, at(RINGS - 1, j), at(RINGS - 1, j + 1)]]);
        Mesh { triangles: sides.chain(ends).collect(), points, ..Mesh::default() }
    }

    fn all_prepared(shapes: &[Mesh]) -> Vec<Shape> {
        shapes.iter().zip(&sides(shapes).unwrap()).map(prepared).collect()
    }

    /// Two of the bottles are one half as slender again as the other: deformations alone take them apart.
    #[test]
    fn shapes_that_deformations_take_from_the_mean_are_drawn_without() {
        let shapes = [bottle(215.0, 44.5), bottle(262.0, 34.0)];
        let prepared = all_prepared(&shapes);
        let on_first = Similarity3::new(Vector::new(0.0, 0.0, -12.0), Vector::zeros(), 1.2);
        let mut motions = vec![Similarity3::identity(), on_first];
        let least = |motions: &[_]| lying(&prepared, motions, TOGETHER).into_iter().fold(1.0, f64::min);
        let before = least(&motions);
        let mut bent = motions.clone();
        bend(&prepared, &mut bent, &[false; 2]);
        realign(&prepared, &mut motions, 1);
        let (bent, after) = (least(&bent), least(&motions));
        assert!(after > before - 0.05, "{before} before, {after} after");
        assert!(bent < after, "{bent} by deformations, {after} without");
    }

    #[test]
    fn a_shape_that_lies_head_to_tail_is_turned_round() {
        let shapes = [bottle(215.0, 44.5), bottle(220.0, 43.0), bottle(210.0, 46.0)];
        let over = Similarity3::new(Vector::new(0.0, 0.0, 210.0), Vector::x() * (TAU / 2.0), 1.0);
        let mut motions = vec![Similarity3::identity(), Similarity3::identity(), over];
        realign(&all_prepared(&shapes), &mut motions, 1);
        let up = motions.iter().map(|motion| (motion * Vector::z()).normalize());
        let up: Vec<Vector> = up.collect();
        assert!(up.iter().all(|axis| axis.dot(&up[0]) > 0.99), "{up:?}");
    }

    #[test]
    fn only_a_form_that_faces_inwards_is_called_inside_out() {
        let (head, ball) = (Head::sample(1, 0).mesh(), ball(12, 4.0));
        for mesh in [&ball, &head] {
            assert!(faces_outwards(mesh) && !faces_outwards(&Alternative::Flipped.of(mesh)));
        }
        assert!(!faces_outwards(&sheet(5)));
        let shapes = [ball, Alternative::Flipped.of(&head)];
        let searched = Searched { pattern: 0, found: vec![Ok(Similarity3::identity()), Err(0.1)] };
        assert_ne!(inside_out(&shapes, &all_prepared(&shapes), &searched, 1), Some(0));
    }

    #[test]
    fn who_matches_nobody_is_the_odd_one_and_not_those_that_do_not_match_it() {
        let found = |pattern: usize, unlike: &[usize]| {
            let of = |n: usize| if unlike.contains(&n) { Err(0.1) } else { Ok(Similarity3::identity()) };
            Searched { pattern, found: (0..8).map(of).collect() }
        };
        let first = odd_one(&[found(0, &[2, 5, 6]), found(3, &[0]), found(7, &[0])]);
        assert!(matches!(first, Error::OddFirst { unlike: 3, others: 7 }), "{first}");
        let fifth = odd_one(&[found(0, &[5]), found(3, &[5]), found(7, &[5])]);
        assert!(matches!(fifth, Error::NoMatch { number: 5, .. }), "{fifth}");
        assert_eq!((patterns(2), patterns(3), patterns(8)), (vec![0], vec![0, 1, 2], vec![0, 3, 7]));
    }
}
