//! From model coordinates to samples of a picture.
//!
//! View coordinates are x to the right, y up, z towards the viewer, from the centre of the scene.

use crate::mesh::{Point, Vector};
use nalgebra::Matrix3;

/// Where a picture is taken from. What it shows always fits in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// From the viewer into the scene, in the model's frame; any length.
    pub direction: Vector,
    /// What shall be up in the picture; any length, need not be perpendicular.
    pub up: Vector,
    /// Distance of the eye, in radii of the scene; infinite for a parallel projection.
    pub lens: f64,
}

impl Camera {
    /// A camera with a long lens.
    pub fn new(direction: Vector, up: Vector) -> Self {
        Self { direction, up, lens: 9.0 }
    }

    /// Rows: right, up, towards the viewer. A direction or an up that says nothing is replaced.
    fn axes(&self) -> Matrix3<f64> {
        let unit = |v: Vector| v.try_normalize(1e-12).filter(|v| v.iter().all(|x| x.is_finite()));
        let back = unit(-self.direction).unwrap_or_else(Vector::z);
        let choices = [self.up, Vector::y(), Vector::z()];
        let right =
            choices.iter().filter_map(|up| unit(*up)).find_map(|up| up.cross(&back).try_normalize(1e-6));
        let right = right.unwrap_or_else(Vector::x);
        Matrix3::from_rows(&[right.transpose(), back.cross(&right).transpose(), back.transpose()])
    }
}

/// Steps of a sample in which places in the picture are counted: on whole numbers it is decided
/// without rounding which side of an edge a sample is on.
pub const STEPS: i32 = 16;

/// Farthest place from the picture's corner, in steps, so that products of places fit.
const FARTHEST: f64 = (1 << 24) as f64;

/// A point in the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spot {
    /// Steps to the right.
    pub x: i32,
    /// Steps down.
    pub y: i32,
    /// z × `zoom`: linear in the picture, larger is nearer.
    pub depth: f32,
    /// How much larger than in the centre of the scene things appear here.
    pub zoom: f32,
}

/// A camera that is set up for a scene and a picture.
#[derive(Clone, Debug)]
pub struct View {
    axes: Matrix3<f64>,
    centre: Point,
    /// One over the distance of the eye from the centre.
    bend: f64,
    /// Half the largest extent of the scene.
    pub radius: f64,
    /// Samples for a unit of length in the centre of the scene.
    pub scale: f64,
    /// Place of the scene's centre in the picture, in samples.
    shift: [f64; 2],
}

impl View {
    /// Fits all points into width by height samples, but for a few that lie far away from the others.
    pub fn fit(camera: &Camera, clouds: &[&[Point]], size: [usize; 2]) -> Self {
        let axes = camera.axes();
        let mut view =
            Self { axes, centre: Point::origin(), bend: 0.0, radius: 1.0, scale: 1.0, shift: [0.0; 2] };
        let points: Vec<Point> = clouds.iter().flat_map(|cloud| sparse(cloud)).collect();
        let [x, y, z] = [0, 1, 2].map(|axis| extent(points.iter().map(|p| view.turn(p)[axis])));
        view.centre = Point::from(axes.transpose() * Vector::new(middle(x), middle(y), middle(z)));
        view.radius =
            [x, y, z].map(|[low, high]| (high - low) / 2.0).into_iter().fold(0.0, f64::max).max(1e-9);
        view.bend = 1.0 / (camera.lens.max(1.5) * view.radius);
        view.aim(&points, size);
        view
    }

    /// Chooses scale and shift, with a rim of a few hundredths around the scene.
    fn aim(&mut self, points: &[Point], size: [usize; 2]) {
        let flat: Vec<Vector> = points.iter().filter_map(|p| self.flatten(p)).map(|(v, _)| v).collect();
        let [x, y] = [0, 1].map(|axis| extent(flat.iter().map(|v| v[axis])));
        let [width, height] = size.map(|length| length as f64);
        let fitting = |[low, high]: [f64; 2], room: f64| 0.94 * room / (high - low).max(1e-9 * self.radius);
        self.scale = fitting(x, width).min(fitting(y, height));
        self.shift = [width / 2.0 - middle(x) * self.scale, height / 2.0 + middle(y) * self.scale];
    }

    /// A point in view coordinates.
    fn turn(&self, point: &Point) -> Vector {
        self.axes * (point - self.centre)
    }

    /// A direction in view coordinates.
    pub fn turn_direction(&self, direction: &Vector) -> nalgebra::Vector3<f32> {
        (self.axes * direction).cast()
    }

    /// View coordinates times zoom, and the zoom; `None` beside or behind the eye.
    fn flatten(&self, point: &Point) -> Option<(Vector, f64)> {
        let place = self.turn(point);
        let zoom = 1.0 / (1.0 - place.z * self.bend);
        (zoom.is_finite() && (0.0..10.0).contains(&zoom)).then_some((place * zoom, zoom))
    }

    /// A point's place in the picture, if it has one.
    pub fn project(&self, point: &Point) -> Option<Spot> {
        let (place, zoom) = self.flatten(point)?;
        let steps = |samples: f64| {
            let steps = (samples * f64::from(STEPS)).round();
            (steps.abs() < FARTHEST).then_some(steps as i32)
        };
        let (x, y) = (self.shift[0] + place.x * self.scale, self.shift[1] - place.y * self.scale);
        Some(Spot { x: steps(x)?, y: steps(y)?, depth: place.z as f32, zoom: zoom as f32 })
    }

    /// The view coordinates of a place in the picture, in samples, with a known depth.
    pub fn unproject(&self, x: f32, y: f32, depth: f32) -> nalgebra::Vector3<f32> {
        let shrink = 1.0 / (self.scale as f32);
        let (x, y) = ((x - self.shift[0] as f32) * shrink, (self.shift[1] as f32 - y) * shrink);
        nalgebra::Vector3::new(x, y, depth) * (1.0 / self.zoom(depth))
    }

    /// The zoom that belongs to a depth.
    pub fn zoom(&self, depth: f32) -> f32 {
        1.0 + depth * self.bend as f32
    }
}

/// Some ten thousand points of a cloud, evenly over its order.
fn sparse(cloud: &[Point]) -> impl Iterator<Item = Point> {
    let finite = |p: &Point| p.iter().all(|x| x.is_finite());
    cloud.iter().step_by(cloud.len() / 20_000 + 1).copied().filter(finite)
}

fn middle([low, high]: [f64; 2]) -> f64 {
    (low + high) / 2.0
}

/// Smallest and largest value, where values beyond the outermost thousandths count only as far as
/// they are near to these: specks in a scan do not shrink the picture.
fn extent(values: impl Iterator<Item = f64>) -> [f64; 2] {
    let mut values: Vec<f64> = values.collect();
    values.sort_unstable_by(f64::total_cmp);
    let (Some(&first), Some(&last)) = (values.first(), values.last()) else {
        return [0.0; 2];
    };
    let trim = values.len() / 1000;
    let (low, high) = (values[trim], values[values.len() - 1 - trim]);
    let reach = (high - low) / 20.0;
    [first.max(low - reach), last.min(high + reach)]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cube() -> Vec<Point> {
        (0..8)
            .map(|i| Point::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2)) * 10.0)
            .collect()
    }

    #[test]
    fn the_scene_fits_and_stands_upright() {
        let camera = Camera::new(-Vector::z(), Vector::y());
        for camera in [camera, Camera { lens: f64::INFINITY, ..camera }] {
            let view = View::fit(&camera, &[&cube()], [200, 100]);
            let spots: Vec<Spot> = cube().iter().filter_map(|p| view.project(p)).collect();
            assert!(spots.iter().all(|s| (0..200 * STEPS).contains(&s.x) && (0..100 * STEPS).contains(&s.y)));
            assert!(spots[1].x > spots[0].x && spots[2].y < spots[0].y && spots[4].depth > spots[0].depth);
        }
    }

    #[test]
    fn a_near_side_is_larger_only_with_a_lens() {
        let width = |camera: Camera, first: usize| {
            let view = View::fit(&camera, &[&cube()], [1000, 1000]);
            view.project(&cube()[first + 1]).unwrap().x - view.project(&cube()[first]).unwrap().x
        };
        let camera = Camera::new(-Vector::z(), Vector::y());
        assert!(width(camera, 4) > width(camera, 0));
        let parallel = Camera { lens: f64::INFINITY, ..camera };
        assert_eq!(width(parallel, 4), width(parallel, 0));
    }

    #[test]
    fn places_lead_back_to_points() {
        let camera = Camera::new(Vector::new(0.3, -0.4, -1.0), Vector::y());
        let view = View::fit(&camera, &[&cube()], [500, 400]);
        for point in cube() {
            let spot = view.project(&point).unwrap();
            let place = view.unproject(spot.x as f32 / 16.0, spot.y as f32 / 16.0, spot.depth);
            assert!((place - view.turn(&point).cast()).norm() < 0.02);
        }
    }

    #[test]
    fn a_speck_far_away_does_not_matter() {
        let mut points: Vec<Point> =
            (0..2000).map(|i| Point::new(f64::from(i % 50), f64::from(i / 50), 0.0)).collect();
        let camera = Camera::new(-Vector::z(), Vector::y());
        let clean = View::fit(&camera, &[&points], [100, 100]).scale;
        points.push(Point::new(900.0, 0.0, 0.0));
        assert!(View::fit(&camera, &[&points], [100, 100]).scale > 0.9 * clean);
    }

    #[test]
    fn odd_cameras_and_scenes_do_no_harm() {
        for (direction, up) in [
            (Vector::zeros(), Vector::zeros()),
            (Vector::y(), Vector::y()),
            (Vector::x() * f64::NAN, Vector::x()),
        ] {
            let axes = Camera::new(direction, up).axes();
            assert!((axes * axes.transpose() - Matrix3::identity()).norm() < 1e-9);
        }
        let camera = Camera { lens: 0.0, ..Camera::new(Vector::x(), Vector::z()) };
        for points in [
            vec![],
            vec![Point::origin()],
            vec![Point::new(f64::NAN, 0.0, 0.0), Point::new(f64::MAX, 1.0, -f64::MAX)],
        ] {
            let view = View::fit(&camera, &[&points], [0, 7]);
            points.iter().for_each(|p| assert!(view.project(p).is_none_or(|spot| spot.depth.is_finite())));
        }
    }
}
