//! The similarity that minimises the squared distance of pairs, in closed form (Umeyama 1991; the step of the paper's ICP,
//! section 3.1).

use crate::mesh::{Point, Vector};
use nalgebra::{Matrix3, Rotation3, Similarity3, Translation3, UnitQuaternion};

/// The similarity that takes the first points of the pairs to the second ones. `None` for fewer than eight pairs, or where
/// they lie in one place.
pub fn similarity(pairs: &[(Point, Point)]) -> Option<Similarity3<f64>> {
    if pairs.len() < 8 {
        return None;
    }
    let n = pairs.len() as f64;
    let mean = |pick: fn(&(Point, Point)) -> &Point| {
        pairs.iter().fold(Vector::zeros(), |sum, pair| sum + pick(pair).coords) / n
    };
    let (from, to) = (mean(|p| &p.0), mean(|p| &p.1));
    let mut covariance = Matrix3::zeros();
    let (mut spread_from, mut spread_to) = (0.0, 0.0);
    for (p, q) in pairs {
        let (a, b) = (p.coords - from, q.coords - to);
        covariance += b * a.transpose();
        spread_from += a.norm_squared();
        spread_to += b.norm_squared();
    }
    let svd = covariance.svd(true, true);
    let (u, v_t) = (svd.u?, svd.v_t?);
    let mut sign = Matrix3::identity();
    sign[(2, 2)] = (u * v_t).determinant().signum();
    let rotation = Rotation3::from_matrix_unchecked(u * sign * v_t);
    // The ratio of spreads treats both sides alike; the least squares scale would shrink with noise.
    let scale = (spread_to / spread_from).sqrt();
    let translation = to - rotation * from * scale;
    let usable = scale.is_finite() && scale > 0.0 && translation.iter().all(|t| t.is_finite());
    let turn = UnitQuaternion::from_rotation_matrix(&rotation);
    usable.then(|| Similarity3::from_parts(Translation3::from(translation), turn, scale))
}
