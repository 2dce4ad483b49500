//! Pictures of what a model has learnt: its first modes from -3 to +3 standard deviations around the mean.

use crate::complete::extrapolate::extrapolated;
use crate::complete::picture::directions;
use crate::complete::zero_level;
use crate::mesh::{Mesh, Point};
use crate::register::Placed;
use crate::render::{Camera, Image, Panel, picture};
use lacuna::format::PER_VOXEL;
use lacuna::{Model, Pose, sample};
use rayon::prelude::*;

/// Standard deviations of the columns.
const STEPS: [f32; 5] = [-3.0, -1.5, 0.0, 1.5, 3.0];

/// Draws the first `count` modes (at most all of them), a row each, the mean in the middle column. Each panel is
/// `width` × `height` pixels; the panels of a row have one scale.
pub fn draw(model: &Model<'_>, count: usize, width: usize, height: usize) -> Image {
    let mean = instance(model, 0, 0.0);
    let (front, up) = directions(&mean, &[]);
    // A little from the side, so that depth shows.
    let camera = Camera::new(-front - 0.5 * up.cross(&front), up);
    let rows: Vec<Image> =
        (0..count.min(model.modes())).map(|mode| row(model, mode, &camera, [width, height])).collect();
    Image::stack(&rows)
}

fn row(model: &Model<'_>, mode: usize, camera: &Camera, [width, height]: [usize; 2]) -> Image {
    let meshes: Vec<Mesh> = STEPS.par_iter().map(|&sigmas| instance(model, mode, sigmas)).collect();
    let titles = STEPS.map(|sigmas| match sigmas {
        0.0 => "mean".to_owned(),
        _ => format!("mode {} at {sigmas:+}", mode + 1),
    });
    let panels: Vec<Panel<'_>> =
        meshes.iter().zip(&titles).map(|(mesh, title)| Panel { mesh, colours: None, title }).collect();
    picture(&panels, camera, width, height)
}

/// The surface of M + v b', in voxels, for one mode and its weight in standard deviations.
fn instance(model: &Model<'_>, mode: usize, sigmas: f32) -> Mesh {
    let mut distances = vec![0; model.voxels()];
    for brick in model.bricks() {
        let unit = brick.exponents().get(mode).map_or(0.0, |&e| PER_VOXEL * sample::power(e));
        for voxel in 0..brick.voxels() {
            let b = brick.basis(voxel).get(mode).map_or(0, |&b| b as i8);
            let distance = f32::from(brick.mean(voxel)) + sigmas * f32::from(b) * unit;
            distances[brick.first + voxel] = distance.round() as i16;
        }
    }
    let still = Placed { centre: Point::origin(), pose: Pose::IDENTITY };
    zero_level::surface(&extrapolated(model, &distances), &still, 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn model() -> Model<'static> {
        Model::from_bytes(lacuna_fixtures::MODEL).unwrap()
    }

    #[test]
    fn opposite_weights_move_the_surface_opposite_ways() {
        let model = model();
        let sides = |sigmas| {
            let (low, high) = instance(&model, 0, sigmas).bounds().unwrap();
            high - low
        };
        let (minus, plus) = (sides(-3.0) - sides(0.0), sides(3.0) - sides(0.0));
        assert!(minus.norm() > 1.0 && plus.norm() > 1.0, "{minus} {plus}");
        assert!(minus.dot(&plus) < 0.0, "{minus} {plus}");
    }

    #[test]
    fn a_row_a_mode_and_a_column_a_step() {
        let image = draw(&model(), 2, 40, 50);
        assert_eq!(image.width, 5 * 40);
        assert!(image.height >= 2 * 50);
    }
}
