//! Depth frames: organised range images with pinhole intrinsics become oriented points, row by row.

use crate::pose::{cross, dot, zip};

/// A depth image and its camera. A pixel (u, v), both from 0 at the centre of the first pixel, sees
/// `((u - cx) / fx · Z, (v - cy) / fy · Z, Z)` with Z = value · unit; value 0 is "not measured".
#[derive(Clone, Copy, Debug)]
pub struct DepthFrame<'a> {
    /// Depths, row by row.
    pub depth: &'a [u16],
    /// Pixels in a row.
    pub width: u16,
    /// Focal length along u, pixels.
    pub fx: f32,
    /// Focal length along v, pixels.
    pub fy: f32,
    /// Principal point along u.
    pub cx: f32,
    /// Principal point along v.
    pub cy: f32,
    /// Scan units a grey level.
    pub unit: f32,
    /// Largest depth difference between neighbours of one surface, scan units.
    pub jump: f32,
}

impl DepthFrame<'_> {
    /// Rows of the image.
    pub fn height(&self) -> u16 {
        self.depth.len().checked_div(usize::from(self.width)).unwrap_or(0).min(usize::from(u16::MAX)) as u16
    }

    /// The point a pixel sees, in the camera's frame.
    pub fn point(&self, u: u16, v: u16) -> Option<[f32; 3]> {
        if u >= self.width {
            return None;
        }
        let value = self.depth.get(usize::from(v) * usize::from(self.width) + usize::from(u))?;
        if *value == 0 {
            return None;
        }
        let z = f32::from(*value) * self.unit;
        Some([(f32::from(u) - self.cx) / self.fx * z, (f32::from(v) - self.cy) / self.fy * z, z])
    }

    /// The point and its unit normal towards the camera, from the neighbours `step` pixels away; `None`
    /// where a neighbour is missing or beyond a depth jump: there the surface ends.
    pub fn oriented(&self, u: u16, v: u16, step: u16) -> Option<([f32; 3], [f32; 3])> {
        let [x, y, z] = self.point(u, v)?;
        let neighbour = |u: Option<u16>, v: Option<u16>| {
            let point = self.point(u?, v?)?;
            let [_, _, depth] = point;
            ((depth - z).abs() <= self.jump).then_some(point)
        };
        let left = neighbour(u.checked_sub(step), Some(v))?;
        let right = neighbour(u.checked_add(step), Some(v))?;
        let above = neighbour(Some(u), v.checked_sub(step))?;
        let below = neighbour(Some(u), v.checked_add(step))?;
        let difference = |a: [f32; 3], b: [f32; 3]| zip(a, b, |p, q| p - q);
        let normal = cross(difference(below, above), difference(right, left));
        let length = libm::sqrtf(dot(normal, normal));
        if length <= 0.0 || length.is_nan() {
            return None;
        }
        let normal = normal.map(|c| c / length);
        let away = dot(normal, [x, y, z]) > 0.0;
        Some(([x, y, z], if away { normal.map(|c| -c) } else { normal }))
    }

    /// All oriented points of a row.
    pub fn row(&self, v: u16, step: u16) -> impl Iterator<Item = ([f32; 3], [f32; 3])> + '_ {
        (0..self.width).filter_map(move |u| self.oriented(u, v, step))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(depth: &[u16]) -> DepthFrame<'_> {
        DepthFrame { depth, width: 5, fx: 10.0, fy: 10.0, cx: 2.0, cy: 2.0, unit: 0.5, jump: 9.0 }
    }

    #[test]
    fn a_wall_faces_the_camera() {
        let depth = [200; 25];
        let (point, normal) = frame(&depth).oriented(2, 2, 1).unwrap();
        assert_eq!((point, normal), ([0.0, 0.0, 100.0], [0.0, 0.0, -1.0]));
        assert_eq!(frame(&depth).row(2, 1).count(), 3);
    }

    #[test]
    fn missing_and_far_neighbours_end_the_surface() {
        let mut depth = [200; 25];
        depth[7] = 0;
        assert!(frame(&depth).oriented(2, 2, 1).is_none());
        depth[7] = 300;
        assert!(frame(&depth).oriented(2, 2, 1).is_none());
        assert!(frame(&depth).point(9, 0).is_none() && frame(&depth).point(0, 9).is_none());
    }
}
