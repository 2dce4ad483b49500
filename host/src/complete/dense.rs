//! A dense volume of fitted distances: made by [`extrapolated`](super::extrapolate::extrapolated), a surface by
//! [`zero_level`](super::zero_level).

use crate::distance::Surface;
use crate::mesh::{Point, Vector};
use crate::raster;
use crate::register::Placed;
use lacuna::sample;

/// Gradient of a distance below which it has hardly a direction; a distance's own is 1.
const STEEP: f32 = 0.5;

/// A dense volume of distances in voxels, x fastest, NaN where unknown.
#[derive(Clone)]
pub struct Dense {
    /// Voxels along x, y, z.
    pub sides: [usize; 3],
    /// Distances.
    pub values: Vec<f32>,
}

impl Dense {
    /// Place of a voxel in the grid.
    pub fn voxel(&self, i: usize) -> [usize; 3] {
        raster::voxel(self.sides, i)
    }

    /// The voxels before and behind one along x, y and z, where the grid has them.
    pub fn beside(&self, i: usize) -> [Option<usize>; 6] {
        let steps = raster::strides(self.sides);
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

    /// Mean of what is known (no NaN) of the voxels that share a face with one; `values` are one a voxel. None where nothing is.
    pub fn mean_beside(&self, i: usize, values: &[f32]) -> Option<f32> {
        let known = self.neighbours(i).map(|j| values[j]).filter(|value| !value.is_nan());
        let (sum, count) = known.fold((0.0, 0.0), |(sum, count), value| (sum + value, count + 1.0));
        (count > 0.0).then(|| sum / count)
    }

    /// Direction in which the distance grows, of unit length unless it grows slowly; zero where it is unknown.
    pub fn direction(&self, i: usize) -> [f32; 3] {
        let own = self.values[i];
        let near = self.beside(i).map(|near| near.map_or(f32::NAN, |j| self.values[j]));
        let along = |axis: usize| raster::slope(near[2 * axis], own, near[2 * axis + 1]);
        let gradient: [f32; 3] = std::array::from_fn(along);
        let steep = gradient.iter().map(|g| g * g).sum::<f32>().sqrt().max(STEEP);
        gradient.map(|g| if g.is_nan() { 0.0 } else { g / steep })
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
            *value = self.values[raster::index(self.sides, voxel)];
        }
        let (value, gradient) = place.interpolate(&corners);
        (!value.is_nan()).then(|| (f64::from(value), Vector::from(gradient.map(f64::from))))
    }

    /// The voxels of the grid at most `reach` steps off a point's own one along each axis, and where they are.
    pub fn around(&self, point: &Point, reach: usize) -> impl Iterator<Item = (usize, Point)> {
        let (sides, first) = (self.sides, point.map(|c| c.round() - reach as f64));
        let cube = [2 * reach + 1; 3];
        (0..raster::len(cube)).filter_map(move |offset| {
            let step = raster::voxel(cube, offset);
            let voxel: [f64; 3] = std::array::from_fn(|a| first[a] + step[a] as f64);
            let inside = voxel.iter().zip(sides).all(|(&v, side)| v >= 0.0 && v < side as f64);
            inside.then(|| (raster::index(sides, voxel.map(|v| v as usize)), Point::from(voxel)))
        })
    }

    /// Marks voxels near points: those at most `reach` steps off a point's own one along each axis, and of them those
    /// of which `near`, asked with voxel and point, says yes.
    pub fn mark(&self, points: &[Point], reach: usize, near: impl Fn(&Point, &Point) -> bool) -> Vec<bool> {
        let mut marks = vec![false; self.values.len()];
        for point in points {
            for (i, _) in self.around(point, reach).filter(|(_, voxel)| near(voxel, point)) {
                marks[i] = true;
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
}

#[cfg(test)]
mod tests {
    use super::*;

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
}
