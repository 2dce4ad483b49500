//! Nodes of the tree, and the list of those a query has yet to visit.

use super::triangle::Triangle;
use crate::mesh::Point;

/// Children of a node.
pub(super) const LANES: usize = 4;

/// Three entries a level, 31 levels (see `build::DEEP`).
const STACK: usize = 96;

/// A node, or `count` triangles from `first`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Child {
    pub first: u32,
    count: u32,
}

impl Child {
    pub const ROOT: Self = Self { first: 0, count: Self::NODE };
    const NODE: u32 = u32::MAX;
    const NONE: Self = Self { first: 0, count: 0 };

    pub fn node(index: usize) -> Self {
        Self { first: index as u32, count: Self::NODE }
    }

    pub fn leaf(first: usize, count: usize) -> Self {
        Self { first: first as u32, count: count as u32 }
    }

    pub fn is_node(self) -> bool {
        self.count == Self::NODE
    }

    pub fn triangles(self, leaves: &[Triangle]) -> &[Triangle] {
        &leaves[self.first as usize..][..self.count as usize]
    }
}

/// Boxes of four children, coordinate by coordinate; a lane without a child holds a box at infinity.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(super) struct Node {
    pub low: [[f32; LANES]; 3],
    pub high: [[f32; LANES]; 3],
    pub children: [Child; LANES],
}

impl Node {
    pub const EMPTY: Self = Self {
        low: [[f32::INFINITY; LANES]; 3],
        high: [[f32::INFINITY; LANES]; 3],
        children: [Child::NONE; LANES],
    };

    pub fn set(&mut self, lane: usize, low: [f32; 3], high: [f32; 3], child: Child) {
        for axis in 0..3 {
            self.low[axis][lane] = low[axis];
            self.high[axis][lane] = high[axis];
        }
        self.children[lane] = child;
    }

    /// Squared distances from the query to the four boxes, zero inside.
    #[inline]
    fn squared_distances(&self, query: &Query) -> [f32; LANES] {
        let mut sums = [0.0; LANES];
        for axis in 0..3 {
            let p = query.0[axis];
            for (lane, sum) in sums.iter_mut().enumerate() {
                let gap = larger(larger(self.low[axis][lane] - p, p - self.high[axis][lane]), 0.0);
                *sum += gap * gap;
            }
        }
        sums
    }
}

/// One instruction, unlike `f32::max`; `b` if either is NaN.
#[inline]
fn larger(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// A query point, rounded for the boxes.
pub(super) struct Query([f32; 3]);

impl Query {
    #[inline]
    pub fn new(p: &Point) -> Self {
        Self([p.x as f32, p.y as f32, p.z as f32])
    }
}

/// `squared` as a limit for [`Node::squared_distances`]: larger by more than those can be too large.
/// Rounding the point, far outside, the gaps, the squares and the sum adds up to less than 2^-20.
#[inline]
pub(super) fn bound(squared: f64) -> f32 {
    (squared * (1.0 + 1e-6)) as f32 + f32::MIN_POSITIVE
}

/// Nodes still to be visited, each with a lower bound of what it can offer.
pub(super) struct Stack {
    entries: [(Child, f32); STACK],
    len: usize,
}

impl Stack {
    #[inline]
    pub fn new() -> Self {
        Self { entries: [(Child::NONE, 0.0); STACK], len: 0 }
    }

    #[inline]
    pub fn push(&mut self, child: Child, bound: f32) {
        self.entries[self.len] = (child, bound);
        self.len += 1;
    }

    /// The latest entry whose bound does not exceed `limit`.
    #[inline]
    pub fn pop(&mut self, limit: f32) -> Option<Child> {
        while self.len > 0 {
            self.len -= 1;
            let (child, bound) = self.entries[self.len];
            if bound <= limit {
                return Some(child);
            }
        }
        None
    }

    /// Adds the children within `limit`, the nearest last, so that it comes off first.
    #[inline]
    pub fn push_near_last(&mut self, node: &Node, query: &Query, limit: f32) {
        let distances = node.squared_distances(query);
        self.push_sorted(&node.children, &distances, limit);
    }

    /// Adds the children whose bound is within `limit`, sorted by insertion, the smallest bound last.
    #[inline]
    pub fn push_sorted(&mut self, children: &[Child; LANES], bounds: &[f32; LANES], limit: f32) {
        let base = self.len;
        for (&child, &bound) in children.iter().zip(bounds) {
            if bound <= limit {
                let mut at = self.len;
                while at > base && self.entries[at - 1].1 < bound {
                    self.entries[at] = self.entries[at - 1];
                    at -= 1;
                }
                self.entries[at] = (child, bound);
                self.len += 1;
            }
        }
    }
}
