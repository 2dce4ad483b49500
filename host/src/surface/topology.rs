//! Connectivity of a mesh: its edges, its rim, and whether it is a manifold.

use crate::mesh::Mesh;

/// An edge and the triangle sides that lie on it. Side `s` belongs to triangle s / 3 and runs from
/// its corner s % 3 to the next one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Edge {
    /// The vertices at its ends, the smaller index first.
    pub ends: [u32; 2],
    /// How many sides lie on it.
    pub uses: u32,
    /// Its first two sides in the order of the triangles; the same one twice if there is only one.
    pub sides: [u32; 2],
}

/// All edges of a mesh.
#[derive(Clone, Debug, Default)]
pub struct Edges {
    /// The edges, sorted by `ends`.
    pub list: Vec<Edge>,
    /// The edge each triangle side lies on, as an index into `list`: 3 by number of triangles.
    pub of_side: Vec<u32>,
    /// The vertex each side starts from.
    starts: Vec<u32>,
}

impl Edges {
    /// Collects the edges: sides are dealt out to their smaller vertex, then sorted there.
    pub fn of(mesh: &Mesh) -> Self {
        let starts = mesh.triangles.as_flattened().to_vec();
        let mut edges =
            Self { list: Vec::with_capacity(starts.len() / 2), of_side: vec![0; starts.len()], starts };
        let (first, mut dealt) = edges.deal(mesh.points.len());
        for (low, range) in first.windows(2).enumerate() {
            let sides = &mut dealt[range[0] as usize..range[1] as usize];
            sides.sort_unstable();
            sides.chunk_by(|a, b| a.0 == b.0).for_each(|same| edges.push(low as u32, same));
        }
        edges
    }

    /// The sides as (larger vertex, side), grouped by the smaller vertex, and where each group begins.
    fn deal(&self, vertices: usize) -> (Vec<u32>, Vec<(u32, u32)>) {
        let ends = |side: usize| [self.starts[side], self.starts[next(side)]];
        let mut place = vec![0; vertices + 2];
        for side in 0..self.starts.len() {
            place[ends(side)[0].min(ends(side)[1]) as usize + 2] += 1;
        }
        (2..place.len()).for_each(|i| place[i] += place[i - 1]);
        let mut dealt = vec![(0, 0); self.starts.len()];
        for side in 0..self.starts.len() {
            let [a, b] = ends(side);
            let slot = &mut place[a.min(b) as usize + 1];
            dealt[*slot as usize] = (a.max(b), side as u32);
            *slot += 1;
        }
        place.pop();
        (place, dealt)
    }

    fn push(&mut self, low: u32, same: &[(u32, u32)]) {
        let index = self.list.len() as u32;
        same.iter().for_each(|&(_, side)| self.of_side[side as usize] = index);
        let sides = [same[0].1, same[same.len().min(2) - 1].1];
        self.list.push(Edge { ends: [low, same[0].0], uses: same.len() as u32, sides });
    }

    /// The edges with a single triangle, each in the direction of that triangle.
    pub fn boundary(&self) -> impl Iterator<Item = [u32; 2]> {
        self.list.iter().filter(|edge| edge.uses == 1).map(|edge| {
            let [a, b] = edge.ends;
            if self.start(edge.sides[0]) == a { [a, b] } else { [b, a] }
        })
    }

    /// How many edges have more than two triangles, or two that run the same way along it, or join
    /// a vertex to itself.
    pub fn non_manifold(&self) -> usize {
        self.list.iter().filter(|edge| !self.is_clean(edge)).count()
    }

    fn is_clean(&self, edge: &Edge) -> bool {
        let opposite = self.start(edge.sides[0]) != self.start(edge.sides[1]);
        edge.ends[0] != edge.ends[1] && (edge.uses == 1 || edge.uses == 2 && opposite)
    }

    fn start(&self, side: u32) -> u32 {
        self.starts[side as usize]
    }
}

/// The side that follows in the same triangle.
fn next(side: usize) -> usize {
    if side % 3 == 2 { side - 2 } else { side + 1 }
}

/// The edges with a single triangle, each in the direction of that triangle.
pub fn boundary_edges(mesh: &Mesh) -> Vec<[u32; 2]> {
    Edges::of(mesh).boundary().collect()
}

/// Is the mesh an oriented manifold, open or closed? Every edge has one triangle or two that run
/// along it in opposite directions, and the triangles around a vertex form a single fan.
pub fn is_manifold(mesh: &Mesh) -> bool {
    let edges = Edges::of(mesh);
    edges.non_manifold() == 0 && single_fans(mesh, &edges)
}

/// Walks around every vertex: to the start of an open fan, then through it. A fan that is the only
/// one comes past all triangles of its vertex.
fn single_fans(mesh: &Mesh, edges: &Edges) -> bool {
    let mut corners = vec![0_u32; mesh.points.len()];
    edges.starts.iter().for_each(|&v| corners[v as usize] += 1);
    let mut seen = vec![false; mesh.points.len()];
    (0..edges.starts.len()).all(|corner| {
        let vertex = edges.starts[corner] as usize;
        std::mem::replace(&mut seen[vertex], true) || fan_size(edges, corner) == corners[vertex]
    })
}

/// How many triangles hang together around the vertex at which side `corner` starts. All edges must
/// be clean.
fn fan_size(edges: &Edges, corner: usize) -> u32 {
    let backwards = std::iter::successors(Some(corner), |&at| across(edges, at).map(next));
    let (mut start, mut size) = (corner, 0);
    for at in backwards.skip(1) {
        size += 1;
        if at == corner {
            return size;
        }
        start = at;
    }
    let previous = |at: usize| next(next(at));
    1 + std::iter::successors(Some(start), |&at| across(edges, previous(at))).skip(1).count() as u32
}

/// The other side on the edge of a side.
fn across(edges: &Edges, side: usize) -> Option<usize> {
    let edge = &edges.list[edges.of_side[side] as usize];
    let other = edge.sides[usize::from(edge.sides[0] as usize == side)];
    (edge.uses == 2).then_some(other as usize)
}

#[cfg(test)]
mod tests {
    use super::super::shapes::{ball, fans, sheet};
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn a_sheet_has_a_rim() {
        let mesh = sheet(5);
        assert!(is_manifold(&mesh));
        assert_eq!(boundary_edges(&mesh).len(), 16);
        let rim: BTreeSet<u32> = boundary_edges(&mesh).into_iter().flatten().collect();
        assert_eq!(rim.len(), 16);
        let edges = Edges::of(&mesh);
        assert!(edges.boundary().all(|[a, b]| {
            mesh.triangles.iter().any(|t| (0..3).any(|k| [t[k], t[(k + 1) % 3]] == [a, b]))
        }));
    }

    #[test]
    fn eulers_formula_holds_for_a_ball() {
        let mesh = ball(12, 4.0);
        let edges = Edges::of(&mesh);
        assert_eq!(mesh.points.len() + mesh.triangles.len(), edges.list.len() + 2);
        assert_eq!(edges.list.len() * 2, edges.of_side.len());
        assert!(edges.list.is_sorted_by_key(|edge| edge.ends));
    }

    #[test]
    fn finds_edges_with_three_triangles_and_flipped_neighbours() {
        let mut mesh = sheet(2);
        mesh.triangles.push([0, 1, 2]);
        assert!(Edges::of(&mesh).non_manifold() > 0 && !is_manifold(&mesh));
        let mut mesh = sheet(2);
        mesh.triangles[0].swap(0, 1);
        assert_eq!(Edges::of(&mesh).non_manifold(), 1);
        assert!(!is_manifold(&mesh));
    }

    #[test]
    fn finds_two_fans_at_one_vertex() {
        let mut mesh = sheet(3);
        mesh.triangles = vec![[0, 1, 4], [4, 5, 8]];
        assert_eq!(Edges::of(&mesh).non_manifold(), 0);
        assert!(!is_manifold(&mesh));
        assert_eq!(fans(&mesh)[4], 2);
    }

    #[test]
    fn odd_meshes_do_no_harm() {
        assert!(is_manifold(&Mesh::default()));
        let mut mesh = sheet(2);
        mesh.triangles = vec![[1, 1, 2], [3, 3, 3]];
        assert!(!is_manifold(&mesh));
        mesh.triangles.clear();
        assert!(boundary_edges(&mesh).is_empty());
    }
}
