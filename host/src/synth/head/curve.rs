//! Smooth scalar functions the shape is made of.

/// `exp(-r^2 / 2)`.
pub(super) fn bell(r: f64) -> f64 {
    libm::exp(-0.5 * r * r)
}

/// Bell around (`cx`, `cy`) with deviations `sx`, `sy`.
pub(super) fn bump([x, y]: [f64; 2], [cx, cy]: [f64; 2], [sx, sy]: [f64; 2]) -> f64 {
    let (u, v) = ((x - cx) / sx, (y - cy) / sy);
    libm::exp(-0.5 * (u * u + v * v))
}

/// 0 below `from`, 1 above `to` (or the other way round if `from > to`), twice differentiable.
pub(super) fn step(from: f64, to: f64, x: f64) -> f64 {
    let t = ((x - from) / (to - from)).clamp(0.0, 1.0);
    t * t * t * (t * (6.0 * t - 15.0) + 10.0)
}

/// Uniform cubic B-spline over heights: knots from [`Profile::LOW`] on, [`Profile::SPACING`] mm apart.
pub(super) struct Profile(pub [f64; 20]);

impl Profile {
    const LOW: f64 = -150.0;
    const SPACING: f64 = 15.0;

    /// The value at height `y`; constant beyond the ends.
    pub fn at(&self, y: f64) -> f64 {
        let position = ((y - Self::LOW) / Self::SPACING).clamp(0.0, self.0.len() as f64 - 1.0);
        let knot = position as usize;
        let t = position - knot as f64;
        let value = |offset: usize| self.0[(knot + offset).saturating_sub(1).min(self.0.len() - 1)];
        let s = 1.0 - t;
        let weights =
            [s * s * s, 3.0 * t * t * t - 6.0 * t * t + 4.0, 3.0 * s * s * s - 6.0 * s * s + 4.0, t * t * t];
        weights.iter().enumerate().map(|(i, w)| w * value(i)).sum::<f64>() / 6.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_profile_reproduces_straight_lines() {
        let line = Profile(std::array::from_fn(|i| 3.0 + 2.0 * i as f64));
        for y in [-120.0, -3.7, 0.0, 88.0] {
            let expected = 3.0 + 2.0 * (y + 150.0) / 15.0;
            assert!((line.at(y) - expected).abs() < 1e-12);
        }
        assert!(line.at(-1e9).is_finite() && line.at(1e9).is_finite());
    }

    #[test]
    fn a_step_runs_both_ways() {
        assert_eq!((step(0.0, 1.0, -1.0), step(0.0, 1.0, 0.5), step(0.0, 1.0, 2.0)), (0.0, 0.5, 1.0));
        assert_eq!((step(1.0, 0.0, -1.0), step(1.0, 0.0, 2.0)), (1.0, 0.0));
    }
}
