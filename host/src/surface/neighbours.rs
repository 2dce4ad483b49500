//! The vertices around each vertex of a mesh.

use crate::mesh::Mesh;

/// The neighbours of vertices, one list after the other; a neighbour is there once for each triangle it shares.
pub struct Neighbours {
    /// Where the neighbours of each vertex end in the list; those of the one before end where they begin.
    ends: Vec<u32>,
    list: Vec<u32>,
}

impl Neighbours {
    /// The neighbours of those vertices that are `wanted`; the others have none.
    pub fn new(mesh: &Mesh, wanted: impl Fn(u32) -> bool) -> Self {
        let pairs = || mesh.triangles.iter().copied().flat_map(corner_pairs).filter(|&(of, _)| wanted(of));
        let mut ends = vec![0u32; mesh.points.len()];
        pairs().for_each(|(of, _)| ends[of as usize] += 1);
        let mut sum = 0;
        // Where each list begins; filling moves that to its end.
        for end in &mut ends {
            sum += std::mem::replace(end, sum);
        }
        let mut list = vec![0; sum as usize];
        for (of, neighbour) in pairs() {
            list[ends[of as usize] as usize] = neighbour;
            ends[of as usize] += 1;
        }
        Self { ends, list }
    }

    /// The neighbours of a vertex.
    pub fn of(&self, vertex: u32) -> &[u32] {
        let v = vertex as usize;
        let start = if v == 0 { 0 } else { self.ends[v - 1] };
        &self.list[start as usize..self.ends[v] as usize]
    }
}

/// Every corner of a triangle with each of the two others. Sums over neighbours are rounded in this order: another one
/// changes their last bits.
pub fn corner_pairs([a, b, c]: [u32; 3]) -> [(u32, u32); 6] {
    [(a, b), (b, a), (b, c), (c, b), (c, a), (a, c)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::shapes::sheet;

    #[test]
    fn vertices_have_the_neighbours_of_all_their_triangles() {
        // Two triangles, 0 1 3 and 0 3 2, and a vertex of none.
        let mut mesh = sheet(2);
        mesh.points.push(mesh.points[0]);
        let all = Neighbours::new(&mesh, |_| true);
        assert_eq!(all.of(0), [1, 3, 3, 2]);
        assert_eq!((all.of(1), all.of(2)), (&[0, 3][..], &[3, 0][..]));
        assert!(all.of(4).is_empty());
        let some = Neighbours::new(&mesh, |v| v == 3);
        assert!(some.of(0).is_empty() && some.of(3).len() == 4);
    }
}
