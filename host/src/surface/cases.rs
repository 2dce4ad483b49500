//! The case table of marching cubes: which triangles a cell gets for each of its 256 sign patterns.
//!
//! Corner `c` of a cell stands at the offset (c & 1, c >> 1 & 1, c >> 2 & 1). Edge `e` runs along
//! axis e / 4; the two low bits of e are its offsets along the next two axes in cyclic order.
//!
//! On each of the six faces every run of inside corners is cut off by a segment of its own. That
//! rule looks at the signs of the face only, so that the cells on both sides of it agree. The
//! segments join to closed loops over the cell, and the loops are filled with triangles whose inner
//! diagonals never lie in a face: there the neighbouring cell could draw the same diagonal and the
//! edge would have four triangles. Under this rule such a filling exists for all 256 patterns, so
//! that no cell needs a vertex in its middle.

use std::sync::LazyLock;

/// Most triangles a cell can have.
pub const MOST_TRIANGLES: usize = 5;

/// Longest loop over a cell's faces.
const LONGEST_LOOP: usize = 7;

/// The triangles of one sign pattern, as the edges their corners lie on, counter-clockwise seen
/// from the positive side.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Case {
    count: u8,
    triangles: [[u8; 3]; MOST_TRIANGLES],
}

impl Case {
    /// The triangles.
    pub fn triangles(&self) -> &[[u8; 3]] {
        &self.triangles[..usize::from(self.count)]
    }
}

/// One case for each pattern; bit `c` of the index is set where corner `c` is inside.
pub static CASES: LazyLock<[Case; 256]> = LazyLock::new(|| std::array::from_fn(|signs| case(signs as u8)));

/// The corner at the lower end of an edge.
pub const fn low_corner(edge: usize) -> usize {
    let axis = edge / 4;
    (edge & 1) << ((axis + 1) % 3) | (edge >> 1 & 1) << ((axis + 2) % 3)
}

fn case(signs: u8) -> Case {
    let mut case = Case::default();
    for triangle in loops(signs).iter().flat_map(|path| fill(path)) {
        case.triangles[usize::from(case.count)] = triangle;
        case.count += 1;
    }
    case
}

/// The edge between two neighbouring corners.
fn edge_between(p: usize, q: usize) -> usize {
    let (axis, low) = ((p ^ q).trailing_zeros() as usize, p & q);
    4 * axis + (low >> ((axis + 1) % 3) & 1) + 2 * (low >> ((axis + 2) % 3) & 1)
}

/// The corners of a face, counter-clockwise seen from outside the cell.
fn ring(axis: usize, upper: bool) -> [usize; 4] {
    let (b, c) = (1 << ((axis + 1) % 3), 1 << ((axis + 2) % 3));
    if upper { [0, b, b | c, c].map(|corner| corner | 1 << axis) } else { [0, c, b | c, b] }
}

/// The segments on a face, from edge to edge: one for each run of inside corners, from where the
/// ring enters the run to where it leaves it.
fn segments(signs: u8, ring: [usize; 4]) -> impl Iterator<Item = (usize, usize)> {
    let inside = move |i: usize| signs >> ring[i % 4] & 1 == 1;
    let edge = move |i: usize| edge_between(ring[i % 4], ring[(i + 1) % 4]);
    (0..4).filter(move |&i| !inside(i) && inside(i + 1)).filter_map(move |i| {
        let exit = (i + 1..i + 4).find(|&j| inside(j) && !inside(j + 1))?;
        Some((edge(i), edge(exit)))
    })
}

/// The closed loops of edges that the surface passes through.
fn loops(signs: u8) -> Vec<Vec<usize>> {
    let mut next = [None; 12];
    for (axis, upper) in (0..3).flat_map(|axis| [(axis, false), (axis, true)]) {
        segments(signs, ring(axis, upper)).for_each(|(from, to)| next[from] = Some(to));
    }
    let follow = |start: usize| {
        let mut at = start;
        std::iter::from_fn(|| {
            at = next[at].take()?;
            Some(at)
        })
        .collect::<Vec<_>>()
    };
    (0..12).map(follow).filter(|path| !path.is_empty()).collect()
}

/// One bit for each of the two faces an edge belongs to.
fn faces(edge: usize) -> u8 {
    let axis = edge / 4;
    1 << (2 * ((axis + 1) % 3) + (edge & 1)) | 1 << (2 * ((axis + 2) % 3) + (edge >> 1 & 1))
}

/// Squared distance between the middles of two edges, in half edge lengths.
fn distance(p: usize, q: usize) -> usize {
    let middle = |edge: usize, axis: usize| {
        if edge / 4 == axis { 1 } else { 2 * (low_corner(edge) >> axis & 1) }
    };
    (0..3).map(|axis| middle(p, axis).abs_diff(middle(q, axis)).pow(2)).sum()
}

/// Fills a loop with triangles: of all ways without a diagonal in a face the one with the shortest
/// diagonals. `best[i][j]` is the cost of the part of the loop from i to j and its apex.
fn fill(path: &[usize]) -> Vec<[u8; 3]> {
    let mut best = [[Some((0, 0)); LONGEST_LOOP]; LONGEST_LOOP];
    for span in 2..path.len() {
        for (i, j) in (0..path.len() - span).map(|i| (i, i + span)) {
            let apex = |k: usize| Some((best[i][k]?.0 + best[k][j]?.0, k));
            let shortest = (i + 1..j).filter_map(apex).min();
            best[i][j] = shortest.and_then(|(cost, k)| Some((cost + diagonal(path, i, j)?, k)));
        }
    }
    let mut triangles = Vec::new();
    let mut open = vec![(0, path.len() - 1)];
    while let Some((i, j)) = open.pop() {
        if let Some((_, k)) = best[i][j].filter(|_| j > i + 1) {
            triangles.push([i, k, j].map(|at| path[at] as u8));
            open.extend([(k, j), (i, k)]);
        }
    }
    triangles
}

/// The cost of joining two places of a loop; `None` where that is not allowed.
fn diagonal(path: &[usize], i: usize, j: usize) -> Option<usize> {
    if (i, j) == (0, path.len() - 1) {
        return Some(0);
    }
    (faces(path[i]) & faces(path[j]) == 0).then(|| distance(path[i], path[j]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_loop_is_filled_completely() {
        for signs in 0..=255 {
            let wanted: usize = loops(signs).iter().map(|path| path.len() - 2).sum();
            assert_eq!(CASES[usize::from(signs)].triangles().len(), wanted, "{signs:08b}");
        }
    }

    #[test]
    fn loops_pass_exactly_the_edges_that_change_sign() {
        for signs in 0..=255_u8 {
            let mut passed = loops(signs).concat();
            passed.sort_unstable();
            let inside = |corner: usize| signs >> corner & 1;
            let axis = |edge: usize| 1 << (edge / 4);
            let changes = |&e: &usize| inside(low_corner(e)) != inside(low_corner(e) | axis(e));
            assert_eq!(passed, (0..12).filter(changes).collect::<Vec<_>>(), "{signs:08b}");
        }
    }

    /// Directed triangle sides without a partner in the same cell lie on faces, and are the segments
    /// of these faces; all others are diagonals between faces.
    #[test]
    fn open_sides_are_the_segments_of_the_faces() {
        for signs in 0..=255 {
            let sides: Vec<_> = CASES[usize::from(signs)]
                .triangles()
                .iter()
                .flat_map(|t| (0..3).map(|k| (usize::from(t[k]), usize::from(t[(k + 1) % 3]))))
                .collect();
            let mut open: Vec<_> = sides.iter().copied().filter(|&(a, b)| !sides.contains(&(b, a))).collect();
            let mut wanted: Vec<_> = (0..3)
                .flat_map(|axis| [ring(axis, false), ring(axis, true)])
                .flat_map(|ring| segments(signs, ring).collect::<Vec<_>>())
                .collect();
            open.sort_unstable();
            wanted.sort_unstable();
            assert_eq!(open, wanted, "{signs:08b}");
            let inner = sides.iter().filter(|&side| !wanted.contains(side));
            inner.for_each(|&(a, b)| assert_eq!(faces(a) & faces(b), 0, "{signs:08b}"));
        }
    }

    #[test]
    fn neighbouring_cells_draw_the_same_segments_in_opposite_directions() {
        for (axis, signs) in (0..3).flat_map(|axis| (0..=255_u8).map(move |signs| (axis, signs))) {
            // The neighbour repeats the upper face as its lower one; its other corners do not matter.
            let moved = (0..8).filter(|c| c >> axis & 1 == 1 && signs >> c & 1 == 1);
            let neighbour = moved.map(|c| 1 << (c ^ 1 << axis)).fold(0, |all: u8, bit: u8| all | bit);
            let shift = |(from, to): (usize, usize)| {
                let raise = |e: usize| {
                    let (low, high) = (low_corner(e), low_corner(e) | 1 << (e / 4));
                    edge_between(low | 1 << axis, high | 1 << axis)
                };
                (raise(to), raise(from))
            };
            let mut here: Vec<_> = segments(signs, ring(axis, true)).collect();
            let mut there: Vec<_> = segments(neighbour, ring(axis, false)).map(shift).collect();
            here.sort_unstable();
            there.sort_unstable();
            assert_eq!(here, there);
        }
    }
}
