//! Oriented points of a scan: what the core takes in.

mod sampling;
mod thinning;

pub use thinning::{main_axis, thin, thin_scan, thin_to};

use crate::mesh::{Point, Vector, bounds};
use lacuna::cloud::{Bytes, Packed, pack, step_for};
use lacuna::curve::sort_along_curve;
use lacuna::pose_fit::Hint;
use lacuna::{Cloud, Pose};

/// Points with outward unit normals.
#[derive(Clone, Debug, Default)]
pub struct OrientedPoints {
    /// Positions.
    pub points: Vec<Point>,
    /// Unit normals.
    pub normals: Vec<Vector>,
}

/// The same as integers, as the core takes them.
#[derive(Clone, Debug)]
pub struct PackedPoints {
    /// Position in steps, normal.
    pub points: Vec<Packed>,
    /// Scan units a step.
    pub step: f32,
}

impl OrientedPoints {
    /// The points in the order of a Morton curve: neighbours in the list are neighbours in space.
    #[must_use]
    pub fn along_curve(&self) -> Self {
        let Some((low, high)) = bounds(self.points.iter().copied()) else { return self.clone() };
        // The curve's cells are 64 wide.
        let cell = ((high - low).max() / 1024.0).max(f64::MIN_POSITIVE);
        let place = |p: &Point| ((p - low) / cell).map(|c| (c as u16).min(1023) * 64).into();
        let places: Vec<[u16; 3]> = self.points.iter().map(place).collect();
        let mut order: Vec<usize> = (0..places.len()).collect();
        sort_along_curve(&mut order, &|&i| places[i]);
        // Within a cell of the curve, as they came.
        order.chunk_by_mut(|&a, &b| places[a] == places[b]).for_each(<[usize]>::sort_unstable);
        self.chosen(&order)
    }

    /// The points of these numbers, in their order.
    #[must_use]
    pub fn chosen(&self, numbers: &[usize]) -> Self {
        Self {
            points: numbers.iter().map(|&i| self.points[i]).collect(),
            normals: numbers.iter().map(|&i| self.normals[i]).collect(),
        }
    }

    /// The points as integers, in the finest step that holds them.
    pub fn packed(&self) -> PackedPoints {
        let extent = self.points.iter().map(|p| p.coords.amax()).fold(0.0, f64::max);
        let step = step_for(extent as f32);
        let single = |v: &Vector| v.map(|c| c as f32).into();
        let pairs = self.points.iter().zip(&self.normals);
        PackedPoints { points: pairs.map(|(p, n)| pack(single(&p.coords), single(n), step)).collect(), step }
    }
}

impl PackedPoints {
    /// The points with their pose as one block of bytes, for firmware that carries a scan of its own.
    pub fn to_bytes(&self, pose: &Pose, hint: Hint) -> Vec<u8> {
        let points = self.points.as_flattened().iter().flat_map(|value| value.to_le_bytes());
        Bytes::head(self.step, pose, hint).into_iter().chain(points).collect()
    }

    /// The points for the core.
    ///
    /// # Errors
    /// Points whose extent is not a finite number.
    pub fn cloud(&self) -> Result<Cloud<'_>, lacuna::Error> {
        Cloud::new(&self.points, self.step)
    }
}
