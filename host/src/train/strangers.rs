//! How shapes lie on each other: whether in one pose, and which of them do not lie where most do.

use super::align::Error;
use crate::distance::Surface;
use crate::mesh::Mesh;
use crate::points::{OrientedPoints, thin};
use crate::register::partners::{Partners, Side, partners};
use rayon::prelude::*;

/// Partners are looked for within this share of the size.
const GATE: f64 = 0.1;
/// Median distance, share of the size, and overlap within which shapes count as in one pose. Among 90 aligned
/// faces the largest differs from the first by 0.051 with an overlap of 0.86.
const SAME_POSE: (f64, f64) = (0.06, 0.6);
/// Shapes that the others are compared with, or searched for on, until most are like one of them.
const PATTERNS: usize = 3;

/// A shape that does not lie where most do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stranger {
    /// Which, counted from zero.
    pub number: usize,
    /// The one that it was compared with, where most lie.
    pub pattern: usize,
    /// Share of the points of both that found a partner on the other.
    pub overlap: f64,
}

/// Shapes that the others are compared with, the first one before all.
pub(super) fn patterns(count: usize) -> Vec<usize> {
    // Of two, nobody knows which is the odd one.
    let last = if count > 2 { PATTERNS } else { 1 };
    (0..last.min(count)).map(|turn| turn * (count - 1) / last.saturating_sub(1).max(1)).collect()
}

/// Whether so many are most of all but one.
pub(super) const fn most(number: usize, others: usize) -> bool {
    2 * number > others
}

/// Shapes that do not lie where most do: where the first one does, or, where most lie elsewhere, the one of some that most
/// lie with.
pub(super) fn strangers(shapes: &[Mesh]) -> Result<Vec<Stranger>, Error> {
    let sides = sides(shapes)?;
    let mut fewest: Option<Vec<Stranger>> = None;
    for pattern in patterns(shapes.len()) {
        let strangers = elsewhere(&sides, pattern, length(&shapes[pattern]));
        if !most(strangers.len(), shapes.len() - 1) {
            return Ok(strangers);
        }
        if fewest.as_ref().is_none_or(|fewest| strangers.len() < fewest.len()) {
            fewest = Some(strangers);
        }
    }
    Ok(fewest.unwrap_or_default())
}

/// Shapes that do not lie where the pattern does, which is so long.
fn elsewhere(sides: &[Side], pattern: usize, size: f64) -> Vec<Stranger> {
    let others = sides.iter().enumerate().filter(|(number, _)| *number != pattern);
    let here = others.map(|(number, side)| (number, partners(side, &sides[pattern], GATE * size)));
    let strangers = here.filter(|(_, here)| !together(here, size));
    strangers.map(|(number, here)| Stranger { number, pattern, overlap: here.overlap }).collect()
}

/// The shape of which least lies where others do, if there are three or more.
///
/// # Errors
/// A shape without area.
pub fn farthest(shapes: &[Mesh]) -> Result<Option<usize>, Error> {
    if shapes.len() < 3 {
        return Ok(None);
    }
    let sides = sides(shapes)?;
    let overlap = |number: usize| {
        let others = patterns(shapes.len()).into_iter().filter(|&pattern| pattern != number);
        let gate = |pattern: usize| GATE * length(&shapes[pattern]);
        let here = others.map(|pattern| partners(&sides[number], &sides[pattern], gate(pattern)).overlap);
        here.fold(0.0, f64::max)
    };
    Ok((0..shapes.len()).min_by(|&a, &b| overlap(a).total_cmp(&overlap(b))))
}

/// The shapes with points to find partners for.
///
/// # Errors
/// A shape without area.
pub(super) fn sides(shapes: &[Mesh]) -> Result<Vec<Side>, Error> {
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

/// Whether a shape is in one pose with the first one, which is so long.
pub(super) fn in_one_pose(side: &Side, first: &Side, size: f64) -> bool {
    together(&partners(side, first, GATE * size), size)
}

fn together(here: &Partners, size: f64) -> bool {
    here.median < SAME_POSE.0 * size && here.overlap > SAME_POSE.1
}

/// How badly shapes lie on the first one, which is so long: median distance over overlap, of all of them.
pub(super) fn scatter(sides: &[Side], size: f64) -> f64 {
    let [first, others @ ..] = sides else { return 0.0 };
    let here = others.iter().map(|side| partners(side, first, GATE * size));
    here.map(|here| here.median / here.overlap).sum()
}

/// Longest side of a shape's bounds.
pub(super) fn length(mesh: &Mesh) -> f64 {
    mesh.bounds().map_or(1.0, |(low, high)| (high - low).max())
}

#[cfg(test)]
mod tests {
    use super::super::align::{Align, align};
    use super::*;
    use crate::synth::Head;

    /// Of shapes that were not aligned, not those that lie together are told.
    #[test]
    fn a_first_shape_that_lies_elsewhere_is_the_stranger() {
        let heads = [0, 1, 2].map(|number| Head::sample(1, number).mesh());
        let mut plate = heads[0].clone();
        plate.points.iter_mut().for_each(|p| p.y *= 0.02);
        let [a, b, c] = heads;
        let found = align(&[plate, a, b, c], Align::Never, 1, &|_, _| ()).unwrap();
        let numbers: Vec<usize> = found.strangers.iter().map(|stranger| stranger.number).collect();
        assert_eq!(numbers, [0]);
        assert_eq!(farthest(&found.shapes).unwrap(), Some(0));
    }
}
