//! Whether the points of a scan lie in two layers: views that were not aligned well, or a scanner or an object that moved.
//!
//! Where two views show the same place and lie apart, the points around it have heights of two kinds over the surface. They
//! are told from noise by how much of the heights' variance is between the two kinds that have the least variance in
//! themselves (Otsu 1979): nearly all of it, of noise of any size 2 / π. They are told from an edge by where they are: among
//! each other along the surface.

use super::neighbourhoods::Neighbourhoods;
use super::places::Places;
use crate::mesh::{Mesh, Vector};
use crate::surface::Moments;
use rayon::prelude::*;

/// Points that are looked around, at most.
const SAMPLES: usize = 2000;
/// Points that are looked at around each, at most.
const MOST: usize = 120;
/// Fewest points of a layer.
const FEWEST: usize = 6;
/// Fewest points of both.
const FEWEST_OF_BOTH: f64 = 24.0;
/// Share of the variance that is between the layers, at least: of three views of heads that fit together 0.73 to 0.76 at 95 %
/// of the points (1.5 mm of noise make it no more), moved by 1 mm 0.88 to 0.94 there.
const BETWEEN: f64 = 0.8;
/// Nearest points, along the surface, that tell whether the layers are among each other.
const NEAREST: usize = 4;
/// Share of those that are in the other layer, at least, in terms of 2 p q, what it is where chance put them.
const MIXED: f64 = 0.75;
/// Share of the points that have two layers around them, from which on that is told: 0.019 at most of views that fit together,
/// moved by 1 mm 0.16 to 0.28 of them; single views with depths in steps of 1 mm 0.04 at most, of 2 to 4 mm up to 0.15.
const SHARE: f64 = 0.05;
/// Length of the mean of the unit normals where two layers are, from which on they face one way: the camera, of depths in such
/// steps (0.952 to 0.991). Of views that were moved 0.75 to 0.92, of a femur's that do not fit well 0.935.
const ONE_WAY: f64 = 0.945;
/// Layers that are nearer to each other are none, in terms of how far points hear of each other.
const LEAST: f64 = 0.01;

/// How far apart the layers are, root mean square, where a scan has two, at most `widest`. None, too, where the points are too
/// far apart to tell.
pub fn apart(scan: &Mesh, widest: f64) -> Option<f64> {
    let places = Places::of(scan);
    let samples = places.samples(SAMPLES);
    let points = (scan, places.facing.as_slice());
    let mut around = Neighbourhoods::new(points, &places.used, &samples, widest, true)?;
    around.noise(&samples)?;
    let look = |&i: &usize| {
        let (normal, points) = around.disc(i);
        let points: Vec<_> = points.collect();
        let some: Vec<_> = points.iter().step_by(points.len().div_ceil(MOST)).copied().collect();
        Some((step(&some)?, normal))
    };
    let found: Vec<(f64, Vector)> = samples.par_iter().filter_map(look).collect();
    let count = found.len() as f64;
    let apart = (found.iter().map(|(step, _)| step * step).sum::<f64>() / count).sqrt();
    let one_way = found.iter().map(|(_, normal)| normal).sum::<Vector>().norm() / count;
    let told = count > SHARE * samples.len() as f64 && one_way < ONE_WAY && apart > LEAST * widest;
    told.then_some(apart)
}

/// The step between two layers of some points, each (u, v, h); none where they are in one.
fn step(points: &[[f64; 3]]) -> Option<f64> {
    let mut moments = Moments::default();
    points.iter().for_each(|&[u, v, h]| moments.add(u, v, h));
    let surface = moments.fit(FEWEST_OF_BOTH)?;
    let heights: Vec<f64> = points.iter().map(|&[u, v, h]| h - surface.at(u, v)).collect();
    let (low, high) = split(&heights)?;
    let [p, q] = [&low, &high].map(|layer| layer.len() as f64 / points.len() as f64);
    let mean = |layer: &[usize]| layer.iter().map(|&i| heights[i]).sum::<f64>() / layer.len() as f64;
    (in_the_other(points, &low) > MIXED * 2.0 * p * q).then(|| mean(&high) - mean(&low))
}

/// Heights in two, so that most of the variance is between the two; none where that is not nearly all.
fn split(heights: &[f64]) -> Option<(Vec<usize>, Vec<usize>)> {
    let count = heights.len() as f64;
    let mean = heights.iter().sum::<f64>() / count;
    let variance = heights.iter().map(|h| (h - mean) * (h - mean)).sum::<f64>() / count;
    let mut order: Vec<usize> = (0..heights.len()).collect();
    order.sort_by(|&a, &b| heights[a].total_cmp(&heights[b]));
    let (mut below, mut between, mut lower) = (0.0, 0.0, 0);
    for (i, &point) in order.iter().enumerate().take(heights.len().saturating_sub(1)) {
        below += heights[point] - mean;
        let (p, q) = ((i + 1) as f64 / count, (count - (i + 1) as f64) / count);
        let found = (below / count) * (below / count) / (p * q);
        if found > between {
            (between, lower) = (found, i + 1);
        }
    }
    let high = order.split_off(lower);
    let enough = order.len().min(high.len()) >= FEWEST;
    (enough && between > BETWEEN * variance).then_some((order, high))
}

/// Share of the points' nearest ones along the surface that are in the other layer than the point.
fn in_the_other(points: &[[f64; 3]], low: &[usize]) -> f64 {
    let mut is_low = vec![false; points.len()];
    low.iter().for_each(|&i| is_low[i] = true);
    let other = |i: usize| {
        let [u, v, _] = points[i];
        let squared = |j: usize| (points[j][0] - u).powi(2) + (points[j][1] - v).powi(2);
        let mut near: Vec<(f64, usize)> =
            (0..points.len()).filter(|&j| j != i).map(|j| (squared(j), j)).collect();
        let (nearest, ..) =
            near.select_nth_unstable_by(NEAREST, |a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        nearest.iter().filter(|(_, j)| is_low[*j] != is_low[i]).count()
    };
    (0..points.len()).map(other).sum::<usize>() as f64 / (NEAREST * points.len()) as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Point;
    use crate::surface::shapes::{joined, noisy, sheet};
    use nalgebra::Rotation3;

    /// Slopes up to one along both axes: of a motion along z a share of 0.8 is along the normal, root mean square.
    fn bowl(x: f64, y: f64) -> f64 {
        (x * x + y * y) / 60.0 - (x + y)
    }

    /// A view of the same place from elsewhere: its points are not above those of the first.
    fn another(view: &Mesh, lift: f64) -> Mesh {
        let mut moved = view.clone();
        for p in &mut moved.points {
            let (x, y) = (p.x + 0.37, p.y + 0.41);
            *p = Point::new(x, y, p.z + bowl(x, y) - bowl(p.x, p.y) + lift);
        }
        moved
    }

    #[test]
    fn views_that_lie_apart_are_told_by_how_far() {
        for (lift, deviation) in [(0.6, 0.1), (1.0, 0.15), (2.0, 0.15), (2.0, 0.4)] {
            let mut both = joined(&noisy(bowl, deviation), &another(&noisy(bowl, deviation), lift));
            let turn = Rotation3::from_euler_angles(0.4, 2.0, -1.0);
            both.points.iter_mut().for_each(|p| *p = turn * *p);
            let found = apart(&both, 5.0).unwrap();
            assert!((found / (0.8 * lift) - 1.0).abs() < 0.12, "{found} of {lift}");
            let cloud = Mesh { normals: both.vertex_normals(), triangles: vec![], ..both };
            let found = apart(&cloud, 5.0).unwrap();
            assert!((found / (0.8 * lift) - 1.0).abs() < 0.12, "{found} of {lift}, a cloud");
        }
    }

    #[test]
    fn a_small_overlap_is_enough_and_a_speck_is_not() {
        let view = noisy(bowl, 0.15);
        let part = |last: u32| {
            let mut part = another(&view, 1.2);
            part.triangles.retain(|t| t.iter().all(|&v| v / 60 < last));
            joined(&view, &part)
        };
        let found = apart(&part(10), 5.0).unwrap();
        // Where the overlap is, a share of 0.68.
        assert!((found / (0.68 * 1.2) - 1.0).abs() < 0.15, "{found}");
        assert_eq!(apart(&part(2), 5.0), None);
    }

    #[test]
    fn noise_edges_steps_and_views_that_fit_together_are_one_layer() {
        let (edge, step) =
            (|x: f64, _: f64| (x - 30.0).abs() * 0.7, |x: f64, _: f64| f64::from(u8::from(x > 30.0)));
        for deviation in [0.02, 0.1, 0.5, 1.5] {
            assert_eq!(apart(&noisy(bowl, deviation), 5.0), None);
            assert_eq!(apart(&noisy(edge, deviation), 5.0), None);
            assert_eq!(apart(&noisy(step, deviation), 5.0), None);
            let both = joined(&noisy(bowl, deviation), &another(&noisy(bowl, deviation), 0.0));
            assert_eq!(apart(&both, 5.0), None);
        }
    }

    #[test]
    fn steps_of_depth_and_exact_surfaces_are_one_layer() {
        for (unit, deviation) in [(1.0, 0.3), (2.0, 0.6), (3.0, 0.8)] {
            let mut steps = noisy(|x, y| (x + y) / 40.0, deviation);
            steps.points.iter_mut().for_each(|p| p.z = unit * (p.z / unit).round());
            assert_eq!(apart(&steps, 5.0), None, "{unit} {deviation}");
        }
        assert_eq!(apart(&noisy(|x, y| 0.1 * x - 0.2 * y, 0.0), 5.0), None);
        assert_eq!(apart(&noisy(bowl, 0.0), 5.0), None);
    }

    #[test]
    fn two_sides_of_a_thin_part_are_no_layers_and_few_points_none() {
        let (upper, mut under) = (noisy(bowl, 0.1), another(&noisy(bowl, 0.1), -1.5));
        under.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        assert_eq!(apart(&joined(&upper, &under), 5.0), None);
        assert_eq!((apart(&Mesh::default(), 5.0), apart(&sheet(9), 1.0)), (None, None));
        assert_eq!(step(&[]), None);
        assert_eq!(step(&[[0.0; 3]; 99]), None, "of one place");
    }
}
