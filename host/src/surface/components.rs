//! The connected pieces of a mesh or a cloud.

use crate::cubes::{Cube, around, cube};
use crate::mesh::{Mesh, Point, bounds};
use rustc_hash::FxHashMap;

/// For each triangle the number of its piece; triangles that share a vertex, directly or through
/// others, are one piece. Pieces are numbered in the order of their first triangles.
pub fn components(mesh: &Mesh) -> Vec<u32> {
    let mut parents: Vec<u32> = (0..mesh.points.len() as u32).collect();
    for &[a, b, c] in &mesh.triangles {
        join(&mut parents, a, b);
        join(&mut parents, b, c);
    }
    numbered(mesh.triangles.iter().map(|t| root(&mut parents, t[0])), mesh.points.len())
}

/// For each triangle of a mesh the number of its piece, or for each point of a cloud.
pub fn pieces(mesh: &Mesh) -> Vec<u32> {
    if mesh.is_cloud() { cloud_components(&mesh.points, cloud_cell(&mesh.points)) } else { components(mesh) }
}

/// What of a mesh's triangles, or of a cloud's points, `keep` says yes to; order and normals stay.
pub fn keep(mesh: &Mesh, keep: impl Fn(usize) -> bool) -> Mesh {
    if mesh.is_cloud() { keep_points(mesh, keep) } else { keep_triangles(mesh, keep) }
}

/// For each point of a cloud the number of its piece; points in the same cube of edge `cell` or in cubes that touch,
/// directly or through others, are one piece. Pieces are numbered in the order of their first points.
fn cloud_components(points: &[Point], cell: f64) -> Vec<u32> {
    let mut cubes: FxHashMap<Cube, u32> = FxHashMap::default();
    let keys: Vec<Cube> = points.iter().map(|p| cube(p, cell)).collect();
    let cube_of: Vec<u32> = keys.iter().map(|&key| next_number(&mut cubes, key)).collect();
    let mut parents: Vec<u32> = (0..cubes.len() as u32).collect();
    for (key, &own) in &cubes {
        for near in around(*key) {
            if let Some(&near) = cubes.get(&near) {
                join(&mut parents, own, near);
            }
        }
    }
    numbered(cube_of.iter().map(|&cube| root(&mut parents, cube)), cubes.len())
}

/// The least cubes, from about the distance between points on, of which a cloud occupies at most half as many as it
/// has points.
fn cloud_cell(points: &[Point]) -> f64 {
    const GROWTH: f64 = 1.25;
    let extent = bounds(points.iter().copied()).map_or(0.0, |(low, high)| (high - low).max());
    let mut cell = extent / (points.len().max(1) as f64).sqrt() / 2.0;
    let occupied = |cell: f64| {
        let mut cubes: FxHashMap<Cube, u32> = FxHashMap::default();
        points.iter().for_each(|p| _ = next_number(&mut cubes, cube(p, cell)));
        cubes.len()
    };
    while cell.is_normal() && cell < extent && 2 * occupied(cell) > points.len() {
        cell *= GROWTH;
    }
    cell.max(f64::MIN_POSITIVE)
}

/// The number of a cube: as many as there were before, if it is new.
fn next_number(cubes: &mut FxHashMap<Cube, u32>, key: Cube) -> u32 {
    let next = cubes.len() as u32;
    *cubes.entry(key).or_insert(next)
}

/// Numbers of pieces, told by their roots among `count`, in the order of their first members.
fn numbered(roots: impl Iterator<Item = u32>, count: usize) -> Vec<u32> {
    let (mut numbers, mut next) = (vec![u32::MAX; count], 0);
    let number = |root: u32| {
        let number = &mut numbers[root as usize];
        if *number == u32::MAX {
            (*number, next) = (next, next + 1);
        }
        *number
    };
    roots.map(number).collect()
}

/// The root of a vertex's tree; the path to it is halved on the way.
fn root(parents: &mut [u32], mut vertex: u32) -> u32 {
    while parents[vertex as usize] != vertex {
        let grandparent = parents[parents[vertex as usize] as usize];
        parents[vertex as usize] = grandparent;
        vertex = grandparent;
    }
    vertex
}

fn join(parents: &mut [u32], a: u32, b: u32) {
    let (a, b) = (root(parents, a), root(parents, b));
    parents[a.max(b) as usize] = a.min(b);
}

/// The number of members of each piece; `pieces` has the number of each member's.
pub fn sizes(pieces: &[u32]) -> Vec<usize> {
    let mut sizes = vec![0; pieces.iter().max().map_or(0, |&last| last as usize + 1)];
    pieces.iter().for_each(|&piece| sizes[piece as usize] += 1);
    sizes
}

/// The piece with the most triangles, the first of them in a tie, without any other vertices.
/// Empty for a mesh without triangles.
pub fn largest_component(mesh: &Mesh) -> Mesh {
    let pieces = components(mesh);
    let sizes = sizes(&pieces);
    let largest = (0..sizes.len()).rev().max_by_key(|&piece| sizes[piece]);
    keep_triangles(mesh, |triangle| Some(pieces[triangle] as usize) == largest)
}

/// The cloud of the points for whose index `keep` says yes, with their normals.
fn keep_points(cloud: &Mesh, keep: impl Fn(usize) -> bool) -> Mesh {
    let kept: Vec<usize> = (0..cloud.points.len()).filter(|&i| keep(i)).collect();
    Mesh {
        points: kept.iter().map(|&i| cloud.points[i]).collect(),
        normals: kept.iter().filter_map(|&i| cloud.normals.get(i).copied()).collect(),
        triangles: vec![],
    }
}

/// The mesh of the triangles for whose index `keep` says yes and of their vertices; order and
/// normals stay.
pub fn keep_triangles(mesh: &Mesh, keep: impl Fn(usize) -> bool) -> Mesh {
    let kept = || (0..mesh.triangles.len()).filter(|&t| keep(t)).map(|t| mesh.triangles[t]);
    let mut used = vec![false; mesh.points.len()];
    kept().flatten().for_each(|v| used[v as usize] = true);
    let vertices: Vec<usize> = (0..used.len()).filter(|&v| used[v]).collect();
    let mut places = vec![0; used.len()];
    vertices.iter().enumerate().for_each(|(place, &v)| places[v] = place as u32);
    Mesh {
        points: vertices.iter().map(|&v| mesh.points[v]).collect(),
        normals: vertices.iter().filter_map(|&v| mesh.normals.get(v).copied()).collect(),
        triangles: kept().map(|t| t.map(|v| places[v as usize])).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::super::shapes::{ball, joined, sheet};
    use super::*;
    use crate::mesh::{Point, Vector};

    #[test]
    fn pieces_of_a_cloud_are_those_of_its_mesh() {
        let (near, mut far) = (sheet(12), sheet(4));
        far.points.iter_mut().for_each(|p| p.x += 40.0);
        let cell = cloud_cell(&near.points);
        assert!((1.0..3.0).contains(&cell), "{cell} where points are 1 apart");
        let all = joined(&near, &far);
        let pieces = cloud_components(&all.points, cell);
        let first = near.points.len();
        assert!(pieces[..first].iter().all(|&p| p == 0) && pieces[first..].iter().all(|&p| p == 1));
        assert_eq!(keep_points(&all, |i| pieces[i] == 1).points, far.points);
        assert!(cloud_components(&[], 1.0).is_empty() && cloud_cell(&[]) > 0.0);
        let one = [Point::new(1e300, 0.0, 0.0); 3];
        assert_eq!(cloud_components(&one, cloud_cell(&one)), [0; 3]);
    }

    #[test]
    fn finds_the_largest_of_three_pieces() {
        let (small, large) = (sheet(4), ball(12, 4.0));
        let mesh = joined(&joined(&small, &large), &small);
        let pieces = components(&mesh);
        assert!(pieces.is_sorted());
        assert_eq!(pieces.last(), Some(&2));
        assert_eq!(largest_component(&mesh), large);
    }

    #[test]
    fn the_first_of_two_equal_pieces_wins() {
        let mut other = sheet(3);
        other.points.iter_mut().for_each(|p| p.z = 1.0);
        assert_eq!(largest_component(&joined(&sheet(3), &other)), sheet(3));
    }

    #[test]
    fn normals_follow_their_vertices() {
        let mut mesh = sheet(3);
        mesh.normals = mesh.points.iter().map(|p| p.coords).collect();
        let kept = keep_triangles(&mesh, |t| t >= 4);
        assert!(kept.points.len() < mesh.points.len());
        assert!(kept.points.iter().zip(&kept.normals).all(|(p, n)| p.coords == *n));
    }

    #[test]
    fn a_cloud_has_no_pieces() {
        let cloud = Mesh { points: vec![Point::origin()], normals: vec![Vector::x()], triangles: Vec::new() };
        assert_eq!(largest_component(&cloud), Mesh::default());
        assert_eq!(largest_component(&Mesh::default()), Mesh::default());
    }
}
