//! Takes the noise out of a scan that has many points in a voxel, and tells how much there was.
//!
//! Each point is moved along the normal onto the quadric that is fitted to its neighbours by least squares. A wide
//! neighbourhood averages more noise and flattens more detail: the widest is taken whose estimate agrees, within the
//! noise, with those of all narrower ones and with the point itself (intersection of confidence intervals, Goldenshluger
//! & Nemirovski 1997). A point that only its own noise has thrown far off goes there as well. So edges stay as sharp as
//! the noise lets them be seen. What noise there is, the points' distances from narrow quadrics tell.
//!
//! Points far closer together than the model's voxels are merged: without noise before this, else after it.

use super::neighbourhoods::{Move, Neighbourhoods};
use super::places::Places;
use super::unfold::unfold;
use crate::cubes::cube;
use crate::mesh::Mesh;
use crate::quantile::median;
use crate::surface::clustered;
use lacuna::Model;
use rayon::prelude::*;
use serde::Serialize;

/// Widest neighbourhood, voxels: its radius. (1 and 1.5 on faces: noise of 1.5 mm leaves 0.29 and 0.25 mm in meshes, 0.41
/// and 0.31 mm in clouds, that of 0.15 mm 0.080 mm both.)
const WIDEST: f64 = 1.5;
/// Points of which the noise is estimated, at most.
const SAMPLES: usize = 4000;
/// Points are merged in cubes of this part of [`WIDEST`], an eighth of a voxel, where that leaves less than half of them: the
/// surface is extracted at half a voxel, and the time is that of all points.
const FINEST: f64 = 12.0;
/// Noise that is less than this part of such a cube folds nothing in it.
const SMOOTH: f64 = 0.125;

/// How noisy a scan is: one standard deviation of its points from the surface around them, in its unit. What varies more
/// slowly than the neighbourhoods is not in it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Noise {
    /// As they came.
    pub before: f64,
    /// As they were moved; median.
    pub after: f64,
}

/// How far points of a scan hear of each other at most, in the class's unit.
pub fn widest(model: &Model<'_>) -> f64 {
    WIDEST * f64::from(model.header().spacing)
}

/// Moves the points of a scan, none by what is farther off than `widest`. `None`, and nothing is moved, where points are
/// too far apart for that.
pub fn reduce(scan: &mut Mesh, widest: f64) -> Option<Noise> {
    if widest <= 0.0 {
        return None;
    }
    let places = Places::of(scan);
    let samples = places.samples(SAMPLES);
    let (mut facing, used) = (places.facing, places.used);
    let mut around = Neighbourhoods::new((scan, &facing), &used, &samples, widest, false)?;
    let before = around.noise(&samples)?;
    let finest = widest / FINEST;
    // What noise folds is merged when that is gone.
    if before < SMOOTH * finest
        && let Some(mut fewer) = clustered(scan, &facing, used.len(), finest)
    {
        let Noise { after, .. } = reduce(&mut fewer, widest)?;
        *scan = fewer;
        return Some(Noise { before, after: after.min(before) });
    }
    let move_of = |&i: &usize| Some((i, around.moved(i, before)?));
    // Neighbours after each other: their surroundings are in the processor's cache.
    let mut order = used.clone();
    order.sort_by_cached_key(|&i| cube(&scan.points[i], around.edge()));
    let moves: Vec<(usize, Move)> = order.par_iter().filter_map(move_of).collect();
    let after = median(moves.iter().map(|(_, of)| of.deviation).collect())?;
    for (i, of) in moves {
        scan.points[i] += of.motion;
        facing[i] = of.normal;
    }
    for (i, &first) in places.first.iter().enumerate() {
        (scan.points[i], facing[i]) = (scan.points[first], facing[first]);
    }
    unfold(scan, &facing, &places.first);
    if let Some(fewer) = clustered(scan, &facing, used.len(), finest) {
        *scan = fewer;
    } else if !scan.normals.is_empty() {
        scan.normals = facing;
    }
    Some(Noise { before, after })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Point, Vector};
    use crate::surface::shapes::{noisy, sheet};
    use rand::{RngExt, SeedableRng};

    /// Root mean square height over `height`, and the largest, five points and more from the rim.
    fn off(mesh: &Mesh, height: impl Fn(f64, f64) -> f64) -> [f64; 2] {
        let inner = mesh.points.iter().filter(|p| p.x.min(p.y) > 4.5 && p.x.max(p.y) < 54.5);
        let errors: Vec<f64> = inner.map(|p| (p.z - height(p.x, p.y)).abs()).collect();
        let squares: f64 = errors.iter().map(|e| e * e).sum();
        [(squares / errors.len() as f64).sqrt(), errors.iter().copied().fold(0.0, f64::max)]
    }

    #[test]
    fn of_a_smooth_surface_a_quarter_of_the_noise_is_left_and_both_are_known() {
        let bowl = |x: f64, y: f64| (x * x + y * y) / 300.0;
        for deviation in [0.05, 0.2, 1.0] {
            let mut mesh = noisy(bowl, deviation);
            let noise = reduce(&mut mesh, 5.0).unwrap();
            assert!((noise.before / deviation - 1.0).abs() < 0.15, "{noise:?} of {deviation}");
            let [rms, _] = off(&mesh, bowl);
            assert!(
                rms < 0.3 * deviation && noise.after < 0.3 * deviation,
                "{rms}, {noise:?} of {deviation}"
            );
            let turned = (0..mesh.triangles.len()).filter(|&t| {
                let [a, b, c] = mesh.corners(t);
                (b - a).cross(&(c - a)).z < 0.0
            });
            assert!(turned.count() < 10, "of 6962");
        }
    }

    #[test]
    fn points_that_noise_has_thrown_far_off_come_back_and_those_of_a_ridge_stay() {
        let mut mesh = noisy(|_, _| 0.0, 2.0);
        assert!(off(&mesh, |_, _| 0.0)[1] > 6.0);
        reduce(&mut mesh, 12.0).unwrap();
        let [_, worst] = off(&mesh, |_, _| 0.0);
        assert!(worst < 1.5, "{worst}");
        let ridge = |x: f64, _: f64| if (x - 30.0).abs() < 1.6 { 7.0 } else { 0.0 };
        let mut mesh = noisy(ridge, 2.0);
        let crest: Vec<usize> = (0..3600).filter(|&i| mesh.points[i].x == 30.0).collect();
        reduce(&mut mesh, 12.0).unwrap();
        let crest: Vec<f64> = crest.into_iter().map(|i| mesh.points[i].z).collect();
        let mean = crest.iter().sum::<f64>() / crest.len() as f64;
        // 1.95 where each point is looked at alone.
        assert!(mean > 3.0, "{mean} left of 7");
        // One that noise does not explain stays where it is.
        let mut mesh = noisy(|_, _| 0.0, 2.0);
        mesh.points[30 * 60 + 30].z = 12.0;
        reduce(&mut mesh, 12.0).unwrap();
        assert_eq!(mesh.points[30 * 60 + 30].z, 12.0);
    }

    #[test]
    fn a_step_and_an_edge_higher_than_the_noise_stay() {
        let edge = |x: f64, _: f64| (x - 30.0).abs() * 0.7;
        let mut mesh = noisy(edge, 0.05);
        reduce(&mut mesh, 5.0).unwrap();
        let [rms, worst] = off(&mesh, edge);
        assert!(rms < 0.05 && worst < 0.25, "{rms} {worst}");
    }

    #[test]
    fn two_sides_of_a_thin_part_do_not_hear_of_each_other() {
        let mut both = noisy(|_, _| 0.0, 0.1);
        let mut under = noisy(|_, _| -1.5, 0.1);
        under.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        both.append(&under);
        reduce(&mut both, 5.0).unwrap();
        let (upper, lower) = both.points.split_at(3600);
        let mean = |points: &[Point]| points.iter().map(|p| p.z).sum::<f64>() / 3600.0;
        assert!(
            mean(upper).abs() < 0.02 && (mean(lower) + 1.5).abs() < 0.02,
            "{} {}",
            mean(upper),
            mean(lower)
        );
    }

    #[test]
    fn triangles_without_common_vertices_stay_together() {
        let whole = noisy(|_, _| 0.0, 0.3);
        let points = whole.triangles.iter().flatten().map(|&v| whole.points[v as usize]).collect();
        let triangles = (0..whole.triangles.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        let mut soup = Mesh { points, normals: vec![], triangles };
        let noise = reduce(&mut soup, 5.0).unwrap();
        assert!((noise.before / 0.3 - 1.0).abs() < 0.15 && off(&soup, |_, _| 0.0)[0] < 0.1, "{noise:?}");
        let place = |v: u32, t: usize, i: usize| (v, soup.points[3 * t + i].coords.map(f64::to_bits));
        let corners = whole.triangles.iter().enumerate();
        let mut places: Vec<_> = corners.flat_map(|(t, c)| [0, 1, 2].map(|i| place(c[i], t, i))).collect();
        places.sort_unstable_by_key(|(v, _)| *v);
        places.dedup();
        assert_eq!(places.len(), whole.points.len(), "copies of a vertex went apart");
    }

    #[test]
    fn frames_of_a_camera_that_stands_still_are_smoothed_as_one_is() {
        let mut frames = Mesh::default();
        for _ in 0..5 {
            frames.append(&sheet(60));
        }
        // Even from -0.35 to 0.35: a deviation of 0.2.
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(6);
        frames.points.iter_mut().for_each(|p| p.z = 0.7 * (random.random::<f64>() - 0.5));
        frames.normals = vec![Vector::z(); frames.points.len()];
        frames.triangles.clear();
        let noise = reduce(&mut frames, 5.0).unwrap();
        assert!((noise.before / 0.2 - 1.0).abs() < 0.15, "{noise:?}");
        let tilt = frames.normals.iter().map(|normal| normal.z).fold(1.0, f64::min);
        assert!(off(&frames, |_, _| 0.0)[0] < 0.06 && tilt > 0.95, "{noise:?} {tilt}");
    }

    #[test]
    fn normals_in_the_file_of_a_mesh_are_not_believed_and_mended() {
        let without = noisy(|_, _| 0.0, 1.0);
        let mut inverted = without.clone();
        inverted.normals = vec![-Vector::z(); without.points.len()];
        let mut same = without;
        reduce(&mut same, 5.0).unwrap();
        reduce(&mut inverted, 5.0).unwrap();
        assert_eq!(inverted.points, same.points);
        assert!(inverted.normals.iter().filter(|normal| normal.z < 0.5).count() < 40, "of 3600");
    }

    #[test]
    fn zero_and_minus_zero_are_one_place() {
        let points = [0.0, -0.0].map(|x| Point::new(x, 1.0, 2.0)).to_vec();
        let both = Mesh { points, normals: vec![Vector::z(); 2], triangles: vec![] };
        assert_eq!(Places::of(&both).first, [0, 0]);
    }

    #[test]
    fn normals_of_a_cloud_are_those_of_the_surface() {
        let mut cloud = noisy(|_, _| 0.0, 0.2);
        cloud.normals = cloud.vertex_normals();
        cloud.triangles.clear();
        let tilt = |cloud: &Mesh| cloud.normals.iter().map(|n| 1.0 - n.z).sum::<f64>();
        let before = tilt(&cloud);
        reduce(&mut cloud, 5.0).unwrap();
        assert!(tilt(&cloud) < 0.1 * before, "{} {before}", tilt(&cloud));
    }

    #[test]
    fn coarse_scans_and_points_without_a_surface_are_left_alone() {
        let mesh = noisy(|_, _| 0.0, 0.1);
        let mut same = mesh.clone();
        assert_eq!(reduce(&mut same, 1.5), None);
        assert_eq!(same, mesh);
        assert_eq!(reduce(&mut Mesh::default(), 5.0), None);
        let line = (0..2000).map(|i| Point::new(f64::from(i) / 100.0, 0.0, 0.0)).collect();
        let mut line = Mesh { points: line, normals: vec![Vector::z(); 2000], triangles: vec![] };
        assert_eq!(reduce(&mut line, 5.0), None);
        // Both sides of a sheet without thickness.
        let mut both = mesh.clone();
        both.normals = both.vertex_normals();
        both.triangles.clear();
        let mut other = both.clone();
        other.normals.iter_mut().for_each(|normal| *normal = -*normal);
        both.append(&other);
        let same = both.clone();
        assert_eq!(reduce(&mut both, 5.0), None);
        assert_eq!(both, same);
        let mut heap = Mesh {
            points: vec![Point::origin(); 50_000],
            normals: vec![Vector::z(); 50_000],
            triangles: vec![],
        };
        assert_eq!(reduce(&mut heap, 5.0), None);
    }
}
