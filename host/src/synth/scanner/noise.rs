//! What makes a measurement differ from the surface, without regard to the surface.

use crate::synth::Random;

/// Random numbers on a coarse lattice over the picture, interpolated: smooth noise of deviation about 1.
pub(super) struct SmoothNoise {
    columns: usize,
    spacing: f64,
    values: Vec<f64>,
}

impl SmoothNoise {
    /// For pictures of `size`; `spacing` is the distance of the lattice points in pixels.
    pub fn new(size: (u32, u32), spacing: f64, random: &mut Random) -> Self {
        let count = |pixels: u32| (f64::from(pixels) / spacing) as usize + 3;
        let (columns, rows) = (count(size.0), count(size.1));
        // Interpolation averages: half the lattice's variance is left on average.
        let values = (0..columns * rows).map(|_| random.normal() * 1.4).collect();
        Self { columns, spacing, values }
    }

    /// The noise at a pixel.
    pub fn at(&self, column: u32, row: u32) -> f64 {
        let (x, y) = (f64::from(column) / self.spacing, f64::from(row) / self.spacing);
        let (i, j) = (x as usize, y as usize);
        let (u, v) = (ease(x - i as f64), ease(y - j as f64));
        let value = |di: usize, dj: usize| self.values[(j + dj) * self.columns + i + di];
        let upper = value(0, 0) * (1.0 - u) + value(1, 0) * u;
        let lower = value(0, 1) * (1.0 - u) + value(1, 1) * u;
        upper * (1.0 - v) + lower * v
    }
}

fn ease(t: f64) -> f64 {
    t * t * (3.0 - 2.0 * t)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn smooth_noise_is_smooth_and_of_deviation_one() {
        let noise = SmoothNoise::new((320, 240), 20.0, &mut Random::new(1, 1));
        let all: Vec<f64> = (0..320 * 240).map(|i| noise.at(i % 320, i / 320)).collect();
        let variance = all.iter().map(|x| x * x).sum::<f64>() / all.len() as f64;
        assert!((0.6..1.5).contains(&variance), "{variance}");
        let jump = (1..320).map(|c| (noise.at(c, 7) - noise.at(c - 1, 7)).abs()).fold(0.0, f64::max);
        assert!(jump < 0.5);
    }
}
