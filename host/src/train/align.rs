//! Rigid alignment of the training shapes with scale, without correspondences (paper, section 3.1): coarse
//! search, then ICP; a second round against the mean of the aligned shapes takes away the bias towards the
//! first one.

use super::distance::Surface;
use super::volume::{Lattice, sample};
use crate::mesh::{Mesh, Point, Vector};
use crate::points::thin;
use crate::register::field::Field;
use crate::register::icp::{Outcome, Side, icp};
use crate::register::search::Search;
use crate::surface::{Volume, largest_component, marching_cubes, trim_rim};
use nalgebra::{Similarity3, Translation3, UnitQuaternion};
use rayon::prelude::*;

/// Whether the shapes are aligned before training.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Align {
    /// Only if they are not in one pose already.
    Auto,
    /// Always.
    Always,
    /// Never.
    Never,
}

/// Aligned shapes and how.
pub struct Aligned {
    /// The shapes in the frame of the first one.
    pub shapes: Vec<Mesh>,
    /// From each given shape to the common frame.
    pub motions: Vec<Similarity3<f64>>,
    /// Whether anything was moved.
    pub moved: bool,
}

/// Why shapes cannot be aligned.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A shape without area.
    #[error("training shape {0} has no triangles with an area: a model is trained on meshes, not on points")]
    NoSurface(usize),
    /// A shape that matches no pose.
    #[error(
        "training shape {number} could not be aligned to the first one ({overlap:.0} % overlap): is it of the same class?"
    )]
    NoMatch {
        /// Which, counted from zero.
        number: usize,
        /// Share of points with a partner, per cent.
        overlap: f64,
    },
}

/// Median distance, share of the size, and overlap within which shapes count as in one pose. Among 90 aligned
/// faces the largest differs from the first by 0.051 with an overlap of 0.86.
const SAME_POSE: (f64, f64) = (0.06, 0.6);
/// Candidates of the coarse search that ICP refines.
const TRIED: usize = 8;

/// Aligns shapes of one class to the frame of the first.
///
/// # Errors
/// A shape without area, or unlike the first one.
pub fn align(
    shapes: &[Mesh],
    mode: Align,
    seed: u64,
    progress: &(dyn Fn(u64, u64) + Sync),
) -> Result<Aligned, Error> {
    let stay = || Aligned {
        shapes: shapes.to_vec(),
        motions: vec![Similarity3::identity(); shapes.len()],
        moved: false,
    };
    if mode == Align::Never || shapes.len() < 2 {
        return Ok(stay());
    }
    let sides = sides(shapes)?;
    let size = |mesh: &Mesh| mesh.bounds().map_or(1.0, |(low, high)| (high - low).max());
    let first_size = size(&shapes[0]);
    if mode == Align::Auto && sides[1..].par_iter().all(|side| in_one_pose(side, &sides[0], first_size)) {
        return Ok(stay());
    }
    let (low, high) = shapes[0].bounds().unwrap_or((Point::origin(), Point::origin()));
    let (field, scale, shift) = Field::of_surface(&sides[0].surface, low, high, super::area(&shapes[0]));
    let to_field = Similarity3::from_parts(Translation3::from(shift), UnitQuaternion::identity(), scale);
    let done = std::sync::atomic::AtomicU64::new(0);
    let mut motions = vec![Similarity3::identity()];
    let found: Result<Vec<_>, Error> = (1..shapes.len())
        .into_par_iter()
        .map(|number| {
            let motion = pairwise(&sides[number], &sides[0], &field, &to_field, first_size, seed, number);
            progress(done.fetch_add(1, std::sync::atomic::Ordering::Relaxed) + 1, shapes.len() as u64 - 1);
            motion
        })
        .collect();
    motions.extend(found?);
    let motions = towards_mean(shapes, &sides, motions, first_size);
    let moved: Vec<Mesh> =
        shapes.iter().zip(&motions).map(|(mesh, motion)| transformed(mesh, motion)).collect();
    Ok(Aligned { shapes: moved, motions, moved: true })
}

/// Shapes that do not lie where the first one does, and the share of the points that found a partner.
///
/// # Errors
/// A shape without area.
pub fn elsewhere(shapes: &[Mesh]) -> Result<Vec<(usize, f64)>, Error> {
    let sides = sides(shapes)?;
    let [first, others @ ..] = sides.as_slice() else { return Ok(vec![]) };
    let size = shapes[0].bounds().map_or(1.0, |(low, high)| (high - low).max());
    let here: Vec<Outcome> =
        others.par_iter().map(|side| icp(side, first, Similarity3::identity(), 1, size)).collect();
    let found = here.iter().enumerate().filter(|(_, outcome)| !together(outcome, size));
    Ok(found.map(|(i, outcome)| (i + 1, outcome.overlap)).collect())
}

fn sides(shapes: &[Mesh]) -> Result<Vec<Side>, Error> {
    let side = |(number, mesh): (usize, &Mesh)| {
        let surface = Surface::new(mesh).ok_or(Error::NoSurface(number))?;
        Ok(Side { surface, points: even(mesh, 1500.0) })
    };
    shapes.par_iter().enumerate().map(side).collect()
}

/// About `count` points, evenly over the surface.
fn even(mesh: &Mesh, count: f64) -> crate::points::OrientedPoints {
    let area = super::area(mesh);
    thin(mesh, (area / count).sqrt().max(f64::MIN_POSITIVE))
}

fn in_one_pose(side: &Side, first: &Side, size: f64) -> bool {
    together(&icp(side, first, Similarity3::identity(), 1, size), size)
}

fn together(here: &Outcome, size: f64) -> bool {
    here.median < SAME_POSE.0 * size && here.overlap > SAME_POSE.1
}

fn pairwise(
    side: &Side,
    first: &Side,
    field: &Field,
    to_field: &Similarity3<f64>,
    size: f64,
    seed: u64,
    number: usize,
) -> Result<Similarity3<f64>, Error> {
    let candidates = Search::new(field, &side.points, to_field.scaling(), seed).candidates(0, 1500, TRIED);
    let refined = candidates.iter().map(|candidate| {
        let start = to_field.inverse() * candidate.pose;
        icp(side, first, start, 40, size)
    });
    let best = refined.max_by(|a, b| score(a, size).total_cmp(&score(b, size)));
    match best {
        Some(outcome) if outcome.overlap > 0.3 => Ok(outcome.motion),
        other => Err(Error::NoMatch { number, overlap: 100.0 * other.map_or(0.0, |o| o.overlap) }),
    }
}

/// Much overlap at a small distance.
fn score(outcome: &Outcome, size: f64) -> f64 {
    outcome.overlap / (0.01 + outcome.median / size)
}

/// Registers every shape to the mean of all, then sets the mean scale of the motions to one.
fn towards_mean(
    shapes: &[Mesh],
    sides: &[Side],
    mut motions: Vec<Similarity3<f64>>,
    size: f64,
) -> Vec<Similarity3<f64>> {
    for _ in 0..2 {
        let Some(mean) = mean_shape(shapes, &motions, size) else { break };
        let Some(surface) = Surface::new(&mean) else { break };
        let mean = Side { surface, points: even(&mean, 1500.0) };
        motions = sides
            .par_iter()
            .zip(&motions)
            .map(|(side, motion)| icp(side, &mean, *motion, 25, size).motion)
            .collect();
        let growth = motions.iter().map(|m| m.scaling().ln()).sum::<f64>() / motions.len() as f64;
        let back = Similarity3::from_scaling((-growth).exp());
        motions.iter_mut().for_each(|motion| *motion = back * *motion);
    }
    motions
}

/// Zero level of the mean distances, on a coarse grid.
fn mean_shape(shapes: &[Mesh], motions: &[Similarity3<f64>], size: f64) -> Option<Mesh> {
    let moved: Vec<Mesh> =
        shapes.par_iter().zip(motions).map(|(mesh, motion)| transformed(mesh, motion)).collect();
    let (low, high) = super::bounds(&moved);
    let spacing = size / 48.0;
    let margin = 3.0 * spacing;
    let sides = (high - low).map(|length| ((length + 2.0 * margin) / spacing).ceil() as usize + 1).into();
    let lattice = Lattice { origin: low - Vector::repeat(margin), spacing, sides };
    let places: Vec<u32> = (0..lattice.len() as u32).collect();
    let volumes: Vec<_> = moved
        .par_iter()
        .map(|mesh| Some(sample(&Surface::new(mesh)?, &lattice, &places)))
        .collect::<Option<_>>()?;
    let m = volumes.len() as f32;
    let values: Vec<f32> = (0..lattice.len())
        .map(|i| {
            let border = volumes.iter().filter(|v| v.border[i]).count() as f32;
            let mean = volumes.iter().map(|v| v.distances[i]).sum::<f32>() / m;
            if border > 0.5 * m || mean.abs() > 4.0 * spacing as f32 { f32::NAN } else { mean }
        })
        .collect();
    let volume = Volume { dims: lattice.sides, values: &values };
    let mesh = trim_rim(&largest_component(&marching_cubes(&volume, &lattice.origin, spacing)), 1);
    (!mesh.triangles.is_empty()).then_some(mesh)
}

fn transformed(mesh: &Mesh, motion: &Similarity3<f64>) -> Mesh {
    Mesh {
        points: mesh.points.iter().map(|p| motion * p).collect(),
        normals: mesh.normals.iter().map(|n| motion.isometry.rotation * n).collect(),
        triangles: mesh.triangles.clone(),
    }
}
