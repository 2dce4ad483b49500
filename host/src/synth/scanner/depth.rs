//! From lines of sight to a depth image: drop-outs at jumps, noise, specks.

use super::camera::Camera;
use super::noise::SmoothNoise;
use super::optics::Scene;
use super::{Settings, UNITS_PER_MM};
use crate::synth::Random;
use rayon::prelude::*;

/// Pixels between the nodes of the smooth noise, in a picture 640 pixels wide.
const SMOOTH_SPACING: f64 = 24.0;

/// A picture of depths in millimetres, row by row; `None` where nothing was measured.
pub(super) struct Depths {
    pub width: usize,
    pub values: Vec<Option<f64>>,
}

impl Depths {
    /// What the camera measures of the scene; the rows are independent of each other, so that the
    /// number of threads changes nothing.
    pub fn measure(scene: &Scene<'_>, settings: &Settings, seed: u64, stream: u64) -> Self {
        let camera = scene.camera;
        let row = |row: u32| {
            let mut random = Random::new(seed, stream + 1 + u64::from(row));
            (0..camera.width).map(move |column| scene.measure(column, row, random.unit())).collect::<Vec<_>>()
        };
        let values = (0..camera.height).into_par_iter().flat_map_iter(row).collect();
        let mut depths = Self { width: camera.width as usize, values };
        depths.drop_jumps(settings.jump_mm);
        let mut random = Random::new(seed, stream);
        depths.add_noise(camera, settings, &mut random);
        depths.add_specks(random.below(6) + 3, &mut random);
        depths
    }

    /// Rows and columns of the 3 x 3 pixels around pixel `index`, itself included.
    fn around(&self, index: usize) -> impl Iterator<Item = usize> + '_ {
        let (row, column) = (index / self.width, index % self.width);
        let rows = row.saturating_sub(1)..(row + 2).min(self.values.len() / self.width);
        let columns = column.saturating_sub(1)..(column + 2).min(self.width);
        rows.flat_map(move |r| columns.clone().map(move |c| r * self.width + c))
    }

    fn drop_jumps(&mut self, jump_mm: f64) {
        let jumps = |index: usize, depth: f64| {
            self.around(index).filter_map(|i| self.values[i]).any(|other| (other - depth).abs() > jump_mm)
        };
        let kept = (0..self.values.len()).map(|i| self.values[i].filter(|&depth| !jumps(i, depth)));
        self.values = kept.collect();
    }

    fn add_noise(&mut self, camera: &Camera, settings: &Settings, random: &mut Random) {
        let spacing = SMOOTH_SPACING * f64::from(camera.width) / 640.0;
        let smooth = SmoothNoise::new((camera.width, camera.height), spacing, random);
        for (i, value) in self.values.iter_mut().enumerate() {
            if let Some(depth) = value {
                let (column, row) = ((i % self.width) as u32, (i / self.width) as u32);
                *depth +=
                    settings.noise_mm * random.normal() + settings.smooth_noise_mm * smooth.at(column, row);
            }
        }
    }

    /// Floating specks: patches of a few pixels in front of the object or beside it.
    fn add_specks(&mut self, count: usize, random: &mut Random) {
        let seen: Vec<f64> = self.values.iter().flatten().copied().collect();
        let Some(nearest) = seen.iter().copied().min_by(f64::total_cmp) else { return };
        let rows = self.values.len() / self.width;
        for _ in 0..count {
            let at = [random.range(0.15, 0.85) * self.width as f64, random.range(0.1, 0.9) * rows as f64];
            let radius = random.range(1.2, 3.2);
            let depth = nearest + random.range(-40.0, 160.0);
            for i in 0..self.values.len() {
                let (dx, dy) = ((i % self.width) as f64 - at[0], (i / self.width) as f64 - at[1]);
                if dx * dx + dy * dy < radius * radius {
                    self.values[i] = Some(depth + 0.6 * random.normal());
                }
            }
        }
    }

    /// The picture as it is stored; 0 where nothing was measured.
    pub fn quantised(&self) -> Vec<u16> {
        let grey = |depth: &Option<f64>| {
            let units = libm::round(depth.unwrap_or(0.0) * UNITS_PER_MM).clamp(0.0, f64::from(u16::MAX));
            units as u16
        };
        self.values.iter().map(grey).collect()
    }
}
