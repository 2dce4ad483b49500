//! Pictures of meshes and point clouds: panels side by side under studio light, with captions.
//!
//! The same input gives the same bytes, whatever the number of threads.

mod camera;
mod font;
mod image;
mod light;
mod occlusion;
mod raster;
mod shade;

pub use camera::Camera;
pub use image::{Image, MARK, PAPER};
pub use light::CLAY;

use crate::mesh::{Mesh, Point};
use camera::{Spot, View};
use font::Line;
use rayon::prelude::*;
use shade::{SAMPLES, Shading};

/// Colour of the captions.
const INK: [u8; 3] = [70, 72, 78];

/// One of the pictures in a row.
#[derive(Clone, Copy, Debug)]
pub struct Panel<'a> {
    /// What to show; a mesh without triangles is shown as discs at its points.
    pub mesh: &'a Mesh,
    /// One sRGB colour for each vertex; without them, or with another number of them, clay.
    pub colours: Option<&'a [[u8; 3]]>,
    /// The caption, ASCII; none if empty.
    pub title: &'a str,
}

/// Draws panels of the given size in a row, all from the same place and at the same scale. If any
/// panel has a title, a strip for the captions is added below.
pub fn picture(panels: &[Panel], camera: &Camera, panel_width: usize, panel_height: usize) -> Image {
    let size = [panel_width, panel_height].map(|length| length * SAMPLES);
    let clouds: Vec<&[Point]> = panels.iter().map(|panel| panel.mesh.points.as_slice()).collect();
    let view = View::fit(camera, &clouds, size);
    let drawings: Vec<Image> = panels.par_iter().map(|panel| draw(panel, &view, size)).collect();
    let captions = Captions::new(panels, panel_width);
    let mut sheet = Image::blank(panel_width * panels.len(), panel_height + captions.height());
    for (index, drawing) in drawings.iter().enumerate() {
        sheet.paste(drawing, index * panel_width, 0);
    }
    captions.write(&mut sheet, [panel_width, panel_height]);
    sheet
}

fn draw(panel: &Panel, view: &View, size: [usize; 2]) -> Image {
    let spots: Vec<Option<Spot>> = panel.mesh.points.iter().map(|point| view.project(point)).collect();
    let hits = raster::draw(panel.mesh, &spots, size);
    Shading::new(panel.mesh, panel.colours, (&spots, &hits), view, size).develop()
}

/// The lines below the panels, all in the same size.
struct Captions {
    lines: Vec<Line>,
    scale: usize,
}

impl Captions {
    /// Chooses a size that suits the panels and in which all lines fit.
    fn new(panels: &[Panel], panel_width: usize) -> Self {
        let lines: Vec<Line> = panels.iter().map(|panel| Line::new(panel.title)).collect();
        let longest = lines.iter().map(Line::width).max().unwrap_or(0).max(1);
        let scale = (panel_width / 200).min(panel_width / (longest + 4)).max(1);
        Self { lines, scale }
    }

    /// Height of the strip: the letters and as much room above and below.
    fn height(&self) -> usize {
        if self.lines.iter().all(|line| line.width() == 0) { 0 } else { 2 * font::HEIGHT * self.scale }
    }

    fn write(&self, sheet: &mut Image, panel: [usize; 2]) {
        for (index, line) in self.lines.iter().enumerate() {
            let left = index * panel[0] + panel[0].saturating_sub(line.width() * self.scale) / 2;
            line.write(sheet, [left, panel[1] + self.height() / 4], self.scale, INK);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Vector;

    /// A tent open at the bottom: four triangles that meet in a tip towards z.
    fn tent() -> Mesh {
        let points =
            [[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let triangles = vec![[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]];
        Mesh { points: points.map(Point::from).to_vec(), normals: Vec::new(), triangles }
    }

    fn front() -> Camera {
        Camera::new(-Vector::z(), Vector::y())
    }

    fn panel<'a>(mesh: &'a Mesh, colours: Option<&'a [[u8; 3]]>) -> Panel<'a> {
        Panel { mesh, colours, title: "" }
    }

    fn centre(image: &Image) -> [u8; 3] {
        let place = 3 * (image.height / 2 * image.width + image.width / 2);
        [0, 1, 2].map(|i| image.rgb[place + i])
    }

    #[test]
    fn the_same_bytes_for_every_number_of_threads() {
        let (mesh, titled) = (tent(), tent());
        let panels = [panel(&mesh, None), Panel { title: "tent", ..panel(&titled, None) }];
        let draw = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| picture(&panels, &front(), 150, 300))
        };
        assert_eq!(draw(1), draw(3));
    }

    #[test]
    fn colours_show_and_a_wrong_number_of_them_does_not() {
        let mesh = tent();
        let [red, green, blue] = centre(&picture(&[panel(&mesh, Some(&[[200, 0, 0]; 5]))], &front(), 60, 60));
        assert!(red > 100 && green < 90 && blue < 90);
        let clay = picture(&[panel(&mesh, None)], &front(), 60, 60);
        assert_eq!(picture(&[panel(&mesh, Some(&[[200, 0, 0]; 4]))], &front(), 60, 60), clay);
    }

    #[test]
    fn the_back_is_darker_than_the_front() {
        let mesh = tent();
        let behind = Camera::new(Vector::z(), Vector::y());
        let [front, back] =
            [front(), behind].map(|camera| centre(&picture(&[panel(&mesh, None)], &camera, 60, 60)));
        assert!(back[0] < front[0] / 2 + 40 && back != PAPER);
    }

    #[test]
    fn a_caption_adds_a_strip_with_ink() {
        let mesh = tent();
        let image =
            picture(&[Panel { title: "tent", ..panel(&mesh, None) }, panel(&mesh, None)], &front(), 80, 60);
        assert_eq!((image.width, image.height), (160, 78));
        let strip = &image.rgb[60 * 160 * 3..];
        assert!(strip.chunks(480).all(|row| row[240..].iter().all(|&value| value == 255)));
        assert!(strip.as_chunks::<3>().0.contains(&INK));
    }

    #[test]
    fn a_cloud_is_shown() {
        let points = (0..400).map(|i| Point::new(f64::from(i % 20), f64::from(i / 20), 0.0)).collect();
        let cloud = Mesh { points, ..Mesh::default() };
        assert_ne!(centre(&picture(&[panel(&cloud, None)], &front(), 60, 60)), PAPER);
    }

    #[test]
    fn odd_input_does_no_harm() {
        let (mesh, empty) = (tent(), Mesh::default());
        let single = Mesh { points: vec![Point::origin()], ..Mesh::default() };
        let broken = Mesh { points: vec![Point::new(f64::NAN, f64::INFINITY, 1.0); 5], ..tent() };
        for (width, height) in [(0, 0), (0, 5), (5, 0), (1, 1), (40, 30)] {
            let panels =
                [panel(&mesh, None), panel(&empty, None), panel(&single, None), panel(&broken, None)];
            let image = picture(&panels, &front(), width, height);
            assert_eq!(image.rgb.len(), 3 * image.width * image.height);
        }
        assert_eq!(picture(&[], &front(), 10, 10).width, 0);
    }
}
