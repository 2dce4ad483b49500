//! Builds the tree top down: binned surface area heuristic, four parts a node, [`LEAF`] triangles a leaf.

use super::node::{Child, LANES, Node};
use crate::mesh::Point;
use std::ops::Range;

const LEAF: usize = 4;
const BINS: usize = 16;
/// From this depth on ranges are halved, so that 16 further levels are enough for 2^32 triangles.
const DEEP: u32 = 14;

/// Low and high corner; the empty box has them crossed.
#[derive(Clone, Copy)]
struct Bounds(Point, Point);

impl Bounds {
    const EMPTY: Self = Self(
        Point::new(f64::INFINITY, f64::INFINITY, f64::INFINITY),
        Point::new(f64::NEG_INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY),
    );

    fn of<'a>(points: impl IntoIterator<Item = &'a Point>) -> Self {
        points.into_iter().fold(Self::EMPTY, |b, p| Self(b.0.inf(p), b.1.sup(p)))
    }

    fn union(self, other: Self) -> Self {
        Self(self.0.inf(&other.0), self.1.sup(&other.1))
    }

    /// Half the surface of the box.
    fn area(&self) -> f64 {
        let size = self.1 - self.0;
        size.x * size.y + size.y * size.z + size.z * size.x
    }
}

struct Item {
    index: u32,
    centre: Point,
    bounds: Bounds,
}

/// A range of items that becomes the children of the node at `node`.
struct Task {
    node: usize,
    range: Range<usize>,
    depth: u32,
}

/// Nodes of the tree (the root first) and the order of triangles its leaves refer to.
pub(super) fn build(triangles: &[[Point; 3]]) -> (Vec<Node>, Vec<u32>) {
    let mut items: Vec<Item> =
        triangles.iter().zip(0..).map(|(corners, index)| item(corners, index)).collect();
    let padding = padding(triangles);
    let mut nodes = Vec::new();
    let mut tasks = Vec::new();
    if !items.is_empty() {
        nodes.push(Node::EMPTY);
        tasks.push(Task { node: 0, range: 0..items.len(), depth: 0 });
    }
    while let Some(Task { node, range, depth }) = tasks.pop() {
        for (lane, part) in quarter(&mut items, range, depth).into_iter().enumerate() {
            let (low, high) = box_of(&items[part.clone()], padding);
            let leaf = part.len() <= LEAF;
            let child = if leaf { Child::leaf(part.start, part.len()) } else { Child::node(nodes.len()) };
            nodes[node].set(lane, low, high, child);
            if !leaf {
                tasks.push(Task { node: nodes.len(), range: part, depth: depth + 1 });
                nodes.push(Node::EMPTY);
            }
        }
    }
    (nodes, items.iter().map(|item| item.index).collect())
}

/// Splits the range, always its largest part, into at most four.
fn quarter(items: &mut [Item], range: Range<usize>, depth: u32) -> Vec<Range<usize>> {
    let mut parts = vec![range];
    while parts.len() < LANES {
        let largest = (0..parts.len()).max_by_key(|&i| parts[i].len()).unwrap_or(0);
        let part = parts[largest].clone();
        if part.len() <= LEAF {
            break;
        }
        let middle = part.start + split(&mut items[part.clone()], depth);
        parts[largest] = part.start..middle;
        parts.push(middle..part.end);
    }
    parts
}

fn item(corners: &[Point; 3], index: u32) -> Item {
    let bounds = Bounds::of(corners);
    Item { index, centre: nalgebra::center(&bounds.0, &bounds.1), bounds }
}

/// What boxes are enlarged by: more than a query within four times the size of the mesh loses when
/// it is rounded to `f32`. (One farther away loses a part of its distance, see `node::bound`.)
fn padding(triangles: &[[Point; 3]]) -> f64 {
    let size = triangles.iter().flatten().map(|p| p.coords.amax()).fold(0.0, f64::max);
    size * f64::from(f32::EPSILON) * 4.0
}

/// The padded box in `f32`.
fn box_of(items: &[Item], padding: f64) -> ([f32; 3], [f32; 3]) {
    let Bounds(low, high) = items.iter().fold(Bounds::EMPTY, |b, item| b.union(item.bounds));
    ([0, 1, 2].map(|i| (low[i] - padding) as f32), [0, 1, 2].map(|i| (high[i] + padding) as f32))
}

/// Sorts the range into two parts, both not empty, and returns the length of the first.
fn split(range: &mut [Item], depth: u32) -> usize {
    let centres = Bounds::of(range.iter().map(|item| &item.centre));
    let axis = (centres.1 - centres.0).imax();
    let (low, width) = (centres.0[axis], centres.1[axis] - centres.0[axis]);
    if depth >= DEEP || width <= 0.0 || !width.is_finite() {
        return halve(range, axis);
    }
    let bin = |item: &Item| (((item.centre[axis] - low) / width * BINS as f64) as usize).min(BINS - 1);
    let cut = best_cut(range, &bin);
    let middle = partition(range, |item| bin(item) < cut);
    if middle == 0 || middle == range.len() { halve(range, axis) } else { middle }
}

/// Halves the range at the median centre; ties by index, so that the tree is the same everywhere.
fn halve(range: &mut [Item], axis: usize) -> usize {
    let middle = range.len() / 2;
    range.select_nth_unstable_by(middle, |a, b| {
        a.centre[axis].total_cmp(&b.centre[axis]).then(a.index.cmp(&b.index))
    });
    middle
}

/// The bin in front of which a cut makes the expected number of triangle tests smallest.
fn best_cut(range: &[Item], bin: &impl Fn(&Item) -> usize) -> usize {
    let mut bins = [(Bounds::EMPTY, 0_usize); BINS];
    for item in range {
        let (bounds, count) = &mut bins[bin(item)];
        *bounds = bounds.union(item.bounds);
        *count += 1;
    }
    let cost = |part: &[(Bounds, usize)]| {
        let (bounds, count) = part.iter().fold((Bounds::EMPTY, 0), |s, b| (s.0.union(b.0), s.1 + b.1));
        if count == 0 { f64::INFINITY } else { bounds.area() * count as f64 }
    };
    let costs = (1..BINS).map(|cut| (cut, cost(&bins[..cut]) + cost(&bins[cut..])));
    costs.min_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(cut, _)| cut)
}

/// Brings the items with `first` to the front; returns how many there are.
fn partition(range: &mut [Item], first: impl Fn(&Item) -> bool) -> usize {
    let mut count = 0;
    for i in 0..range.len() {
        if first(&range[i]) {
            range.swap(i, count);
            count += 1;
        }
    }
    count
}
