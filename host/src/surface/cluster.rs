//! Vertices closer together than anything needs become one: vertex clustering (Rossignac & Borrel 1993), the vertices of
//! a cube at their mean.

use crate::cubes::{Cube, cube};
use crate::mesh::{Mesh, Point, Vector};
use crate::points::main_axis;
use crate::surface::keep_triangles;
use rustc_hash::{FxHashMap, FxHashSet};

/// What is worth it leaves at most this share of the places.
const WORTH: f64 = 0.5;
/// Share of one side's vertices from which on what faces the other way is another side, and not noise.
const OTHER: f64 = 0.5;

/// The mesh or cloud with one vertex for those of a cube of edge `cell`, or one for each side of a thin part in it, in the
/// order of the first of them; `normals` are the vertices'. `None` where that would leave more than half of the `places`
/// that the vertices have.
pub fn clustered(mesh: &Mesh, normals: &[Vector], places: usize, cell: f64) -> Option<Mesh> {
    let mut sides: FxHashMap<Cube, Sides> = FxHashMap::default();
    for (p, normal) in mesh.points.iter().zip(normals) {
        sides.entry(cube(p, cell)).or_default().add(normal);
    }
    if sides.len() as f64 > WORTH * places as f64 {
        return None;
    }
    let fronts: FxHashMap<Cube, Option<Vector>> =
        sides.into_iter().map(|(cube, sides)| (cube, sides.front())).collect();
    let mut numbers: FxHashMap<(Cube, bool), u32> = FxHashMap::default();
    let mut sums: Vec<(Vector, Vector, f64)> = Vec::new();
    let mut cluster_of = Vec::with_capacity(mesh.points.len());
    for (p, normal) in mesh.points.iter().zip(normals) {
        let cube = cube(p, cell);
        let behind = fronts.get(&cube).copied().flatten().is_some_and(|front| normal.dot(&front) < 0.0);
        let next = sums.len() as u32;
        let number = *numbers.entry((cube, behind)).or_insert(next);
        if number == next {
            sums.push((Vector::zeros(), Vector::zeros(), 0.0));
        }
        let (place, facing, count) = &mut sums[number as usize];
        (*place, *facing, *count) = (*place + p.coords, *facing + normal, *count + 1.0);
        cluster_of.push(number);
    }
    let unit =
        |(_, normal, _): &(Vector, Vector, f64)| normal.try_normalize(0.0).unwrap_or_else(Vector::zeros);
    let merged = Mesh {
        points: sums.iter().map(|(place, _, count)| Point::from(place / *count)).collect(),
        normals: if mesh.normals.is_empty() { Vec::new() } else { sums.iter().map(unit).collect() },
        triangles: left(mesh, &cluster_of),
    };
    // Without vertices that no triangle is left of.
    Some(if mesh.is_cloud() { merged } else { keep_triangles(&merged, |_| true) })
}

/// The normals in a cube by their main directions.
#[derive(Default)]
struct Sides([(Vector, f64); 6]);

impl Sides {
    fn add(&mut self, normal: &Vector) {
        let (sum, count) = &mut self.0[usize::from(main_axis(normal))];
        (*sum, *count) = (*sum + normal, *count + 1.0);
    }

    /// The way that most vertices face, if there is another side behind them.
    fn front(&self) -> Option<Vector> {
        let most = self.0.iter().max_by(|a, b| a.1.total_cmp(&b.1))?.0;
        let front: Vector = self.0.iter().map(|(sum, _)| sum).filter(|sum| sum.dot(&most) > 0.0).sum();
        let count = |ahead: bool| -> f64 {
            self.0.iter().filter(|(sum, _)| (sum.dot(&front) > 0.0) == ahead).map(|(_, count)| count).sum()
        };
        (count(false) > OTHER * count(true)).then_some(front)
    }
}

/// The triangles whose corners lie in three clusters, each once.
fn left(mesh: &Mesh, cluster_of: &[u32]) -> Vec<[u32; 3]> {
    let mut seen = FxHashSet::default();
    let moved = mesh.triangles.iter().map(|corners| corners.map(|v| cluster_of[v as usize]));
    let first = |&[a, b, c]: &[u32; 3]| {
        let mut sorted = [a, b, c];
        sorted.sort_unstable();
        a != b && b != c && c != a && seen.insert(sorted)
    };
    moved.filter(first).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::Edges;
    use crate::surface::shapes::{ball, sheet};
    use crate::synth::Random;

    #[test]
    fn a_fine_ball_stays_a_closed_ball_of_fewer_vertices() {
        let fine = ball(96, 10.0);
        let coarse =
            clustered(&fine, &fine.normals_of_triangles(), fine.points.len(), 1.5).expect("fine enough");
        assert!(
            coarse.points.len() < fine.points.len() / 2,
            "{} of {}",
            coarse.points.len(),
            fine.points.len()
        );
        assert!((coarse.area() / fine.area() - 1.0).abs() < 0.03, "{} {}", coarse.area(), fine.area());
        let radii = |mesh: &Mesh| {
            let radii = mesh.points.iter().map(|p| p.coords.norm());
            radii.fold((f64::MAX, 0.0f64), |(low, high), r| (low.min(r), high.max(r)))
        };
        let ((nearest, farthest), (least, most)) = (radii(&coarse), radii(&fine));
        assert!(nearest > least - 0.15 && farthest < most + 0.01, "{nearest} {farthest}");
        let open = Edges::of(&coarse).list.iter().filter(|edge| edge.uses < 2).count();
        assert_eq!(open, 0, "no holes");
    }

    #[test]
    fn what_is_coarse_already_stays() {
        let mesh = sheet(9);
        assert_eq!(clustered(&mesh, &mesh.normals_of_triangles(), mesh.points.len(), 1.2), None);
    }

    #[test]
    fn the_two_sides_of_a_thin_part_stay_apart() {
        let mut both = sheet(9);
        let mut back = both.clone();
        back.points.iter_mut().for_each(|p| p.z -= 0.1);
        back.triangles.iter_mut().for_each(|corners| corners.swap(0, 1));
        both.append(&back);
        let merged =
            clustered(&both, &both.normals_of_triangles(), both.points.len(), 4.0).expect("fine enough");
        let heights = merged.points.iter().map(|p| p.z);
        assert!(
            heights.clone().all(|z| z == 0.0 || (z + 0.1).abs() < 1e-12),
            "{:?}",
            heights.collect::<Vec<_>>()
        );
    }

    /// Normals of a surface whose points are closer together than its noise is high are of little use.
    #[test]
    fn noise_makes_no_second_side() {
        let mut random = Random::new(3, 0);
        let mut rough = sheet(40);
        rough.points.iter_mut().for_each(|p| p.z += 1.5 * random.normal());
        let merged = clustered(&rough, &rough.normals_of_triangles(), 1600, 6.0).expect("fine enough");
        assert!(merged.points.len() < 150, "{}", merged.points.len());
    }

    #[test]
    fn points_of_a_cloud_have_unit_normals() {
        let mesh = sheet(9);
        let cloud = Mesh { normals: vec![Vector::new(0.0, 0.6, 0.8); 81], triangles: vec![], ..mesh };
        let merged = clustered(&cloud, &cloud.normals, 81, 3.0).expect("fine enough");
        assert!(merged.is_cloud() && merged.normals.iter().all(|n| (n.norm() - 1.0).abs() < 1e-12));
        assert_eq!(merged.normals.len(), merged.points.len());
    }
}
