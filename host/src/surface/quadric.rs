//! A quadric over a plane, h = c₀ + c₁ u + c₂ v + c₃ u² + c₄ u v + c₅ v², fitted by least squares to points as they come.

use nalgebra::{SMatrix, SVector};

/// Powers of u and v in the terms.
const TERMS: [[usize; 2]; 6] = [[0, 0], [1, 0], [0, 1], [2, 0], [1, 1], [0, 2]];

/// A term is left open by points of which less than this share of its squares is its own, and not that of the terms before it:
/// copies of few points beside each other. In a disc it is a half at least.
const OPEN: f64 = 1e-3;

/// Sums over the points: all that the normal equations need.
#[derive(Clone, Copy, Debug, Default)]
pub struct Moments {
    /// Of the products of powers of u and v up to the fourth: see [`place`].
    powers: [f64; 15],
    /// Of the heights times the terms.
    heights: [f64; 6],
    /// Of the squared heights.
    squares: f64,
}

/// What a fit tells, at u = v = 0 unless it says otherwise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quadric {
    /// Its height.
    pub height: f64,
    /// How it grows along u and v.
    pub slope: [f64; 2],
    /// The terms of the second degree: c₃, c₄, c₅.
    pub curvature: [f64; 3],
    /// Variance of that height, in variances of the points' heights.
    pub share: f64,
    /// Variance of the points' heights about it.
    pub variance: f64,
}

impl Quadric {
    /// Its height over (u, v).
    pub fn at(&self, u: f64, v: f64) -> f64 {
        let ([a, b], [aa, ab, bb]) = (self.slope, self.curvature);
        self.height + a * u + b * v + aa * u * u + ab * u * v + bb * v * v
    }
}

/// Where the sum of uᵃ vᵇ is.
const fn place(a: usize, b: usize) -> usize {
    (a + b) * (a + b + 1) / 2 + b
}

impl std::ops::AddAssign for Moments {
    fn add_assign(&mut self, other: Self) {
        let add = |sum: &mut [f64], more: &[f64]| sum.iter_mut().zip(more).for_each(|(a, b)| *a += b);
        add(&mut self.powers, &other.powers);
        add(&mut self.heights, &other.heights);
        self.squares += other.squares;
    }
}

impl Moments {
    /// Takes a point at height `h` over (u, v) in.
    pub fn add(&mut self, u: f64, v: f64, h: f64) {
        let (uu, uv, vv) = (u * u, u * v, v * v);
        let powers = [
            1.0,
            u,
            v,
            uu,
            uv,
            vv,
            uu * u,
            uu * v,
            u * vv,
            vv * v,
            uu * uu,
            uu * uv,
            uu * vv,
            uv * vv,
            vv * vv,
        ];
        self.powers.iter_mut().zip(powers).for_each(|(sum, power)| *sum += power);
        // The terms are the first six of the products.
        self.heights.iter_mut().zip(powers).for_each(|(sum, power)| *sum += h * power);
        self.squares += h * h;
    }

    /// The quadric of least squares; `None` without `least` points, or points that leave it open.
    pub fn fit(&self, least: f64) -> Option<Quadric> {
        let count = self.powers[0];
        if count < least.max(TERMS.len() as f64 + 1.0) {
            return None;
        }
        let entry = |i: usize, j: usize| {
            let ([a, b], [c, d]) = (TERMS[i], TERMS[j]);
            self.powers[place(a + c, b + d)]
        };
        let normal = SMatrix::<f64, 6, 6>::from_fn(entry).cholesky()?;
        let own = |i: usize| normal.l_dirty()[(i, i)].powi(2) / entry(i, i);
        if (0..TERMS.len()).any(|i| own(i) < OPEN) {
            return None;
        }
        let right = SVector::from(self.heights);
        let terms = normal.solve(&right);
        let left = (self.squares - terms.dot(&right)).max(0.0);
        let share = normal.solve(&SVector::<f64, 6>::ith(0, 1.0))[0];
        let variance = left / (count - TERMS.len() as f64);
        let (slope, curvature) = ([terms[1], terms[2]], [terms[3], terms[4], terms[5]]);
        let found = Quadric { height: terms[0], slope, curvature, share, variance };
        (found.height.is_finite() && share > 0.0).then_some(found)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn grid() -> impl Iterator<Item = (f64, f64)> {
        (0..49).map(|i| (f64::from(i % 7 - 3), f64::from(i / 7 - 3)))
    }

    proptest! {
        #[test]
        fn a_quadric_is_found_again(terms in prop::array::uniform6(-2.0f64..2.0)) {
            let mut moments = Moments::default();
            for (u, v) in grid() {
                let at: f64 = TERMS.iter().zip(terms).map(|(&[a, b], t)| t * u.powi(a as i32) * v.powi(b as i32)).sum();
                moments.add(u, v, at);
            }
            let found = moments.fit(0.0).unwrap();
            let of: [f64; 6] = std::array::from_fn(|i| match i {
                0 => found.height,
                1 | 2 => found.slope[i - 1],
                _ => found.curvature[i - 3],
            });
            prop_assert!(of.iter().zip(terms).all(|(a, b)| (a - b).abs() < 1e-9), "{of:?}");
            let at: f64 = TERMS.iter().zip(terms).map(|(&[a, b], t)| t * 2f64.powi(a as i32) * (-3f64).powi(b as i32)).sum();
            prop_assert!((found.at(2.0, -3.0) - at).abs() < 1e-7);
            prop_assert!(found.variance < 1e-9);
        }
    }

    #[test]
    fn the_share_is_the_variance_of_a_height_among_heights_of_variance_one() {
        // Heights of one at one point and zero elsewhere are the weights of the points in the height at the middle.
        let weight = |one: (f64, f64)| {
            let mut moments = Moments::default();
            grid().for_each(|(u, v)| moments.add(u, v, f64::from(u8::from((u, v) == one))));
            moments.fit(0.0).unwrap()
        };
        let squares: f64 = grid().map(|one| weight(one).height.powi(2)).sum();
        assert!((squares - weight((0.0, 0.0)).share).abs() < 1e-12, "{squares}");
    }

    #[test]
    fn too_few_points_and_points_on_a_line_leave_it_open() {
        let mut moments = Moments::default();
        (0..6).for_each(|i| moments.add(f64::from(i), f64::from(i * i % 5), 1.0));
        assert_eq!(moments.fit(0.0), None);
        moments.add(0.5, 3.5, 1.0);
        assert!(moments.fit(8.0).is_none() && moments.fit(0.0).is_some());
        let mut line = Moments::default();
        (0..50).for_each(|i| line.add(f64::from(i), 0.0, 1.0));
        assert_eq!(line.fit(0.0), None);
        let mut copies = Moments::default();
        for i in 0..60 {
            let (at, beside) = (f64::from(i % 4), f64::from(i) * 1e-6);
            copies.add(at * at - beside, at * at * at + beside, f64::from(i % 3));
        }
        assert_eq!(copies.fit(0.0), None, "of four points, each fifteen times");
    }
}
