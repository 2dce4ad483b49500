//! Closest point on one triangle, after Ericson, "Real-Time Collision Detection", 5.1.5.

use super::{Feature, Hit};
use crate::mesh::{Point, Vector};

/// Sine of the smallest angle at a corner for which the plane of a triangle can be trusted; a
/// thinner one is treated as its three edges, which moves the closest point by less than 1e-6 of its size.
const THIN: f64 = 1e-6;

/// Corners of a triangle in leaf order, with its index in the mesh.
#[derive(Clone, Copy, Debug)]
pub(super) struct Triangle {
    pub corners: [Point; 3],
    pub index: u32,
    thin: bool,
}

impl Triangle {
    pub fn new(corners: [Point; 3], index: u32) -> Self {
        let [a, b, c] = corners;
        let (ab, ac, bc) = (b - a, c - a, c - b);
        let longest = ab.norm_squared().max(ac.norm_squared()).max(bc.norm_squared());
        let thin = ab.cross(&ac).norm_squared() <= THIN * THIN * longest * longest;
        Self { corners, index, thin }
    }

    /// Replaces `best` if this triangle is closer than `limit`, or as close with a lower index.
    /// Returns the new limit.
    #[inline]
    pub fn improve(&self, p: &Point, limit: f64, best: &mut Option<Hit>) -> f64 {
        let (point, feature) = if self.thin { self.closest_on_edges(p) } else { self.closest(p) };
        let squared_distance = (p - point).norm_squared();
        let wins = squared_distance < limit
            || squared_distance == limit && best.is_none_or(|b: Hit| self.index < b.triangle);
        if !wins {
            return limit;
        }
        *best = Some(Hit { triangle: self.index, point, squared_distance, feature });
        squared_distance
    }

    /// Corners first, then edges, then the face; every division is by a positive number.
    #[inline]
    fn closest(&self, p: &Point) -> (Point, Feature) {
        let [a, b, c] = self.corners;
        let (ab, ac) = (b - a, c - a);
        let (ap, bp, cp) = (p - a, p - b, p - c);
        let (d1, d2) = (ab.dot(&ap), ac.dot(&ap));
        if d1 <= 0.0 && d2 <= 0.0 {
            return (a, Feature::Vertex(0));
        }
        let (d3, d4) = (ab.dot(&bp), ac.dot(&bp));
        if d3 >= 0.0 && d4 <= d3 {
            return (b, Feature::Vertex(1));
        }
        let vc = d1 * d4 - d3 * d2;
        if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
            return (along(a, ab, d1 / (d1 - d3)), Feature::Edge(0));
        }
        let (d5, d6) = (ab.dot(&cp), ac.dot(&cp));
        if d6 >= 0.0 && d5 <= d6 {
            return (c, Feature::Vertex(2));
        }
        let vb = d5 * d2 - d1 * d6;
        if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
            return (along(a, ac, d2 / (d2 - d6)), Feature::Edge(2));
        }
        let va = d3 * d6 - d5 * d4;
        if va <= 0.0 && d4 >= d3 && d5 >= d6 {
            return (along(b, c - b, (d4 - d3) / ((d4 - d3) + (d5 - d6))), Feature::Edge(1));
        }
        let scale = 1.0 / (va + vb + vc);
        (a + ab * (vb * scale) + ac * (vc * scale), Feature::Face)
    }

    /// The closest point of the three edges, the first of equal ones.
    fn closest_on_edges(&self, p: &Point) -> (Point, Feature) {
        let [a, b, c] = self.corners;
        let mut best = (a, Feature::Vertex(0));
        for (i, (from, to)) in [(a, b), (b, c), (c, a)].into_iter().enumerate() {
            let candidate = closest_on_edge(p, from, to, i as u8);
            if (p - candidate.0).norm_squared() < (p - best.0).norm_squared() {
                best = candidate;
            }
        }
        best
    }
}

#[inline]
fn along(from: Point, edge: Vector, t: f64) -> Point {
    from + edge * t
}

fn closest_on_edge(p: &Point, from: Point, to: Point, i: u8) -> (Point, Feature) {
    let edge = to - from;
    let (dot, length) = (edge.dot(&(p - from)), edge.norm_squared());
    if dot > 0.0 && dot < length {
        (along(from, edge, dot / length), Feature::Edge(i))
    } else if dot > 0.0 {
        (to, Feature::Vertex((i + 1) % 3))
    } else {
        (from, Feature::Vertex(i))
    }
}
