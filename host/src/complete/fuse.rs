//! From fitted distances to surfaces in the scan's frame.

use crate::fit::dense;
use crate::mesh::{Mesh, Point, Vector};
use crate::register::Placed;
use crate::surface::{Volume, close_holes, largest_component, marching_cubes, open_rim, trim_rim};
use crate::train::distance::Surface;
use lacuna::{Model, sample};
use rayon::prelude::*;

/// Layers around the stored voxels that are extrapolated.
const LAYERS: usize = 5;
/// Layers beyond the support, where nearly all training shapes have ended, that go on straight.
const BEYOND: usize = 2;
/// Largest difference between far field and mean, voxels, where the far field is relied on.
const FAITHFUL: f32 = 0.35;
/// Strips at the rim narrower than twice this are cut off, voxels.
const NARROW: f64 = 1.5;
/// The same on the model's own grid.
const COARSE_NARROW: f64 = 0.8;

/// Gradient of a distance below which it has hardly a direction; a distance's own is 1.
const STEEP: f32 = 0.5;

/// A dense volume of distances in voxels, x fastest, NaN where unknown.
pub struct Dense {
    /// Voxels along x, y, z.
    pub sides: [usize; 3],
    /// Distances.
    pub values: Vec<f32>,
}

impl Dense {
    /// Fitted distances of the stored voxels and of `LAYERS` layers around them: there the far field's mean
    /// plus the deviation of the nearest stored voxels, which is smooth. Somebody may be farther from the mean
    /// than the model stores.
    pub fn new(model: &Model<'_>, distances: &[i16]) -> Self {
        let mut means = vec![0; model.voxels()];
        for brick in model.bricks() {
            (0..brick.voxels()).for_each(|v| means[brick.first + v] = brick.mean(v));
        }
        let mut field =
            Self { sides: model.grid().sides().map(usize::from), values: dense(model, distances) };
        let mean = dense(model, &means);
        // Where the coarse far field misses the mean (thin parts), there is nothing to go on from.
        let deviation = |i: usize| {
            if mean[i].is_nan() {
                return f32::NAN;
            }
            let far = sample::far(model, field.voxel(i).map(|v| v as f32)).map(|(far, _)| far);
            far.filter(|far| (far - mean[i]).abs() < FAITHFUL).map_or(f32::NAN, |far| field.values[i] - far)
        };
        let mut deviations: Vec<f32> = (0..mean.len()).into_par_iter().map(deviation).collect();
        for _ in 0..LAYERS {
            let grown = field.grow(model, &deviations);
            for (i, deviation, value) in grown {
                (deviations[i], field.values[i]) = (deviation, value);
            }
        }
        let off = |voxel: [usize; 3]| sample::far(model, voxel.map(|v| v as f32)).is_none();
        for _ in 0..BEYOND {
            for (i, value) in field.straight(off) {
                field.values[i] = value;
            }
        }
        field
    }

    /// Unknown voxels `off` the support that two known ones in a row lead to, and their distances.
    fn straight(&self, off: impl Fn([usize; 3]) -> bool + Sync) -> Vec<(usize, f32)> {
        let [width, height, _] = self.sides;
        let next = |&i: &usize| {
            let voxel = self.voxel(i);
            let (mut sum, mut count) = (0.0, 0);
            for (axis, step) in [1, width, width * height].into_iter().enumerate() {
                let ahead = (voxel[axis] + 2 < self.sides[axis]).then(|| [i + step, i + 2 * step]);
                let behind = (voxel[axis] >= 2).then(|| [i - step, i - 2 * step]);
                for [near, far] in ahead.into_iter().chain(behind) {
                    let value = 2.0 * self.values[near] - self.values[far];
                    if !value.is_nan() {
                        (sum, count) = (sum + value, count + 1);
                    }
                }
            }
            (count > 0 && off(voxel)).then(|| (i, sum / count as f32))
        };
        let unknown: Vec<usize> = (0..self.values.len()).filter(|&i| self.values[i].is_nan()).collect();
        unknown.par_iter().filter_map(next).collect()
    }

    /// Unknown voxels on the support next to known deviations: place, deviation and distance.
    fn grow(&self, model: &Model<'_>, deviations: &[f32]) -> Vec<(usize, f32, f32)> {
        let next = |i: usize| {
            let known = self.neighbours(i).map(|near| deviations[near]).filter(|d| !d.is_nan());
            let (sum, count) = known.fold((0.0, 0), |(sum, count), d| (sum + d, count + 1));
            if count == 0 {
                return None;
            }
            let (mean, _) = sample::far(model, self.voxel(i).map(|v| v as f32))?;
            let deviation = sum / count as f32;
            Some((i, deviation, mean + deviation))
        };
        let unknown = (0..self.values.len()).into_par_iter().filter(|&i| self.values[i].is_nan());
        unknown.filter_map(next).collect()
    }

    fn index(&self, [x, y, z]: [usize; 3]) -> usize {
        (z * self.sides[1] + y) * self.sides[0] + x
    }

    /// The voxels before and behind one along x, y and z, where the grid has them.
    pub fn beside(&self, i: usize) -> [Option<usize>; 6] {
        let steps = [1, self.sides[0], self.sides[0] * self.sides[1]];
        let mut near = [None; 6];
        for (axis, pair) in near.as_chunks_mut::<2>().0.iter_mut().enumerate() {
            let at = i / steps[axis] % self.sides[axis];
            let ahead = at + 1 < self.sides[axis];
            *pair = [(at > 0).then(|| i - steps[axis]), ahead.then(|| i + steps[axis])];
        }
        near
    }

    /// The voxels that share a face with one.
    pub fn neighbours(&self, i: usize) -> impl Iterator<Item = usize> {
        self.beside(i).into_iter().flatten()
    }

    /// Direction in which the distance grows, of unit length unless it grows slowly; zero where it is unknown.
    pub fn direction(&self, i: usize) -> [f32; 3] {
        let own = self.values[i];
        let near = self.beside(i).map(|near| near.map_or(f32::NAN, |j| self.values[j]));
        let along = |axis: usize| {
            let (before, behind) = (near[2 * axis], near[2 * axis + 1]);
            match (before.is_nan(), behind.is_nan()) {
                (false, false) => (behind - before) / 2.0,
                (false, true) => own - before,
                (true, false) => behind - own,
                (true, true) => 0.0,
            }
        };
        let gradient: [f32; 3] = std::array::from_fn(along);
        let steep = gradient.iter().map(|g| g * g).sum::<f32>().sqrt().max(STEEP);
        gradient.map(|g| if g.is_nan() { 0.0 } else { g / steep })
    }

    /// Place of a voxel in the grid.
    pub fn voxel(&self, i: usize) -> [usize; 3] {
        let [width, height, _] = self.sides;
        [i % width, i / width % height, i / width / height]
    }

    /// Distance and gradient at a position, trilinear; `None` next to unknown voxels.
    pub fn at(&self, p: &Point) -> Option<(f64, Vector)> {
        let place = sample::Place::new(p.coords.map(|c| c as f32).into(), 1)?;
        let mut corners = [0.0f32; 8];
        for (c, value) in corners.iter_mut().enumerate() {
            let voxel = place.position(c).map(usize::from);
            if voxel.iter().zip(self.sides).any(|(&v, side)| v >= side) {
                return None;
            }
            *value = self.values[self.index(voxel)];
        }
        let (value, gradient) = place.interpolate(&corners);
        (!value.is_nan()).then(|| (f64::from(value), Vector::from(gradient.map(f64::from))))
    }

    /// Marks voxels near points: those at most `reach` steps off a point's own one along each axis, and of them those
    /// of which `near`, asked with voxel and point, says yes.
    pub fn mark(&self, points: &[Point], reach: usize, near: impl Fn(&Point, &Point) -> bool) -> Vec<bool> {
        let mut marks = vec![false; self.values.len()];
        let side = 2 * reach + 1;
        for point in points {
            for offset in 0..side * side * side {
                let step = [offset % side, offset / side % side, offset / side / side];
                let voxel: [f64; 3] =
                    std::array::from_fn(|a| point[a].round() + step[a] as f64 - reach as f64);
                let inside = voxel.iter().zip(self.sides).all(|(&v, side)| v >= 0.0 && v < side as f64);
                if inside && near(&Point::from(voxel), point) {
                    marks[self.index(voxel.map(|v| v as usize))] = true;
                }
            }
        }
        marks
    }

    /// The scan's own distance at a voxel, if the scan is not farther than `limit`, in its unit, and does not end there.
    pub fn measured(&self, i: usize, scan: &Surface, placed: &Placed, limit: f64) -> Option<f32> {
        let place = Point::from(Vector::from(self.voxel(i).map(|v| v as f64)));
        let found = scan.distance(&placed.to_scan(&place), limit)?;
        (!found.on_border).then_some((found.value * f64::from(placed.pose.scale)) as f32)
    }

    /// Fills unknown voxels next to the scan's points, given in voxels, with the scan's own distances, within the
    /// model's support: where somebody is farther from the mean than the model stores, the measured surface goes on.
    pub fn extend(&mut self, model: &Model<'_>, scan: &Surface, placed: &Placed, points: &[Point]) {
        let reach = 2u8;
        let limit = f64::from(reach) * 1.8 / f64::from(placed.pose.scale);
        let near = self.mark(points, usize::from(reach), |_, _| true);
        let supported = |i: usize| sample::far(model, self.voxel(i).map(|v| v as f32)).is_some();
        let wanted = |&i: &usize| near[i] && self.values[i].is_nan() && supported(i);
        let wanted: Vec<usize> = (0..near.len()).filter(wanted).collect();
        let known = |&i: &usize| Some((i, self.measured(i, scan, placed, limit)?));
        let values: Vec<(usize, f32)> = wanted.par_iter().filter_map(known).collect();
        for (i, value) in values {
            self.values[i] = value;
        }
    }

    /// The zero level in the scan's frame: largest piece without holes, rim trimmed, on a grid `factor` times as fine.
    pub fn surface(&self, placed: &Placed, factor: usize) -> Mesh {
        let fine = self.finer(factor.max(1));
        let volume = Volume { dims: fine.sides, values: &fine.values };
        let mesh = marching_cubes(&volume, &Point::origin(), 1.0 / factor.max(1) as f64);
        let whole = close_holes(&largest_component(&mesh));
        let narrow = if factor > 1 { NARROW } else { COARSE_NARROW };
        let mut mesh = close_holes(&trim_rim(&close_holes(&open_rim(&whole, narrow)), factor.max(1)));
        mesh.points.par_iter_mut().for_each(|p| *p = placed.to_scan(p));
        mesh
    }

    /// Interpolation to a finer grid by cubics along one axis after the other. Piecewise linear distances would scallop
    /// the edges of thin parts, with the voxels' period.
    fn finer(&self, factor: usize) -> Self {
        let mut field = Self { sides: self.sides, values: self.values.clone() };
        if factor > 1 {
            (0..3).for_each(|axis| field = field.finer_along(axis, factor));
        }
        field
    }

    fn finer_along(&self, axis: usize, factor: usize) -> Self {
        let mut sides = self.sides;
        sides[axis] = (sides[axis] - 1) * factor + 1;
        let step = [1, self.sides[0], self.sides[0] * self.sides[1]][axis];
        let last = self.sides[axis] - 1;
        let value = |i: usize| {
            let mut voxel = [i % sides[0], i / sides[0] % sides[1], i / sides[0] / sides[1]];
            let (low, part) = (voxel[axis] / factor, voxel[axis] % factor);
            voxel[axis] = low;
            let at = self.index(voxel);
            if part == 0 {
                return self.values[at];
            }
            let before = if low > 0 { self.values[at - step] } else { f32::NAN };
            let behind = if low + 1 < last { self.values[at + 2 * step] } else { f32::NAN };
            cubic([before, self.values[at], self.values[at + step], behind], part as f32 / factor as f32)
        };
        let values = (0..sides.iter().product()).into_par_iter().map(value).collect();
        Self { sides, values }
    }
}

/// Between the second and the third of four values in a row (Catmull and Rom 1974); an unknown outer one is taken to
/// go on straight.
fn cubic([before, a, b, behind]: [f32; 4], t: f32) -> f32 {
    let before = if before.is_nan() { 2.0 * a - b } else { before };
    let behind = if behind.is_nan() { 2.0 * b - a } else { behind };
    let bend = 2.0 * before - 5.0 * a + 4.0 * b - behind;
    let twist = 3.0 * (a - b) + behind - before;
    a + 0.5 * t * (b - before + t * (bend + t * twist))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plane_goes_on_straight_off_the_support_and_nowhere_else() {
        let plane = |x: usize, y: usize| 0.3 * x as f32 - 0.8 * y as f32 + 1.0;
        let values = (0..125).map(|i| if i % 5 < 3 { plane(i % 5, i / 5 % 5) } else { f32::NAN }).collect();
        let mut field = Dense { sides: [5; 3], values };
        let grown = field.straight(|[_, y, _]| y > 1);
        assert_eq!(grown.len(), 15);
        for (i, value) in grown {
            assert!(
                i % 5 == 3 && i / 5 % 5 > 1 && (value - plane(3, i / 5 % 5)).abs() < 1e-5,
                "{i}: {value}"
            );
            field.values[i] = value;
        }
        assert_eq!(field.straight(|_| true).len(), 15 + 10);
    }

    #[test]
    fn directions_are_outward_and_neighbours_are_in_the_grid() {
        let values = (0..125)
            .map(|i| if i % 25 == 24 { f32::NAN } else { 0.6 * (i % 5) as f32 - 0.8 * (i / 5 % 5) as f32 });
        let field = Dense { sides: [5; 3], values: values.collect() };
        // At a corner, inside, beside an unknown one.
        for i in [0, 62, 73] {
            let off = field
                .direction(i)
                .iter()
                .zip([0.6, -0.8, 0.0])
                .map(|(a, b)| (a - b).abs())
                .fold(0.0, f32::max);
            assert!(off < 1e-5, "{i}: {:?}", field.direction(i));
        }
        assert_eq!(field.neighbours(0).collect::<Vec<_>>(), [1, 5, 25]);
        assert_eq!(field.neighbours(62).count(), 6);
        let flat = Dense { sides: [5; 3], values: vec![3.0; 125] };
        assert_eq!(flat.direction(62), [0.0; 3]);
    }

    #[test]
    fn a_finer_grid_interpolates_and_keeps_the_known_voxels() {
        let values = (0..27).map(|i| if i == 26 { f32::NAN } else { (i % 3) as f32 }).collect();
        let fine = Dense { sides: [3; 3], values }.finer(2);
        assert_eq!(fine.sides, [5; 3]);
        assert_eq!(&fine.values[..5], [0.0, 0.5, 1.0, 1.5, 2.0]);
        assert_eq!(fine.values[4 * 25 + 4 * 5 + 2], 1.0);
        assert!(fine.values[4 * 25 + 4 * 5 + 3].is_nan());
    }

    #[test]
    fn between_voxels_a_bent_distance_stays_bent() {
        let square = |x: f32| (x - 2.2) * (x - 2.2);
        let values = (0..5 * 5 * 5).map(|i| square((i / 5 % 5) as f32)).collect();
        let fine = Dense { sides: [5; 3], values }.finer(4);
        let along = |y: usize| fine.values[y * 17];
        // Inside; in the outermost cells the row is taken to go on straight.
        (4..=12).for_each(|y| assert!((along(y) - square(y as f32 / 4.0)).abs() < 1e-5, "{y}"));
        assert!((1..4).all(|y| along(y) < along(y - 1)) && (13..=16).all(|y| along(y) > along(y - 1)));
    }
}
