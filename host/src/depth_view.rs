//! A depth image and the camera that took it.
//!
//! A pixel in column u and row v with the value d > 0 is the point
//! `Z = d unit_mm, X = (u - cx) / fx Z, Y = (v - cy) / fy Z` of a pinhole camera that looks along +Z with
//! x to the right and y down; pixel centres are at integers, 0 is "not measured". The view's
//! matrix takes it into the scan frame.

mod gaps;
mod grid;

use crate::mesh::Point;
use nalgebra::Matrix4;

/// One depth image and its camera.
#[derive(Clone, Debug, PartialEq)]
pub struct DepthView {
    /// `width` x `height` values, row by row from the top; 0 is "not measured".
    pub depth: Vec<u16>,
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Focal length along a row, pixels.
    pub fx: f64,
    /// Focal length along a column, pixels.
    pub fy: f64,
    /// Column of the optical axis; the centre of the first pixel is 0.
    pub cx: f64,
    /// Row of the optical axis.
    pub cy: f64,
    /// Millimetres per grey level.
    pub unit_mm: f64,
    /// Takes camera coordinates into the scan frame: p_scan = M p_camera.
    pub camera_to_scan: Matrix4<f64>,
}

impl DepthView {
    /// The value in column `u` and row `v`; 0 beyond the image.
    pub fn at(&self, u: usize, v: usize) -> u16 {
        let inside = u < self.width && v < self.height;
        if inside { self.depth.get(v * self.width + u).copied().unwrap_or(0) } else { 0 }
    }

    /// The point of the pixel in column `u` and row `v`, in the scan frame; none if unmeasured.
    pub fn point(&self, u: usize, v: usize) -> Option<Point> {
        let z = f64::from(self.at(u, v)) * self.unit_mm;
        let camera = Point::new((u as f64 - self.cx) / self.fx * z, (v as f64 - self.cy) / self.fy * z, z);
        let scan = self.camera_to_scan.fixed_view::<3, 4>(0, 0) * camera.to_homogeneous();
        (z > 0.0).then(|| Point::from(scan))
    }

    /// Median of the measured depths, millimetres; none if nothing was measured.
    pub fn median_depth_mm(&self) -> Option<f64> {
        let mut measured: Vec<u16> = self.depth.iter().copied().filter(|&d| d > 0).collect();
        let middle = measured.len() / 2;
        (!measured.is_empty()).then(|| f64::from(*measured.select_nth_unstable(middle).1) * self.unit_mm)
    }

    /// Width of a pixel at the median depth, millimetres; 0 if nothing was measured.
    pub fn pixel_mm(&self) -> f64 {
        self.median_depth_mm().unwrap_or(0.0) / self.fx.min(self.fy)
    }

    /// Largest difference in depth between neighbouring pixels of a surface, millimetres: twelve pixel widths. A
    /// surface as steep as that is seen at more than 85 degrees.
    pub fn jump_mm(&self) -> f64 {
        const JUMP_PIXELS: f64 = 12.0;
        JUMP_PIXELS * self.pixel_mm()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 3 x 2 pixels of half a millimetre a grey level, a camera moved by (10, 20, 30); one pixel is not measured.
    pub(super) fn view() -> DepthView {
        DepthView {
            depth: vec![4, 4, 0, 4, 4, 5],
            width: 3,
            height: 2,
            fx: 2.0,
            fy: 4.0,
            cx: 1.0,
            cy: 0.5,
            unit_mm: 0.5,
            camera_to_scan: Matrix4::new_translation(&[10.0, 20.0, 30.0].into()),
        }
    }

    #[test]
    fn pixels_become_points_of_the_scan_frame() {
        let view = view();
        assert_eq!(view.point(0, 0), Some(Point::new(-1.0 + 10.0, -0.25 + 20.0, 2.0 + 30.0)));
        assert_eq!((view.point(2, 0), view.point(7, 0)), (None, None));
        assert_eq!(view.median_depth_mm(), Some(2.0));
    }
}
