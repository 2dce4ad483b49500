//! Rays: first hit and visibility (Möller and Trumbore's test, both sides of a triangle count).

use super::Bvh;
use super::node::{Child, LANES, Node, Stack};
use super::triangle::Triangle;
use crate::mesh::{Point, Vector};

/// Part of a line of sight left out at either end, so that a point of the surface does not hide itself.
const MARGIN: f64 = 1e-6;

impl Bvh {
    /// First hit of the ray `origin + t direction`, `0 <= t <= max`: `t` and the triangle.
    /// `direction` need not have length one; `t` counts in its length.
    pub fn cast(&self, origin: &Point, direction: &Vector, max: f64) -> Option<(f64, u32)> {
        let ray = Ray::new(&(origin - self.origin), direction);
        let mut best: Option<(f64, u32)> = None;
        self.visit(&ray, max, |t, triangle, limit| {
            if t < *limit || t == *limit && best.is_none_or(|b| triangle < b.1) {
                best = Some((t, triangle));
                *limit = t;
            }
        });
        best
    }

    /// Whether a triangle lies between `origin` and `target`; the ends may lie on the surface.
    pub fn occluded(&self, origin: &Point, target: &Point) -> bool {
        let ray = Ray::new(&(origin - self.origin), &(target - origin));
        let mut hidden = false;
        self.visit(&ray, 1.0 - MARGIN, |t, _, limit| {
            if t > MARGIN && t <= *limit {
                hidden = true;
                *limit = f64::NEG_INFINITY;
            }
        });
        hidden
    }

    /// Shows `found` all hits that can lie within the limit, near boxes first; `found` may lower it.
    fn visit(&self, ray: &Ray, mut limit: f64, mut found: impl FnMut(f64, u32, &mut f64)) {
        let mut stack = Stack::new();
        if !self.nodes.is_empty() {
            stack.push(Child::ROOT, 0.0);
        }
        while let Some(child) = stack.pop(above(limit)) {
            if child.is_node() {
                let node = &self.nodes[child.first as usize];
                stack.push_sorted(&node.children, &ray.enter(node), above(limit));
            } else {
                for triangle in child.triangles(&self.leaves) {
                    if let Some(t) = ray.meet(triangle) {
                        found(t, triangle.index, &mut limit);
                    }
                }
            }
        }
    }
}

/// The limit as a bound for boxes; what is below zero stays there.
fn above(limit: f64) -> f32 {
    (limit as f32).next_up()
}

struct Ray {
    origin: Point,
    direction: Vector,
    inverse: Vector,
}

impl Ray {
    fn new(origin: &Point, direction: &Vector) -> Self {
        // A finite stand-in for 1 / 0: zero times it stays zero where infinity would give NaN.
        let inverse = direction.map(|d| if d == 0.0 { 1e300 } else { 1.0 / d });
        Self { origin: *origin, direction: *direction, inverse }
    }

    /// Where the ray enters the four boxes, rounded down: zero if it starts inside, NaN if it misses.
    #[inline]
    fn enter(&self, node: &Node) -> [f32; LANES] {
        let (mut near, mut far) = ([0.0_f64; LANES], [f64::INFINITY; LANES]);
        for axis in 0..3 {
            let (origin, inverse) = (self.origin[axis], self.inverse[axis]);
            for lane in 0..LANES {
                let a = (f64::from(node.low[axis][lane]) - origin) * inverse;
                let b = (f64::from(node.high[axis][lane]) - origin) * inverse;
                let (low, high) = if a < b { (a, b) } else { (b, a) };
                near[lane] = if low > near[lane] { low } else { near[lane] };
                far[lane] = if high < far[lane] { high } else { far[lane] };
            }
        }
        std::array::from_fn(|i| if near[i] <= far[i] { (near[i] as f32).next_down() } else { f32::NAN })
    }

    /// `t >= 0` where the ray meets the triangle; a ray within its plane misses it.
    #[inline]
    fn meet(&self, triangle: &Triangle) -> Option<f64> {
        let [a, b, c] = triangle.corners;
        let (ab, ac) = (b - a, c - a);
        let across = self.direction.cross(&ac);
        let scale = 1.0 / ab.dot(&across);
        let from = self.origin - a;
        let u = from.dot(&across) * scale;
        let around = from.cross(&ab);
        let v = self.direction.dot(&around) * scale;
        let t = ac.dot(&around) * scale;
        // Comparisons with NaN or infinity (a flat triangle) fail.
        (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t >= 0.0 && t.is_finite()).then_some(t)
    }
}
