//! Ambient occlusion: how much of its surroundings a surface sees, estimated from the depths around
//! it in the picture (McGuire et al., "The Alchemy screen-space ambient obscurance algorithm", 2011).

use super::camera::View;
use super::light::Triple;
use super::raster::Hit;
use super::shade::{SAMPLES, pixel_samples};

/// Places looked at.
const TAPS: usize = 24;
/// Reach, as a part of the scene's radius.
const REACH: f64 = 0.22;
/// How strongly covered surroundings darken.
const STRENGTH: f32 = 1.1;
/// A surface must rise this much (sine of the angle) before it covers anything.
const BIAS: f32 = 0.08;

/// The places to look at and the depths found there.
pub struct Occlusion<'a> {
    view: &'a View,
    /// One depth for each pixel, that of the first sample with a surface; minus infinity for none.
    depths: Vec<f32>,
    /// Pixels in a row.
    width: usize,
    /// Rows.
    height: usize,
    /// Offsets in pixels, at zoom 1.
    taps: [[f32; 2]; TAPS],
    reach: f32,
}

impl<'a> Occlusion<'a> {
    /// For a drawn mesh; `size` counts samples.
    pub fn new(view: &'a View, hits: &[Hit], size: [usize; 2]) -> Self {
        let [width, height] = size.map(|length| length / SAMPLES);
        let first = |x: usize, y: usize| {
            let samples = pixel_samples(x, y).map(|[x, y]| hits[y * size[0] + x]);
            samples.iter().find(|hit| hit.is_surface()).map_or(f32::NEG_INFINITY, |hit| hit.depth)
        };
        let depths =
            (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| first(x, y)).collect();
        let reach = (REACH * view.radius) as f32;
        Self {
            view,
            depths,
            width,
            height,
            taps: sunflower(reach * view.scale as f32 / SAMPLES as f32),
            reach,
        }
    }

    /// How much of its surroundings is open, 0 to 1, for the surface seen in the pixel (x, y).
    pub fn open(&self, normal: &Triple, [x, y]: [usize; 2]) -> f32 {
        let here = [x as f32, y as f32, self.depths[y * self.width + x]];
        let (place, [xs, ys, depths]) = (self.place(here), self.surroundings(here));
        let mut covers = [0.0; TAPS];
        for i in 0..TAPS {
            covers[i] = self.cover(&(self.place([xs[i], ys[i], depths[i]]) - place), normal);
        }
        let open = (1.0 - STRENGTH * covers.iter().sum::<f32>() / TAPS as f32).max(0.0);
        open * (0.4 + 0.6 * open)
    }

    /// Pixels around a pixel: their x, their y, their depths. The pixel itself, which covers nothing,
    /// stands for those without a surface, so that what follows has no branches.
    fn surroundings(&self, here: [f32; 3]) -> [[f32; TAPS]; 3] {
        let zoom = self.view.zoom(here[2]);
        let mut found = here.map(|value| [value; TAPS]);
        for (i, [dx, dy]) in self.taps.iter().enumerate() {
            let (x, y) = ((here[0] + dx * zoom) as i32, (here[1] + dy * zoom) as i32);
            let depth = self.depth(x, y);
            if depth > f32::NEG_INFINITY {
                (found[0][i], found[1][i], found[2][i]) = (x as f32, y as f32, depth);
            }
        }
        found
    }

    fn depth(&self, x: i32, y: i32) -> f32 {
        // A negative number becomes a very large one.
        let (x, y) = (x as u32 as usize, y as u32 as usize);
        if x < self.width && y < self.height { self.depths[y * self.width + x] } else { f32::NEG_INFINITY }
    }

    /// What a surface at a distance covers: the sine of its height over the tangent plane, less
    /// the farther away it is.
    fn cover(&self, to: &Triple, normal: &Triple) -> f32 {
        let square = to.norm_squared();
        let sine = to.dot(normal) / square.sqrt().max(1e-3 * self.reach);
        let nearness = 1.0 - square / (self.reach * self.reach);
        (sine - BIAS).max(0.0) * nearness.max(0.0)
    }

    /// View coordinates of what is seen in a pixel: x, y, depth.
    fn place(&self, [x, y, depth]: [f32; 3]) -> Triple {
        let sample = |pixel: f32| (pixel + 0.5) * SAMPLES as f32;
        self.view.unproject(sample(x), sample(y), depth)
    }
}

/// A sunflower's pattern, denser towards the centre.
fn sunflower(radius: f32) -> [[f32; 2]; TAPS] {
    std::array::from_fn(|i| {
        let angle = 2.399_963_2 * i as f32;
        let distance = radius * (i as f32 + 0.5) / TAPS as f32;
        [distance * libm::cosf(angle), distance * libm::sinf(angle)]
    })
}

#[cfg(test)]
mod tests {
    use super::super::camera::Camera;
    use super::*;
    use crate::mesh::{Point, Vector};

    /// Depths over a picture of 64 by 64 pixels that is 64 units wide.
    fn open(depth: impl Fn(f32) -> f32, at: [usize; 2]) -> f32 {
        let camera = Camera { lens: f64::INFINITY, ..Camera::new(-Vector::z(), Vector::y()) };
        let corners = [Point::new(0.0, 0.0, 0.0), Point::new(64.0, 64.0, 0.0)];
        let view = View::fit(&camera, &[&corners], [128, 128]);
        let hits: Vec<Hit> =
            (0..128 * 128).map(|i| Hit { depth: depth((i % 128 / 2) as f32), item: 0 }).collect();
        Occlusion::new(&view, &hits, [128, 128]).open(&Triple::z(), at)
    }

    #[test]
    fn a_plane_is_open_and_the_bottom_of_a_groove_is_not() {
        assert_eq!(open(|_| 3.0, [32, 32]), 1.0);
        let groove = |x: f32| (x - 32.0).abs();
        assert!(open(groove, [32, 32]) < 0.8);
        assert!(open(groove, [32, 32]) < open(|x| 0.3 * groove(x), [32, 32]));
    }

    #[test]
    fn what_is_far_in_front_covers_little() {
        let wall = |height: f32| move |x: f32| if x > 36.0 { height } else { 0.0 };
        assert!(open(wall(500.0), [32, 32]) > open(wall(4.0), [32, 32]));
    }
}
