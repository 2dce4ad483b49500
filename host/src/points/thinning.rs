//! A scan thinned by clustering: all surface within a small cube becomes one point with the mean normal, which also averages
//! the scanner's noise.

use super::OrientedPoints;
use super::sampling::sample;
use crate::cubes::{self, Cube, cube};
use crate::mesh::{Mesh, Point, Vector};
use rustc_hash::FxHashMap;

/// Surface in a cube that faces one way: sums weighted by area.
#[derive(Clone, Copy)]
struct Cluster {
    position: Vector,
    normal: Vector,
    area: f64,
}

/// Thins a mesh or an oriented cloud to one point per occupied cube of edge `cell`, in a fixed order.
/// Surfaces that face away from each other within a cube stay apart.
pub fn thin(mesh: &Mesh, cell: f64) -> OrientedPoints {
    averaged(&clusters(mesh, cell, |_| true), |_| true)
}

/// Thins what `keep` says yes to of a scan as [`thin`] does, without triangles that are folded over: a single one would
/// tell the fit that it is outside what is inside.
pub fn thin_scan(scan: &Mesh, cell: f64, keep: impl FnMut(&Point) -> bool) -> OrientedPoints {
    averaged(&clusters(scan, cell, keep), |around| !around.is_folded())
}

/// Thins as [`thin_scan`] does, with the first cell from `cell` on that leaves at most `most` points.
///
/// n points in cubes of edge c cover an area of n c², so the next cell is c √(n / most), and 2 % longer at least.
pub fn thin_to(
    scan: &Mesh,
    mut cell: f64,
    most: usize,
    mut keep: impl FnMut(&Point) -> bool,
) -> OrientedPoints {
    const GROWTH: f64 = 1.02;
    loop {
        let thinned = thin_scan(scan, cell, &mut keep);
        let excess = thinned.points.len() as f64 / most as f64;
        // Cubes without an end hold few points; without a length, none.
        if excess <= 1.0 || !cell.is_normal() {
            return thinned;
        }
        cell *= excess.sqrt().max(GROWTH);
    }
}

/// Samples of a mesh, about, at most: at 1.65 mm, those of 2.3 square metres. Of more surface, as noise makes it or a room
/// has it, they are farther apart.
const MOST_SAMPLES: f64 = 8e6;
/// Samples of a triangle with equal sides, times its area over their distance squared; others have more.
const DENSITY: f64 = 2.31;

/// How far apart the samples of a mesh are, for cubes of edge `cell`.
fn sampling(mesh: &Mesh, cell: f64) -> f64 {
    f64::max(cell / 2.0, (DENSITY * mesh.area() / MOST_SAMPLES).sqrt())
}

/// What lies in each occupied cube and faces one way.
fn clusters(mesh: &Mesh, cell: f64, mut keep: impl FnMut(&Point) -> bool) -> Vec<(Cube, Cluster)> {
    let mut clusters: FxHashMap<(Cube, u8), Cluster> = FxHashMap::default();
    let mut add = |position: Vector, normal: Vector, area: f64| {
        if !keep(&Point::from(position)) {
            return;
        }
        let key = cube(&Point::from(position), cell);
        let start = Cluster { position: Vector::zeros(), normal: Vector::zeros(), area: 0.0 };
        let cluster = clusters.entry((key, main_axis(&normal))).or_insert(start);
        cluster.position += position * area;
        cluster.normal += normal * area;
        cluster.area += area;
    };
    if mesh.triangles.is_empty() {
        for (point, normal) in mesh.points.iter().zip(&mesh.normals) {
            add(point.coords, *normal, 1.0);
        }
    }
    let spacing = sampling(mesh, cell);
    for t in 0..mesh.triangles.len() {
        sample(&mesh.corners(t), spacing, &mut add);
    }
    merge(clusters)
}

/// One of six directions, so that two sides of a thin part do not cancel.
pub fn main_axis(normal: &Vector) -> u8 {
    let axis = normal.iamax();
    2 * axis as u8 + u8::from(normal[axis] < 0.0)
}

/// Joins the clusters of a cube whose normals agree.
fn merge(clusters: FxHashMap<(Cube, u8), Cluster>) -> Vec<(Cube, Cluster)> {
    let mut ordered: Vec<((Cube, u8), Cluster)> = clusters.into_iter().collect();
    ordered.sort_unstable_by_key(|(key, _)| *key);
    let mut merged: Vec<(Cube, Cluster)> = Vec::with_capacity(ordered.len());
    for ((key, _), cluster) in ordered {
        let same = merged.iter_mut().rev().take_while(|(other, _)| *other == key);
        let mut friends = same.filter(|(_, other)| other.normal.dot(&cluster.normal) > 0.0);
        match friends.next() {
            Some((_, other)) => {
                other.position += cluster.position;
                other.normal += cluster.normal;
                other.area += cluster.area;
            }
            None => merged.push((key, cluster)),
        }
    }
    merged
}

/// The surface in the cubes around a cluster.
#[derive(Default)]
struct Around {
    /// Sum of the normals times areas of what faces the cluster's way.
    normal: Vector,
    /// Area of that.
    own: f64,
    /// Area of what faces the other way.
    other: f64,
}

impl Around {
    /// Whether hardly anything faces the cluster's way. A thin part has as much surface on either side.
    fn is_folded(&self) -> bool {
        self.own < FOLDED * self.other
    }
}

/// Share of the other side's area below which a side is folded over. (1/2, 1/3, 1/4, 1/6, 1/10 on three variants of a raw
/// head with two models: at most 39, 39, 359, 360, 52 square millimetres of the face missed, without it 391; nine scans of
/// faces hardly have such points.)
const FOLDED: f64 = 0.5;

/// Points of the clusters around which `kept` says yes, with normals averaged over the neighbouring cubes of the same side.
fn averaged(clusters: &[(Cube, Cluster)], kept: impl Fn(&Around) -> bool) -> OrientedPoints {
    let mut occupied: FxHashMap<Cube, Vec<usize>> = FxHashMap::default();
    for (index, (key, _)) in clusters.iter().enumerate() {
        occupied.entry(*key).or_default().push(index);
    }
    let mut result = OrientedPoints::default();
    for (key, cluster) in clusters {
        let mut around = Around::default();
        for near in cubes::around(*key) {
            for &other in occupied.get(&near).into_iter().flatten() {
                let Cluster { normal, area, .. } = clusters[other].1;
                if normal.dot(&cluster.normal) > 0.0 {
                    around.normal += normal;
                    around.own += area;
                } else {
                    around.other += area;
                }
            }
        }
        if let Some(normal) = around.normal.try_normalize(0.0).filter(|_| kept(&around)) {
            result.points.push(Point::from(cluster.position / cluster.area));
            result.normals.push(normal);
        }
    }
    result
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sheet(height: f64, up: bool) -> Mesh {
        let points = [[0., 0.], [10., 0.], [10., 10.], [0., 10.]];
        let points = points.map(|[x, y]| Point::new(x + 0.01, y + 0.01, height)).to_vec();
        let triangles = if up { vec![[0, 1, 2], [0, 2, 3]] } else { vec![[0, 2, 1], [0, 3, 2]] };
        Mesh { points, normals: vec![], triangles }
    }

    #[test]
    fn one_point_a_cube_on_the_surface() {
        let thinned = thin(&sheet(0.5, true), 1.0);
        assert!((100..=121).contains(&thinned.points.len()), "{}", thinned.points.len());
        assert!(thinned.points.iter().all(|p| (p.z - 0.5).abs() < 1e-9));
        assert!(thinned.normals.iter().all(|n| (n - Vector::z()).norm() < 1e-9));
    }

    #[test]
    fn a_cloud_with_room_is_thinned_as_before_and_one_without_just_fits() {
        let sheet = sheet(0.5, true);
        let plain = thin(&sheet, 0.1);
        let same = thin_to(&sheet, 0.1, plain.points.len(), |_| true);
        assert_eq!((same.points, same.normals), (plain.points.clone(), plain.normals));
        for most in [9000, 5000, 1000, 100] {
            let count = thin_to(&sheet, 0.1, most, |_| true).points.len();
            assert!(count <= most && count > most * 7 / 10, "{count} of {most}");
        }
    }

    #[test]
    fn a_triangle_that_is_folded_over_gives_no_point_of_a_scan() {
        let mut folded = sheet(0.5, true);
        folded.points.extend([
            Point::new(4.2, 4.2, 0.6),
            Point::new(4.2, 5.2, 0.6),
            Point::new(5.2, 4.2, 0.6),
        ]);
        folded.triangles.push([4, 5, 6]);
        let down = |points: &OrientedPoints| points.normals.iter().filter(|n| n.z < 0.0).count();
        assert!(down(&thin(&folded, 1.0)) > 0);
        let scan = thin_scan(&folded, 1.0, |_| true);
        assert_eq!(down(&scan), 0);
        assert_eq!(scan.points.len(), thin(&sheet(0.5, true), 1.0).points.len());
        let half = thin_scan(&folded, 1.0, |p| p.x < 5.0).points.len();
        assert!(half < scan.points.len() * 6 / 10 && half > scan.points.len() * 4 / 10, "{half}");
    }

    #[test]
    fn two_sides_of_a_thin_part_stay_apart() {
        let (mut both, under) = (sheet(0.6, true), sheet(0.4, false));
        both.triangles.extend(under.triangles.iter().map(|t| t.map(|v| v + 4)));
        both.points.extend(under.points);
        let thinned = thin_scan(&both, 1.0, |_| true);
        let ups = thinned.normals.iter().filter(|n| n.z > 0.99).count();
        assert_eq!(2 * ups, thinned.points.len());
        assert_eq!(thinned.normals.iter().filter(|n| n.z < -0.99).count(), ups);
    }
}
