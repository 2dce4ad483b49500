//! A scene's pose, refined again without what lies beside the shape that was found with it: hair within some millimetres of a
//! face still draws the face's size to its own. In turns, for with less of the hair the shape comes to lie where more of it
//! is beside.

use super::field::Field;
use super::joint::{MANY, every_nth, near, pose_and_shape, refined_by_many, scored, signed_distance};
use super::rank::{SIZES, Scored};
use crate::points::OrientedPoints;
use lacuna::corners::Weights;
use lacuna::cube::Cube;
use lacuna::pose_fit::{Round, SETTLED};
use lacuna::{Model, Pose};
use nalgebra::Vector3;

/// Points farther from the shape than this, or that face away from it, lie beside it; class millimetres.
const BESIDE: f32 = 6.0;
/// Misfit scale for the points that are left, class millimetres: small, so that hair nearer than `BESIDE` counts little.
const MISFIT: f32 = 1.0;
/// Most turns; it ends sooner when a turn finds no better pose.
const TURNS: usize = 4;

/// A rough pose refined, and then again without what lies beside the shape where clutter may mislead it:
/// [`Hint::Settled`](lacuna::pose_fit::Hint::Settled).
///
/// # Errors
/// As for [`refined_by_many`].
pub fn settled(
    model: &Model<'_>,
    field: &Field,
    points: &OrientedPoints,
    rough: Pose,
) -> Result<Scored, lacuna::Error> {
    Ok(trimmed(model, field, points, refined_by_many(model, field, points, rough)?))
}

/// The pose, or a better one where clutter may mislead it.
fn trimmed(model: &Model<'_>, field: &Field, points: &OrientedPoints, mut best: Scored) -> Scored {
    for _ in 0..TURNS {
        if !best.is_among_clutter() {
            break;
        }
        match once(model, field, points, &best) {
            Ok(next) if next.explained > best.explained && SIZES.contains(&next.size) => best = next,
            _ => break,
        }
    }
    best
}

/// Pose and shape from the points that lie on `known`, judged by all that may belong to the class.
fn once(
    model: &Model<'_>,
    field: &Field,
    points: &OrientedPoints,
    known: &Scored,
) -> Result<Scored, lacuna::Error> {
    let on_it = on(model, points, &near(field, points, &known.pose), known);
    let rounds = SETTLED.map(|round| Round { misfit: MISFIT, ..round });
    let chosen = points.chosen(&every_nth(&on_it, MANY[0])).packed();
    let (pose, shape) = pose_and_shape(model, chosen.cloud()?, known.pose, &rounds)?;
    let near = near(field, points, &pose);
    let judges = points.chosen(&every_nth(&near, MANY[1])).packed();
    let share = near.len() as f64 / points.points.len().max(1) as f64;
    Ok(scored(model, judges.cloud()?, pose, shape).of_all(share))
}

/// The numbers of the points that lie beside the shape that was found with a pose.
pub fn beside(model: &Model<'_>, points: &OrientedPoints, known: &Scored) -> Vec<usize> {
    let all: Vec<usize> = (0..points.points.len()).collect();
    let mut is_beside = vec![true; all.len()];
    on(model, points, &all, known).into_iter().for_each(|i| is_beside[i] = false);
    all.into_iter().filter(|&i| is_beside[i]).collect()
}

/// Those of the `near` points that lie on a shape.
fn on(model: &Model<'_>, points: &OrientedPoints, near: &[usize], known: &Scored) -> Vec<usize> {
    let limit = BESIDE * model.header().scales.millimetre;
    let weights = Weights::new(&known.shape);
    let mut cube = Cube::new(model, &weights);
    let on = |&i: &usize| {
        let place = known.pose.apply(points.points[i].coords.map(|c| c as f32).into());
        let facing = Vector3::from(known.pose.rotate(points.normals[i].map(|c| c as f32).into()));
        signed_distance(&mut cube, place)
            .is_some_and(|(distance, normal)| distance.abs() <= limit && normal.dot(&facing) > 0.5)
    };
    near.iter().copied().filter(on).collect()
}
