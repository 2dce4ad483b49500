//! What a surface is off between the points of a coarse scan: between two points whose normals have an angle θ with each
//! other, a distance L apart, a round surface rises L θ / 8 above the straight way. A scan may be coarse in one part (far
//! from the scanner, or where a decimation found it flat) and fine in another.

use crate::cubes::{Cube, around, cube};
use crate::mesh::{Mesh, Point};
use crate::normals::neighbours;
use crate::quantile::{median, quantile};
use crate::surface::{Edge, Edges};
use std::collections::BTreeMap;

/// Scans whose points are closer together than this, class millimetres, are off by their noise instead. Those that models
/// are calibrated on are: those of the simulated scanner are 1.3 apart.
const COARSE: f64 = 3.5;
/// Share of the area in triangles with longer sides that does not make a mesh coarse: at its rim.
const RIM: f64 = 0.05;
/// Clouds of more points are fine without a look at their neighbours: ten times as many as a shape of the class, 280 class
/// millimetres square, has at that distance.
const MANY: usize = 64_000;
/// Share of the surface that is off by less than is told.
const SHARE: f64 = 0.68;
/// Which of the nearest points of a cloud tells how far points are apart: with the fourth, 88 to 93 % of the errors of
/// scans of 500 and 1000 points were smaller, as fits go smoothly from point to point; with the second 80 to 82 %.
const NEAREST: u32 = 2;
/// Edge of the cells that are coarse or fine, class millimetres, and in usual ways between points. With those around it a cell
/// has 100 ways and more then.
const CELL: [f64; 2] = [15.0, 4.0];
/// Fewer ways tell nothing of a cell of its own.
const FEWEST: usize = 24;

/// How coarse a scan is, part by part.
#[derive(Debug, Default)]
pub struct Coarse {
    edge: f64,
    /// One sigma of the error in cells that have points; none of a fine scan.
    cells: BTreeMap<Cube, f64>,
    /// The same elsewhere.
    whole: f64,
}

/// A straight way between two neighbouring points.
struct Way {
    middle: Point,
    length: f64,
    /// How high a round surface rises above it.
    rise: f64,
}

impl Way {
    fn new(middle: Point, length: f64, cosine: f64) -> Self {
        Self { middle, length, rise: length * libm::acos(cosine.clamp(-1.0, 1.0)) / 8.0 }
    }
}

impl Coarse {
    /// How coarse a scan is; `millimetre` is one class millimetre.
    pub fn of(scan: &Mesh, millimetre: f64) -> Self {
        let coarse = COARSE * millimetre;
        let fine = if scan.is_cloud() { scan.points.len() > MANY } else { is_fine(scan, coarse) };
        if fine {
            return Self::default();
        }
        let ways = if scan.is_cloud() { between_points(scan) } else { across_edges(scan) };
        let usual = median(ways.iter().map(|way| way.length).collect()).unwrap_or(0.0);
        let [least, times] = CELL;
        let edge = (least * millimetre).max(times * usual);
        let mut by_cell: BTreeMap<Cube, Vec<&Way>> = BTreeMap::new();
        for way in &ways {
            by_cell.entry(cube(&way.middle, edge)).or_default().push(way);
        }
        let of_cell = |at: &Cube| {
            let near = around(*at).filter_map(|cell| by_cell.get(&cell));
            let ways: Vec<&Way> = near.flatten().copied().collect();
            (ways.len() >= FEWEST).then(|| (*at, one_sigma(&ways, coarse)))
        };
        let cells = by_cell.keys().filter_map(of_cell).collect();
        Self { edge, cells, whole: one_sigma(&ways.iter().collect::<Vec<_>>(), coarse) }
    }

    /// One sigma of what a surface through the scan is off at a place for that, in the scan's unit.
    pub fn error(&self, place: &Point) -> f64 {
        if self.cells.is_empty() {
            return self.whole;
        }
        self.cells.get(&cube(place, self.edge)).copied().unwrap_or(self.whole)
    }
}

/// What more than a third of the ways rise above; 0 if most are shorter than `coarse`.
fn one_sigma(ways: &[&Way], coarse: f64) -> f64 {
    let apart = median(ways.iter().map(|way| way.length).collect()).unwrap_or(0.0);
    if apart < coarse {
        return 0.0;
    }
    let mut rises: Vec<f64> = ways.iter().map(|way| way.rise).collect();
    rises.sort_by(f64::total_cmp);
    quantile(&rises, SHARE).unwrap_or(0.0)
}

/// Whether nearly all of a mesh's area is in triangles with shorter sides.
fn is_fine(mesh: &Mesh, coarse: f64) -> bool {
    let (mut long, mut all) = (0.0, 0.0);
    for number in 0..mesh.triangles.len() {
        let area = mesh.area_of(number);
        let [_, _, longest] = mesh.sides_of(number);
        (long, all) = (long + if longest < coarse { 0.0 } else { area }, all + area);
    }
    long <= RIM * all
}

/// The ways along edges between two triangles.
fn across_edges(mesh: &Mesh) -> Vec<Way> {
    let normal = |side: u32| mesh.normal_of(side as usize / 3);
    let inner = Edges::of(mesh).list.into_iter().filter(|edge| edge.uses == 2);
    let way = |edge: Edge| {
        let [a, b] = edge.ends.map(|v| mesh.points[v as usize]);
        let [one, other] = edge.sides.map(normal);
        Way::new(nalgebra::center(&a, &b), (a - b).norm(), one.dot(&other))
    };
    inner.map(way).collect()
}

/// The ways of points to their second neighbour.
fn between_points(cloud: &Mesh) -> Vec<Way> {
    let pairs = neighbours(&cloud.points, &cloud.vertex_normals(), NEAREST);
    pairs.into_iter().map(|pair| Way::new(cloud.points[pair.point], pair.distance, pair.cosine)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A ball of radius 10 as a mesh of about `n`² vertices, and as a cloud with normals.
    fn balls(n: usize) -> [Mesh; 2] {
        let mesh = crate::surface::shapes::ball(n, 0.4 * n as f64);
        let scale = 25.0 / n as f64;
        let mesh = Mesh { points: mesh.points.iter().map(|p| p * scale).collect(), ..mesh };
        let cloud = Mesh { normals: mesh.vertex_normals(), triangles: vec![], ..mesh.clone() };
        [mesh, cloud]
    }

    /// Errors at the vertices.
    fn errors(scan: &Mesh, millimetre: f64) -> Vec<f64> {
        let coarse = Coarse::of(scan, millimetre);
        scan.points.iter().map(|p| coarse.error(p)).collect()
    }

    #[test]
    fn between_far_points_a_ball_rises_as_it_does() {
        let (coarse, fine) = (balls(12), balls(48));
        for (kind, (coarse, fine)) in ["mesh", "cloud"].into_iter().zip(coarse.iter().zip(&fine)) {
            let found = errors(coarse, 0.1);
            // Vertices lie a cell of 2.1 apart at most: less than 2.1² · 2 / 80 above the straight way.
            assert!(found.iter().all(|found| (0.01..0.11).contains(found)), "{kind}: {found:?}");
            assert!(errors(fine, 1.0).iter().all(|&found| found == 0.0), "{kind}: fine enough");
            let [found, finer] = [found, errors(fine, 0.01)].map(|errors| median(errors).unwrap_or(9.0));
            assert!(finer < found / 8.0, "{kind}: {finer} of {found}, a quarter the distance");
        }
    }

    #[test]
    fn a_scan_may_be_coarse_in_one_part_and_fine_in_another() {
        let (coarse, fine) = (balls(12), balls(48));
        for (kind, (coarse, fine)) in ["mesh", "cloud"].into_iter().zip(coarse.iter().zip(&fine)) {
            let alone = median(errors(coarse, 0.3)).unwrap_or(0.0);
            let (mut both, count) = (fine.clone(), fine.points.len());
            both.points.extend(coarse.points.iter().map(|p| p + crate::mesh::Vector::x() * 40.0));
            both.normals.extend(&coarse.normals);
            let corner = |corner: u32| corner + count as u32;
            both.triangles.extend(coarse.triangles.iter().map(|corners| corners.map(corner)));
            let mut at_fine = errors(&both, 0.3);
            let at_coarse = at_fine.split_off(count);
            assert_eq!(at_fine.into_iter().fold(0.0, f64::max), 0.0, "{kind}");
            let found = median(at_coarse).unwrap_or(0.0);
            assert!((0.8..1.25).contains(&(found / alone)), "{kind}: {found}, alone {alone}");
        }
    }

    #[test]
    fn nothing_rises_over_nothing() {
        assert_eq!(Coarse::of(&Mesh::default(), 1.0).error(&Point::origin()), 0.0);
    }
}
