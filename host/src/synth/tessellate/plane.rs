//! A triangulated disc in the plane with the neighbours of each triangle; splits and flips of edges.

use crate::mesh::Point;

/// A side of a triangle: side `i` runs from corner `i` to corner `(i + 1) % 3`.
pub(super) type Side = (u32, usize);

/// In place of a neighbour at the border.
const NONE: u32 = u32::MAX;

/// Triangles are counter-clockwise in the plane.
pub(super) struct Triangulation {
    pub plane: Vec<[f64; 2]>,
    pub points: Vec<Point>,
    /// The length of edges wanted at each vertex.
    pub wanted: Vec<f64>,
    pub triangles: Vec<[u32; 3]>,
    pub neighbours: Vec<[u32; 3]>,
}

impl Triangulation {
    /// A fan from the mean of the outline to its sides; the outline's corners come first.
    /// The vertices still have to be placed.
    pub fn fan(outline: &[[f64; 2]]) -> Self {
        let n = outline.len() as u32;
        let sum = outline.iter().fold([0.0, 0.0], |s, p| [s[0] + p[0], s[1] + p[1]]);
        let mut plane = outline.to_vec();
        plane.push(sum.map(|s| s / f64::from(n)));
        Self {
            plane,
            points: vec![],
            wanted: vec![],
            triangles: (0..n).map(|i| [n, i, (i + 1) % n]).collect(),
            neighbours: (0..n).map(|i| [(i + n - 1) % n, NONE, (i + 1) % n]).collect(),
        }
    }

    /// Puts all vertices on a surface.
    pub fn place(&mut self, on: impl Fn([f64; 2]) -> (Point, f64)) {
        (self.points, self.wanted) = self.plane.iter().map(|&at| on(at)).unzip();
    }

    /// Corners of a side, and the corner opposite to it.
    pub fn corners(&self, (triangle, side): Side) -> [u32; 3] {
        let corners = self.triangles[triangle as usize];
        [corners[side], corners[(side + 1) % 3], corners[(side + 2) % 3]]
    }

    /// The same side as the neighbour names it.
    pub fn across(&self, (triangle, side): Side) -> Option<Side> {
        let other = self.neighbours[triangle as usize][side];
        let neighbours = self.neighbours.get(other as usize)?;
        neighbours.iter().position(|&n| n == triangle).map(|s| (other, s))
    }

    /// Each edge between two triangles once.
    pub fn inner_sides(&self) -> impl Iterator<Item = Side> + '_ {
        self.sides().filter(|&side| self.is_first(side))
    }

    /// Whether the side is an inner one and its triangle comes before the one across.
    pub fn is_first(&self, (triangle, side): Side) -> bool {
        let other = self.neighbours[triangle as usize][side];
        other != NONE && triangle < other
    }

    fn sides(&self) -> impl Iterator<Item = Side> + '_ {
        (0..self.triangles.len() as u32).flat_map(|t| (0..3).map(move |s| (t, s)))
    }

    /// Length in space.
    pub fn length(&self, [a, b]: [u32; 2]) -> f64 {
        (self.points[a as usize] - self.points[b as usize]).norm()
    }

    /// How many times longer than wanted a side is.
    pub fn excess(&self, side: Side) -> f64 {
        let [a, b, _] = self.corners(side);
        2.0 * self.length([a, b]) / (self.wanted[a as usize] + self.wanted[b as usize])
    }

    /// The point of the plane at `t` of the way from `a` to `b`.
    pub fn between(&self, [a, b]: [u32; 2], t: f64) -> [f64; 2] {
        let (a, b) = (self.plane[a as usize], self.plane[b as usize]);
        [a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])]
    }

    /// Twice the area in the plane, positive if counter-clockwise.
    pub fn area(&self, [a, b, c]: [u32; 3]) -> f64 {
        let [a, b, c] = [a, b, c].map(|v| self.plane[v as usize]);
        (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    }

    /// Puts a vertex on an inner side: two triangles become four.
    pub fn split(&mut self, side: Side, at: [f64; 2], (point, wanted): (Point, f64)) {
        let Some(other) = self.across(side) else { return };
        let ([a, b, c], [.., d]) = (self.corners(side), self.corners(other));
        let [_, right, left] = self.around(side);
        let [_, near, far] = self.around(other);
        let (t, n) = (side.0, other.0);
        let m = self.plane.len() as u32;
        let (t2, n2) = (self.triangles.len() as u32, self.triangles.len() as u32 + 1);
        self.plane.push(at);
        self.points.push(point);
        self.wanted.push(wanted);
        self.set(t, [a, m, c], [n, t2, left]);
        self.set(n, [m, a, d], [t, near, n2]);
        self.triangles.extend([[m, b, c], [b, m, d]]);
        self.neighbours.extend([[n2, right, t], [t2, n, far]]);
        self.rename(right, t, t2);
        self.rename(far, n, n2);
    }

    /// Replaces an inner side by the other diagonal of its two triangles.
    pub fn flip(&mut self, side: Side) {
        let Some(other) = self.across(side) else { return };
        let ([a, b, c], [.., d]) = (self.corners(side), self.corners(other));
        let [_, right, left] = self.around(side);
        let [_, near, far] = self.around(other);
        let (t, n) = (side.0, other.0);
        self.set(t, [a, d, c], [near, n, left]);
        self.set(n, [d, b, c], [far, right, t]);
        self.rename(near, n, t);
        self.rename(right, t, n);
    }

    /// Neighbours, beginning with the one across `side`.
    fn around(&self, (triangle, side): Side) -> [u32; 3] {
        [0, 1, 2].map(|i| self.neighbours[triangle as usize][(side + i) % 3])
    }

    fn set(&mut self, triangle: u32, corners: [u32; 3], neighbours: [u32; 3]) {
        self.triangles[triangle as usize] = corners;
        self.neighbours[triangle as usize] = neighbours;
    }

    /// Tells `triangle` that its neighbour `old` is called `new` now.
    fn rename(&mut self, triangle: u32, old: u32, new: u32) {
        if let Some(neighbours) = self.neighbours.get_mut(triangle as usize) {
            neighbours.iter_mut().filter(|n| **n == old).for_each(|n| *n = new);
        }
    }
}
