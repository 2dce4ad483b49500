//! Whether the points of a scan lie in two layers: views that were not aligned well, or a scanner or an object that moved.
//!
//! Where two views show the same place and lie apart, the points around it have heights of two kinds over the surface. They
//! are told from noise by how much of the heights' variance is between the two kinds that have the least variance in
//! themselves (Otsu 1979): nearly all of it, of noise of any size 2 / π. They are told from an edge by where they are: among
//! each other along the surface.

use super::neighbourhoods::Neighbourhoods;
use super::places::Places;
use crate::mesh::Mesh;
use crate::surface::Moments;
use rayon::prelude::*;

/// Points that are looked around, at most.
const SAMPLES: usize = 2000;
/// Points that are looked at around each, about.
const POINTS: f64 = 57.0;
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
/// moved by 1 mm 0.16 to 0.28 of them; single views with depths in steps of 1 mm 0.04 at most, in steps of 2 mm up to 0.10.
const SHARE: f64 = 0.05;

/// How far apart the layers are, root mean square, where a scan has two; what is farther off than `widest` is not seen.
pub fn apart(scan: &Mesh, widest: f64) -> Option<f64> {
    let places = Places::of(scan);
    let samples = places.samples(SAMPLES);
    let mut around = Neighbourhoods::new((scan, &places.facing), &places.used, &samples, widest)?;
    around.noise(&samples)?;
    let found: Vec<f64> =
        samples.par_iter().filter_map(|&i| step(&around.disc(i, POINTS).collect::<Vec<_>>())).collect();
    let squares: f64 = found.iter().map(|step| step * step).sum();
    let count = found.len() as f64;
    (count > SHARE * samples.len() as f64).then(|| (squares / count).sqrt())
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
        let (nearest, ..) = near.select_nth_unstable_by(NEAREST, |a, b| a.0.total_cmp(&b.0));
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

    fn bowl(x: f64, y: f64) -> f64 {
        (x * x + y * y) / 300.0
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
            assert!((found / lift - 1.0).abs() < 0.12, "{found} of {lift}");
            let cloud = Mesh { normals: both.vertex_normals(), triangles: vec![], ..both };
            let found = apart(&cloud, 5.0).unwrap();
            assert!((found / lift - 1.0).abs() < 0.12, "{found} of {lift}, a cloud");
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
        assert!((found / 1.2 - 1.0).abs() < 0.15, "{found}");
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
    fn two_sides_of_a_thin_part_are_no_layers_and_few_points_none() {
        let (upper, mut under) = (noisy(bowl, 0.1), another(&noisy(bowl, 0.1), -1.5));
        under.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        assert_eq!(apart(&joined(&upper, &under), 5.0), None);
        assert_eq!((apart(&Mesh::default(), 5.0), apart(&sheet(9), 1.0)), (None, None));
        assert_eq!(step(&[]), None);
        assert_eq!(step(&[[0.0; 3]; 99]), None, "of one place");
    }
}
