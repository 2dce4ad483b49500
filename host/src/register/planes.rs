//! Tables, walls and floors in a scan: flatter over a larger area than any part of the class, so they are none of it.
//!
//! Next to a table of half a metre a face is a tenth of the scan: hardly any pair of points is drawn on it, and lying on
//! the table explains more than lying on the face. An oriented point is a plane, so random points are tried.

use super::field::{Field, SAMPLE};
use super::rank::SIZES;
use crate::points::OrientedPoints;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

/// Points tried as planes, each time.
const TRIES: usize = 64;
/// Half the thickness of a plane, class millimetres, and the least cosine between its normal and that of a point of it.
const THICKNESS: f64 = 2.5;
const FACING: f64 = 0.95;
/// So many times the area of the flattest part of the class, in the largest possible size, a plane has at least.
const LARGER: f64 = 2.0;

/// The scan's points without its planes. They are one voxel apart, and `spacing` is a voxel in their unit.
pub fn without_planes(field: &Field, mut points: OrientedPoints, spacing: f64, seed: u64) -> OrientedPoints {
    let millimetre = field.millimetre * spacing;
    let flattest = (0..field.samples.points.len())
        .into_par_iter()
        .map(|i| on_plane(&field.samples, i, THICKNESS * field.millimetre).len())
        .max();
    let area = flattest.unwrap_or(0) as f64 * (SAMPLE * field.millimetre).powi(2);
    let most = LARGER * SIZES.end.powi(2) * area;
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    while points.points.len() as f64 > most {
        let tries: Vec<usize> = (0..TRIES).map(|_| random.random_range(0..points.points.len())).collect();
        let planes = tries.into_par_iter().map(|i| on_plane(&points, i, THICKNESS * millimetre));
        let Some(plane) = planes.max_by_key(Vec::len).filter(|plane| plane.len() as f64 > most) else {
            break;
        };
        points = without(&points, &plane);
    }
    points
}

/// The numbers of the points on the plane of one of them, in order.
fn on_plane(all: &OrientedPoints, one: usize, thickness: f64) -> Vec<usize> {
    let (origin, normal) = (all.points[one], all.normals[one]);
    let on = |&i: &usize| {
        (all.points[i] - origin).dot(&normal).abs() < thickness && all.normals[i].dot(&normal) > FACING
    };
    (0..all.points.len()).filter(on).collect()
}

/// The points that are not among `some`, which are in order.
fn without(all: &OrientedPoints, some: &[usize]) -> OrientedPoints {
    let mut kept = vec![true; all.points.len()];
    some.iter().for_each(|&i| kept[i] = false);
    let kept: Vec<usize> = (0..kept.len()).filter(|&i| kept[i]).collect();
    all.chosen(&kept)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Mesh, Point};
    use crate::points::thin;
    use crate::synth::Head;
    use lacuna::Model;

    #[test]
    fn a_table_is_left_out_and_a_head_is_not() {
        let model = Model::from_bytes(lacuna_fixtures::MODEL).expect("the built-in model");
        let (field, spacing) = (Field::of_model(&model), f64::from(model.header().spacing));
        let left = |mesh: &Mesh| without_planes(&field, thin(mesh, spacing), spacing, 1).points;
        let mut scene = Head::sample(1, 1001).mesh();
        let head = left(&scene);
        assert_eq!(head, thin(&scene, spacing).points);
        let first = scene.points.len() as u32;
        let corners = [[-300., -300.], [300., -300.], [300., 300.], [-300., 300.]];
        scene.points.extend(corners.map(|[x, z]| Point::new(x, -150.0, z)));
        scene.triangles.extend([[first, first + 2, first + 1], [first, first + 3, first + 2]]);
        let (all, kept) = (thin(&scene, spacing).points.len(), left(&scene).len());
        assert!(all > 3 * head.len() && kept.abs_diff(head.len()) < 100, "{kept} of {all}, {}", head.len());
    }
}
