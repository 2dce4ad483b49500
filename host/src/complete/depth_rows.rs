//! A depth image as a scanner sends it: the core makes the points, row by row, with no mesh in between.

use super::start::{CELL, Start, Thinned, place};
use super::{Error, Options};
use crate::depth_view::DepthView;
use crate::mesh::{Mesh, Point, Vector};
use crate::points::{OrientedPoints, PackedPoints};
use crate::register::Placed;
use crate::similarity::scale_and_rotation;
use lacuna::cloud::{CAPACITY, step_for};
use lacuna::curve::along_curve;
use lacuna::depth::{Camera, Frame, Rows};
use lacuna::{Model, Pose};
use nalgebra::Matrix3;

/// A depth image and where it was taken from.
#[derive(Clone, Debug)]
pub struct DepthImage {
    camera: Camera,
    /// Row by row; 0 is "not measured".
    depth: Vec<u16>,
    /// Largest step between neighbouring pixels of a surface, millimetres.
    jump: f64,
    /// Distance of neighbouring points, scan units.
    pitch: f64,
    /// From the camera to the scan: p = s R p_camera + t.
    scale: f64,
    rotation: Matrix3<f64>,
    translation: Vector,
}

/// A depth image as it is sent.
#[derive(Clone, Debug)]
pub struct Depth {
    /// How pixels become points.
    pub frame: Frame,
    /// Row by row; 0 is "not measured".
    pub pixels: Vec<u16>,
}

/// A depth image that becomes a cloud, and the cloud.
#[derive(Clone, Debug)]
pub struct DepthScan {
    /// What a device is sent.
    pub image: Depth,
    /// The points, as a device makes them too.
    pub packed: PackedPoints,
}

impl DepthImage {
    /// An image whose scan has `factor` scan units a millimetre.
    ///
    /// # Errors
    /// What of the view the core does not take, as a sentence.
    pub fn new(view: &DepthView, factor: f64) -> Result<Self, String> {
        const MOST: usize = u16::MAX as usize;
        if view.width.max(view.height) > MOST {
            let size = format!("{} x {}", view.width, view.height);
            return Err(format!(
                "the image has {size} pixels, at most {MOST} may be in a row or column: cut it"
            ));
        }
        let linear = view.camera_to_scan.fixed_view::<3, 3>(0, 0).into_owned();
        let Some((scale, rotation)) = scale_and_rotation(&linear) else {
            let hint = "correct it, or leave out --depth-rows";
            return Err(format!("camera_to_scan is not a rotation with a positive scale: {hint}"));
        };
        let camera = Camera {
            width: view.width as u16,
            height: view.height as u16,
            fx: view.fx as f32,
            fy: view.fy as f32,
            cx: view.cx as f32,
            cy: view.cy as f32,
            unit: view.unit_mm as f32,
        };
        camera.check().map_err(|error| crate::sentence::sentence("the model", &error))?;
        let translation: Vector = view.camera_to_scan.fixed_view::<3, 1>(0, 3).into_owned() * factor;
        let (depth, jump, pitch) = (view.depth.clone(), view.jump_mm(), view.pixel_mm() * scale * factor);
        Ok(Self { camera, depth, jump, pitch, scale: scale * factor, rotation, translation })
    }

    /// The image as a cloud in the pose of its mesh `scan`, with as many points as that gives thinned; and the pose
    /// for these points.
    ///
    /// # Errors
    /// A mesh without an extent.
    pub fn placed(&self, scan: &Mesh, hint: &Placed) -> Result<(Placed, DepthScan), lacuna::Error> {
        let (low, high) = scan.bounds().unwrap_or_default();
        let (centre, extent) = (nalgebra::center(&low, &high), (high - low).amax() / 2.0);
        let (step, cell) = (step_for(extent as f32), CELL / f64::from(hint.pose.scale));
        Ok((hint.about(centre), self.packed(&centre, step, cell)?))
    }

    /// The cloud around `centre`, its points about `cell` scan units apart, farther where there would be more than
    /// [`CAPACITY`].
    fn packed(&self, centre: &Point, step: f32, cell: f64) -> Result<DepthScan, lacuna::Error> {
        let view = Pose {
            rotation: self.rotation.transpose().map(|c| c as f32).into(),
            scale: self.scale as f32,
            translation: (self.translation - centre.coords).map(|c| c as f32).into(),
        };
        let longest = self.camera.width.max(self.camera.height);
        let mut stride = (cell / self.pitch).round().clamp(1.0, f64::from(longest)) as u16;
        loop {
            let frame = Frame { camera: self.camera, jump: self.jump as f32, reach: REACH, stride, view };
            let points = points(&frame, step, &self.depth)?;
            if points.len() <= CAPACITY {
                let packed = PackedPoints { points, step };
                return Ok(DepthScan { image: Depth { frame, pixels: self.depth.clone() }, packed });
            }
            stride += 1;
        }
    }
}

/// Pixels to the neighbours that make a normal.
const REACH: u8 = 1;

/// The points of an image in the order of the curve.
fn points(frame: &Frame, step: f32, depth: &[u16]) -> Result<Vec<lacuna::cloud::Packed>, lacuna::Error> {
    let mut memory = vec![0; frame.required()];
    let mut rows = Rows::new(*frame, step, &mut memory)?;
    let width = usize::from(frame.camera.width);
    let (mut all, mut row_points) = (vec![], vec![[0; 6]; width]);
    for (v, row) in (0..frame.camera.height).zip(depth.chunks(width)) {
        let made =
            rows.take(frame.camera.number(0, v), (0, v), row.iter().copied(), &mut row_points).unwrap_or(0);
        all.extend_from_slice(&row_points[..made]);
    }
    along_curve(&mut all);
    Ok(all)
}

/// As [`start`](fn@super::start), with the points of a depth image in place of those of its mesh.
///
/// # Errors
/// A scan that does not fit the model.
pub fn start(
    model: &Model<'_>,
    scan: &Mesh,
    image: &DepthImage,
    options: &Options<'_>,
) -> Result<Start, Error> {
    let known = place(model, scan, options)?;
    let (rough, depth) = image.placed(scan, &known.placed).map_err(Error::Fit)?;
    let points = unpacked(&depth.packed).map_err(Error::Fit)?;
    let thinned = Thinned { points, elsewhere: 0.0, clutter: 0.0, rough };
    Ok(Start { thinned, known, depth: Some(depth) })
}

fn unpacked(packed: &PackedPoints) -> Result<OrientedPoints, lacuna::Error> {
    let cloud = packed.cloud()?;
    let mut points = OrientedPoints::default();
    for (point, normal) in (0..cloud.len()).filter_map(|i| cloud.point(i)) {
        points.points.push(Point::from(point.map(f64::from)));
        points.normals.push(Vector::from(normal.map(f64::from)));
    }
    Ok(points)
}
