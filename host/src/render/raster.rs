//! Hidden surfaces: which triangle or point of a mesh each sample of a picture shows.

use super::camera::{STEPS, Spot};
use crate::mesh::Mesh;
use rayon::prelude::*;
use std::ops::Range;

/// What a sample shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Depth of the visible surface.
    pub depth: f32,
    /// Index of a triangle, or of a point in a mesh without triangles.
    pub item: u32,
}

impl Hit {
    /// Nothing but the background.
    pub const NOTHING: Self = Self { depth: f32::NEG_INFINITY, item: u32::MAX };

    /// Is there any surface?
    pub fn is_surface(&self) -> bool {
        self.item != u32::MAX
    }
}

/// Rows drawn by one task. Each sample is decided by the triangles in their order, whatever the
/// number of tasks.
const BAND: usize = 256;

/// Draws a mesh whose vertices are at `spots`; returns the hits row by row.
pub fn draw(mesh: &Mesh, spots: &[Option<Spot>], size: [usize; 2]) -> Vec<Hit> {
    let mut hits = vec![Hit::NOTHING; size[0] * size[1]];
    let radius = disc_radius(spots);
    hits.par_chunks_mut((BAND * size[0]).max(1)).enumerate().for_each(|(index, hits)| {
        let mut band = Band { top: (index * BAND) as i32, width: size[0], hits };
        if mesh.triangles.is_empty() {
            spots.iter().enumerate().for_each(|(i, spot)| band.disc(i as u32, spot, radius));
        } else {
            mesh.triangles
                .iter()
                .enumerate()
                .for_each(|(i, t)| band.triangle(i as u32, t.map(|v| spots[v as usize])));
        }
    });
    hits
}

/// Radius of the discs that stand for points, in samples: about as large as closes the gaps.
fn disc_radius(spots: &[Option<Spot>]) -> f32 {
    let seen = || spots.iter().flatten();
    let range = |place: fn(&Spot) -> i32| {
        let (low, high) =
            seen().map(place).fold((i32::MAX, i32::MIN), |(low, high), x| (low.min(x), high.max(x)));
        high.saturating_sub(low).max(0) as f32 / STEPS as f32
    };
    let area = range(|spot| spot.x) * range(|spot| spot.y);
    (0.8 * (area / seen().count().max(1) as f32).sqrt()).clamp(1.2, 8.0)
}

/// Twice the signed area of a triangle, positive if it runs clockwise in the picture.
pub fn twice_area([a, b, c]: [[i32; 2]; 3]) -> i64 {
    let difference = |p: [i32; 2], q: [i32; 2]| [i64::from(q[0] - p[0]), i64::from(q[1] - p[1])];
    let ([ux, uy], [vx, vy]) = (difference(a, b), difference(a, c));
    ux * vy - uy * vx
}

/// The place of a sample's centre, in steps.
pub fn sample_place(x: i32, y: i32) -> [i32; 2] {
    [x * STEPS + STEPS / 2, y * STEPS + STEPS / 2]
}

/// Some rows of the picture.
struct Band<'a> {
    top: i32,
    width: usize,
    hits: &'a mut [Hit],
}

impl Band<'_> {
    fn bottom(&self) -> i32 {
        self.top + (self.hits.len() / self.width) as i32
    }

    fn show(&mut self, x: i32, y: i32, hit: Hit) {
        let known = &mut self.hits[(y - self.top) as usize * self.width + x as usize];
        if hit.depth > known.depth {
            *known = hit;
        }
    }

    /// The samples whose centres lie in a range of steps, cut to `limits`.
    fn samples(low: i32, high: i32, limits: [i32; 2]) -> Range<i32> {
        let first = (low + STEPS / 2 - 1).div_euclid(STEPS);
        let last = (high - STEPS / 2).div_euclid(STEPS);
        first.max(limits[0])..(last + 1).min(limits[1])
    }

    /// Draws a triangle from both sides. Samples on its edges belong to it: no gaps between neighbours.
    fn triangle(&mut self, item: u32, spots: [Option<Spot>; 3]) {
        let [Some(a), Some(b), Some(c)] = spots else { return };
        let rows = Self::samples(a.y.min(b.y).min(c.y), a.y.max(b.y).max(c.y), [self.top, self.bottom()]);
        if rows.is_empty() {
            return;
        }
        let columns = Self::samples(a.x.min(b.x).min(c.x), a.x.max(b.x).max(c.x), [0, self.width as i32]);
        match twice_area([a, b, c].map(|s| [s.x, s.y])) {
            0 => {}
            1.. => self.fill(item, [a, b, c], rows, columns),
            _ => self.fill(item, [a, c, b], rows, columns),
        }
    }

    /// Draws a clockwise triangle. The weights of the corners change by constant steps.
    fn fill(&mut self, item: u32, [a, b, c]: [Spot; 3], rows: Range<i32>, columns: Range<i32>) {
        let [pa, pb, pc] = [a, b, c].map(|s| [s.x, s.y]);
        let scale = 1.0 / twice_area([pa, pb, pc]) as f32;
        let (to_b, to_c) = ((b.depth - a.depth) * scale, (c.depth - a.depth) * scale);
        let sides = [(pb, pc), (pc, pa), (pa, pb)];
        let right = sides.map(|(p, q)| i64::from(STEPS * (p[1] - q[1])));
        let down = sides.map(|(p, q)| i64::from(STEPS * (q[0] - p[0])));
        let start = sample_place(columns.start, rows.start);
        let mut first = [[start, pb, pc], [pa, start, pc], [pa, pb, start]].map(twice_area);
        for y in rows {
            let mut weights = first;
            for x in columns.clone() {
                if weights[0] | weights[1] | weights[2] >= 0 {
                    let depth = a.depth + weights[1] as f32 * to_b + weights[2] as f32 * to_c;
                    self.show(x, y, Hit { depth, item });
                }
                (0..3).for_each(|i| weights[i] += right[i]);
            }
            (0..3).for_each(|i| first[i] += down[i]);
        }
    }

    /// Draws a disc that faces the viewer.
    fn disc(&mut self, item: u32, spot: &Option<Spot>, radius: f32) {
        let Some(spot) = spot else { return };
        let reach = (radius * spot.zoom * STEPS as f32).min(1e4) as i32;
        for y in Self::samples(spot.y - reach, spot.y + reach, [self.top, self.bottom()]) {
            for x in Self::samples(spot.x - reach, spot.x + reach, [0, self.width as i32]) {
                let [dx, dy] = sample_place(x, y);
                let (dx, dy) = (i64::from(dx - spot.x), i64::from(dy - spot.y));
                if dx * dx + dy * dy <= i64::from(reach) * i64::from(reach) {
                    self.show(x, y, Hit { depth: spot.depth, item });
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Point;

    fn spot(x: f32, y: f32, depth: f32) -> Option<Spot> {
        let steps = |samples: f32| (samples * STEPS as f32) as i32;
        Some(Spot { x: steps(x), y: steps(y), depth, zoom: 1.0 })
    }

    fn mesh(triangles: &[[u32; 3]]) -> Mesh {
        Mesh { points: vec![Point::origin(); 8], normals: Vec::new(), triangles: triangles.to_vec() }
    }

    /// `.` for nothing, else the item's number.
    fn pattern(hits: &[Hit], width: usize) -> Vec<String> {
        let sign = |hit: &Hit| if hit.is_surface() { (b'0' + hit.item as u8) as char } else { '.' };
        hits.chunks(width).map(|row| row.iter().map(sign).collect()).collect()
    }

    #[test]
    fn both_sides_of_a_triangle_cover_the_same_samples() {
        let spots = [spot(0.0, 0.0, 0.0), spot(4.0, 0.0, 0.0), spot(0.0, 4.0, 0.0)];
        for triangle in [[0, 1, 2], [0, 2, 1], [2, 1, 0]] {
            let hits = draw(&mesh(&[triangle]), &spots, [4, 4]);
            assert_eq!(pattern(&hits, 4), ["0000", "000.", "00..", "0..."]);
        }
    }

    #[test]
    fn neighbours_leave_no_gap_and_the_first_keeps_the_edge() {
        let spots = [spot(0.3, 0.0, 0.0), spot(5.0, 0.1, 0.0), spot(5.0, 5.0, 0.0), spot(0.0, 5.0, 0.0)];
        let hits = draw(&mesh(&[[0, 1, 2], [0, 2, 3]]), &spots, [5, 5]);
        assert!(hits.iter().all(Hit::is_surface));
    }

    #[test]
    fn the_nearer_triangle_wins_in_any_order() {
        let near = [spot(0.0, 0.0, 2.0), spot(9.0, 0.0, 2.0), spot(0.0, 9.0, 2.0)];
        let far = near.map(|s| s.map(|s| Spot { depth: 1.0, ..s }));
        let spots = [near, far].concat();
        let first = draw(&mesh(&[[0, 1, 2], [3, 4, 5]]), &spots, [3, 3]);
        let last = draw(&mesh(&[[3, 4, 5], [0, 1, 2]]), &spots, [3, 3]);
        assert!(first.iter().all(|hit| hit.item == 0) && last.iter().all(|hit| hit.item == 1));
    }

    #[test]
    fn depth_is_linear() {
        let spots = [spot(0.0, 0.0, 0.0), spot(8.0, 0.0, 8.0), spot(0.0, 8.0, 16.0)];
        let hits = draw(&mesh(&[[0, 1, 2]]), &spots, [8, 8]);
        for (i, hit) in hits.iter().enumerate().filter(|(_, hit)| hit.is_surface()) {
            let (x, y) = ((i % 8) as f32 + 0.5, (i / 8) as f32 + 0.5);
            assert!((hit.depth - x - 2.0 * y).abs() < 1e-4);
        }
    }

    #[test]
    fn points_become_discs() {
        let hits = draw(&mesh(&[]), &[spot(2.5, 2.5, 0.0), None], [5, 5]);
        assert_eq!(pattern(&hits, 5), [".....", "..0..", ".000.", "..0..", "....."]);
    }

    #[test]
    fn what_lies_outside_is_cut_off() {
        let spots = [spot(-50.0, -60.0, 0.0), spot(900.0, -20.0, 0.0), spot(3.0, 800.0, 0.0)];
        assert!(draw(&mesh(&[[0, 1, 2]]), &spots, [7, 300]).iter().all(Hit::is_surface));
        assert!(draw(&mesh(&[[0, 1, 2]]), &spots, [0, 3]).is_empty());
    }
}
