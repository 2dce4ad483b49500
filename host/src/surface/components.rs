//! The connected pieces of a mesh.

use crate::mesh::Mesh;

/// For each triangle the number of its piece; triangles that share a vertex, directly or through
/// others, are one piece. Pieces are numbered in the order of their first triangles.
pub fn components(mesh: &Mesh) -> Vec<u32> {
    let mut parents: Vec<u32> = (0..mesh.points.len() as u32).collect();
    for &[a, b, c] in &mesh.triangles {
        join(&mut parents, a, b);
        join(&mut parents, b, c);
    }
    let (mut numbers, mut count) = (vec![u32::MAX; parents.len()], 0);
    let mut number = |root: u32| {
        let number = &mut numbers[root as usize];
        if *number == u32::MAX {
            (*number, count) = (count, count + 1);
        }
        *number
    };
    mesh.triangles.iter().map(|t| number(root(&mut parents, t[0]))).collect()
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

/// The piece with the most triangles, the first of them in a tie, without any other vertices.
/// Empty for a mesh without triangles.
pub fn largest_component(mesh: &Mesh) -> Mesh {
    let pieces = components(mesh);
    let mut sizes = vec![0_usize; pieces.iter().max().map_or(0, |&last| last as usize + 1)];
    pieces.iter().for_each(|&piece| sizes[piece as usize] += 1);
    let largest = (0..sizes.len()).rev().max_by_key(|&piece| sizes[piece]);
    keep_triangles(mesh, |triangle| Some(pieces[triangle] as usize) == largest)
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
