//! From what each sample shows to the colours of pixels.

use super::camera::{Spot, View};
use super::image::{Image, PAPER};
use super::light::{BACK, CLAY, Triple, linear, reflect, screen};
use super::occlusion::Occlusion;
use super::raster::{Hit, sample_place, twice_area};
use crate::mesh::Mesh;
use rayon::prelude::*;

/// Samples along each side of a pixel.
pub const SAMPLES: usize = 2;

/// The samples of a pixel.
pub fn pixel_samples(x: usize, y: usize) -> [[usize; 2]; SAMPLES * SAMPLES] {
    std::array::from_fn(|i| [SAMPLES * x + i % SAMPLES, SAMPLES * y + i / SAMPLES])
}

/// A drawn mesh with all that is needed to colour it.
pub struct Shading<'a> {
    triangles: &'a [[u32; 3]],
    spots: &'a [Option<Spot>],
    hits: &'a [Hit],
    /// Samples in a row and rows of samples.
    size: [usize; 2],
    /// In view coordinates, one a vertex.
    normals: Vec<Triple>,
    /// Linear, one a vertex, or none for clay.
    colours: Option<Vec<Triple>>,
    occlusion: Occlusion<'a>,
    paper: Triple,
    clay: Triple,
}

/// The surface in a sample.
struct Patch {
    normal: Triple,
    colour: Triple,
}

impl<'a> Shading<'a> {
    /// Prepares normals and colours; colours that are not one for each vertex are ignored.
    pub fn new(
        mesh: &'a Mesh,
        colours: Option<&[[u8; 3]]>,
        drawn: (&'a [Option<Spot>], &'a [Hit]),
        view: &'a View,
        size: [usize; 2],
    ) -> Self {
        let (spots, hits) = drawn;
        let normals = mesh.vertex_normals().iter().map(|normal| view.turn_direction(normal)).collect();
        let colours = colours.filter(|colours| colours.len() == mesh.points.len());
        let colours = colours.map(|colours| colours.iter().map(|&colour| linear(colour)).collect());
        Self {
            triangles: &mesh.triangles,
            spots,
            hits,
            size,
            normals,
            colours,
            occlusion: Occlusion::new(view, hits, size),
            paper: linear(PAPER),
            clay: linear(CLAY),
        }
    }

    /// Colours all pixels.
    pub fn develop(&self) -> Image {
        let [width, height] = self.size.map(|length| length / SAMPLES);
        let mut image = Image::blank(width, height);
        image.rgb.par_chunks_mut((3 * width).max(1)).enumerate().for_each(|(y, row)| {
            for (x, rgb) in row.as_chunks_mut::<3>().0.iter_mut().enumerate() {
                if let Some(light) = self.pixel(x, y) {
                    *rgb = screen(&light);
                }
            }
        });
        image
    }

    /// The light of a pixel; `None` if all its samples show the background. The mean of the patches
    /// is lit once, and the paper shines through where samples have none.
    fn pixel(&self, x: usize, y: usize) -> Option<Triple> {
        let (mut normal, mut colour, mut count) = (Triple::zeros(), Triple::zeros(), 0.0);
        for patch in pixel_samples(x, y).into_iter().filter_map(|place| self.patch(place)) {
            (normal, colour, count) = (normal + patch.normal, colour + patch.colour, count + 1.0);
        }
        let normal = normal.try_normalize(1e-6)?;
        let light = reflect(&normal, &(colour / count), self.occlusion.open(&normal, [x, y]));
        Some(self.paper.lerp(&light, count / (SAMPLES * SAMPLES) as f32))
    }

    fn patch(&self, [x, y]: [usize; 2]) -> Option<Patch> {
        let hit = &self.hits[y * self.size[0] + x];
        if !hit.is_surface() {
            return None;
        }
        match self.triangles.get(hit.item as usize) {
            Some(triangle) => self.in_triangle(triangle.map(|v| v as usize), [x, y]),
            None => Some(self.at_vertex(hit.item as usize)),
        }
    }

    /// Between the corners, in perspective: a corner counts by its part of the area times its zoom.
    fn in_triangle(&self, corners: [usize; 3], [x, y]: [usize; 2]) -> Option<Patch> {
        let [a, b, c] = corners.map(|v| self.spots[v]);
        let spots = [a?, b?, c?];
        let [pa, pb, pc] = spots.map(|spot| [spot.x, spot.y]);
        let p = sample_place(x as i32, y as i32);
        let areas = [[p, pb, pc], [pa, p, pc], [pa, pb, p]].map(|corners| twice_area(corners) as f32);
        let parts: [f32; 3] = std::array::from_fn(|i| areas[i] * spots[i].zoom);
        let total: f32 = parts.iter().sum();
        let mix = |values: &[Triple]| (0..3).map(|i| values[corners[i]] * (parts[i] / total)).sum::<Triple>();
        let colour = self.colours.as_deref().map_or(self.clay, mix);
        Some(towards_viewer(mix(&self.normals), colour, total > 0.0))
    }

    /// A point of a cloud; without a normal it faces the viewer.
    fn at_vertex(&self, vertex: usize) -> Patch {
        let colour = self.colours.as_ref().map_or(self.clay, |colours| colours[vertex]);
        let normal = self.normals[vertex];
        towards_viewer(normal, colour, normal.z < 0.0)
    }
}

/// Turns a back side towards the viewer and darkens it. The normal of a front side may look away at
/// an outline; there it is laid flat.
fn towards_viewer(normal: Triple, colour: Triple, back: bool) -> Patch {
    let (normal, colour) =
        if back { (-normal, colour.component_mul(&Triple::from(BACK))) } else { (normal, colour) };
    let normal = Triple::new(normal.x, normal.y, normal.z.max(0.0));
    Patch { normal: normal.try_normalize(1e-6).unwrap_or_else(Triple::z), colour }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn back_sides_are_darker_and_face_the_viewer() {
        let (slant, colour) = (Triple::new(0.6, 0.0, -0.8), Triple::new(0.5, 0.5, 0.5));
        let back = towards_viewer(slant, colour, true);
        assert_eq!(back.normal, -slant);
        assert!(back.colour.max() < 0.5);
        assert_eq!(towards_viewer(slant, colour, false).normal, Triple::x());
        assert_eq!(towards_viewer(Triple::zeros(), colour, false).normal, Triple::z());
    }
}
