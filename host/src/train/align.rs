//! Rigid alignment of the training shapes with scale, without correspondences (paper, section 3.1): a coarse
//! search against the first one, then all of them to their common mean.
//!
//! Shapes that are in one pose already skip the search. They are drawn to their mean all the same: as they lie, a part
//! of the modes would be spent on how they lie, which the pose of a scan says anyway (30 faces lay 1.1 degrees and 1.7 mm
//! about each axis and 4.9 % of size apart: three stitched scans were completed to 1.35 instead of 1.75 mm).

use super::generalised::{Shape, towards_mean};
use super::jitter::{Apart, apart, keep_frame};
use crate::check::inwards::outwardness;
use crate::distance::Surface;
use crate::mesh::{Mesh, Point};
use crate::points::{OrientedPoints, thin};
use crate::register::field::Field;
use crate::register::partners::{Partners, Side, partners};
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
    /// The shapes in a common frame, about that of the first one.
    pub shapes: Vec<Mesh>,
    /// From each given shape to the common frame.
    pub motions: Vec<Similarity3<f64>>,
    /// How they were.
    pub way: Way,
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
        "training shape {} could not be aligned to the first one (the best pose explains {:.0} % of it): is it of the \
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
    /// A first shape that most others match no pose of.
    #[error(
        "training shape 1, to which the others are aligned, is like few of them: {unlike} of {others} match no pose of it; \
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

/// Partners are looked for within this share of the size.
const GATE: f64 = 0.1;

/// Median distance, share of the size, and overlap within which shapes count as in one pose. Among 90 aligned
/// faces the largest differs from the first by 0.051 with an overlap of 0.86.
const SAME_POSE: (f64, f64) = (0.06, 0.6);
/// Turn about each axis, root mean square, radians (12 degrees), beyond which shapes that were in one pose are looked at again
/// after they were drawn to their mean. Faces, insoles and vertebrae are turned by 1.2 degrees, caps of skulls by 6.5. Femurs
/// that had been spun came together by 15; caps whose rims end at different places ran away by 35, and their mean closed.
const FAR: f32 = 0.21;
/// Effort of the coarse search: the best candidate alone is looked at further.
const EFFORT: Effort = Effort { draws: 1500, kept: 24, candidates: 1 };
/// Share of a shape's area that its pose must explain, at least.
const LEAST: f64 = 0.3;

/// Aligns shapes of one class: to about the frame of the first, or, if they are in one pose, in their own frame.
///
/// # Errors
/// A shape without area, or unlike the first one.
pub fn align(
    shapes: &[Mesh],
    mode: Align,
    seed: u64,
    progress: &(dyn Fn(u64, u64) + Sync),
) -> Result<Aligned, Error> {
    let still = vec![Similarity3::identity(); shapes.len()];
    if mode == Align::Never || shapes.len() < 2 {
        return Ok(Aligned { shapes: shapes.to_vec(), motions: still, way: Way::Left });
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
    let mut motions = searched(shapes, &prepared, seed, progress)?;
    towards_mean(&prepared, &mut motions);
    Ok(moved(shapes, motions, |_| Way::Searched))
}

/// From each shape to the first one, roughly.
fn searched(
    shapes: &[Mesh],
    prepared: &[Shape],
    seed: u64,
    progress: &(dyn Fn(u64, u64) + Sync),
) -> Result<Vec<Similarity3<f64>>, Error> {
    let done = AtomicU64::new(0);
    let search = |number: usize| {
        let motion = pairwise(&prepared[number], &prepared[0], size_of(shapes, number), seed, number);
        progress(done.fetch_add(1, atomic::Ordering::Relaxed) + 1, shapes.len() as u64 - 1);
        motion
    };
    let found: Vec<Result<_, Error>> = (1..shapes.len()).into_par_iter().map(search).collect();
    if let Some(number) = inside_out(shapes, prepared, &found, seed) {
        return Err(Error::Turned(number));
    }
    let (unlike, others) = (found.iter().filter(|result| result.is_err()).count(), found.len());
    // Of two, nobody knows which is the odd one.
    if others > 1 && 2 * unlike > others {
        return Err(Error::OddFirst { unlike, others });
    }
    std::iter::once(Ok(Similarity3::identity())).chain(found).collect()
}

/// Size of the first shape, a share of that of another one.
fn size_of(shapes: &[Mesh], number: usize) -> f64 {
    (shapes[0].area() / shapes[number].area()).sqrt()
}

/// The shape that is inside out, if that is why some match no pose of the first one. Those in the minority are; among
/// as many of either, those that seem to face inwards.
fn inside_out<T>(
    shapes: &[Mesh],
    prepared: &[Shape],
    found: &[Result<T, Error>],
    seed: u64,
) -> Option<usize> {
    let strangers = (1..).zip(found).filter(|(_, result)| result.is_err());
    let turned = |&number: &usize| {
        let points = inverted(&prepared[number].points);
        let best = best(&points, &prepared[0], size_of(shapes, number), seed);
        best.is_some_and(|best| best.quality > LEAST)
    };
    let turned: Vec<usize> = strangers.map(|(number, _)| number).filter(turned).collect();
    let &odd = turned.first()?;
    let alike = 1 + found.iter().filter(|result| result.is_ok()).count();
    let first = match turned.len().cmp(&alike) {
        Ordering::Less => false,
        Ordering::Equal => outwardness(&shapes[0]) < outwardness(&shapes[odd]),
        Ordering::Greater => true,
    };
    Some(if first { 0 } else { odd })
}

fn inverted(points: &OrientedPoints) -> OrientedPoints {
    OrientedPoints { points: points.points.clone(), normals: points.normals.iter().map(|n| -n).collect() }
}

/// Shapes in one pose, drawn to their mean by these motions unless those ran away; `sides` are the shapes as they lie.
fn drawn_or_kept(shapes: &[Mesh], sides: &[Side], motions: Vec<Similarity3<f64>>) -> Aligned {
    let drawn = moved(shapes, motions, Way::Drawn);
    let far = drawn.way.apart().filter(|apart| apart.turn > FAR);
    let farther = || {
        let size = length(&shapes[0]);
        self::sides(&drawn.shapes).map_or(true, |drawn| scatter(&drawn, size) > scatter(sides, size))
    };
    match far {
        Some(far) if farther() => {
            let still = vec![Similarity3::identity(); shapes.len()];
            Aligned { shapes: shapes.to_vec(), motions: still, way: Way::Kept(far) }
        }
        _ => drawn,
    }
}

/// How badly shapes lie on the first one, which is so long: median distance over overlap, of all of them.
fn scatter(sides: &[Side], size: f64) -> f64 {
    let [first, others @ ..] = sides else { return 0.0 };
    let here = others.iter().map(|side| partners(side, first, GATE * size));
    here.map(|here| here.median / here.overlap).sum()
}

/// Longest side of a shape's bounds.
fn length(mesh: &Mesh) -> f64 {
    mesh.bounds().map_or(1.0, |(low, high)| (high - low).max())
}

fn moved(shapes: &[Mesh], motions: Vec<Similarity3<f64>>, way: impl FnOnce(Option<Apart>) -> Way) -> Aligned {
    let way = way(apart(shapes, &motions));
    let moved = shapes.iter().zip(&motions).map(|(mesh, motion)| mesh.moved(motion)).collect();
    Aligned { shapes: moved, motions, way }
}

/// Shapes that do not lie where the first one does, and the share of the points that found a partner.
///
/// # Errors
/// A shape without area.
pub fn elsewhere(shapes: &[Mesh]) -> Result<Vec<(usize, f64)>, Error> {
    let sides = sides(shapes)?;
    let [first, others @ ..] = sides.as_slice() else { return Ok(vec![]) };
    let size = length(&shapes[0]);
    let here = others.iter().map(|side| partners(side, first, GATE * size)).enumerate();
    Ok(here.filter(|(_, here)| !together(here, size)).map(|(i, here)| (i + 1, here.overlap)).collect())
}

fn sides(shapes: &[Mesh]) -> Result<Vec<Side>, Error> {
    let side = |(number, mesh): (usize, &Mesh)| {
        let surface = Surface::new(mesh).ok_or(Error::NoSurface(number))?;
        Ok(Side { surface, points: even(mesh, 1500.0) })
    };
    shapes.par_iter().enumerate().map(side).collect()
}

/// About `count` points, evenly over the surface.
fn even(mesh: &Mesh, count: f64) -> OrientedPoints {
    let area = mesh.area();
    thin(mesh, (area / count).sqrt().max(f64::MIN_POSITIVE))
}

fn in_one_pose(side: &Side, first: &Side, size: f64) -> bool {
    together(&partners(side, first, GATE * size), size)
}

fn together(here: &Partners, size: f64) -> bool {
    here.median < SAME_POSE.0 * size && here.overlap > SAME_POSE.1
}

/// A shape's motion to the first one, roughly.
fn pairwise(
    shape: &Shape,
    first: &Shape,
    sizes: f64,
    seed: u64,
    number: usize,
) -> Result<Similarity3<f64>, Error> {
    match best(&shape.points, first, sizes, seed) {
        Some(best) if best.quality > LEAST => Ok(first.to_field.inverse() * best.pose),
        other => Err(Error::NoMatch { number, explained: other.map_or(0.0, |best| best.quality.max(0.0)) }),
    }
}

/// The best candidate of a coarse search for the pose of a shape's points on the first one.
fn best(points: &OrientedPoints, first: &Shape, sizes: f64, seed: u64) -> Option<Candidate> {
    let search = Search::new(&first.field, points, first.to_field.scaling() * sizes, seed);
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
    use super::*;
    use crate::check::alternatives::Alternative;
    use crate::mesh::Vector;
    use crate::surface::shapes::sheet;
    use crate::synth::Head;

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
}
