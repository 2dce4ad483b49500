//! Fitted distances beyond the voxels that the model stores: by its far field, straight on, and by the scan itself.

use super::dense::Dense;
use crate::distance::Surface;
use crate::fit::{dense, means};
use crate::mesh::Point;
use crate::raster;
use crate::register::Placed;
use lacuna::{Model, sample};
use rayon::prelude::*;

/// Layers around the stored voxels that are extrapolated.
const LAYERS: usize = 5;
/// Layers beyond the support, where nearly all training shapes have ended, that go on straight.
const BEYOND: usize = 2;
/// Largest difference between far field and mean, voxels, where the far field is relied on.
const FAITHFUL: f32 = 0.35;

/// Fitted distances of the stored voxels and of `LAYERS` layers around them: there the far field's mean plus the deviation
/// of the nearest stored voxels, which is smooth. Somebody may be farther from the mean than the model stores.
pub fn extrapolated(model: &Model<'_>, distances: &[i16]) -> Dense {
    let mut field = Dense { sides: model.grid().sides().map(usize::from), values: dense(model, distances) };
    let mean = dense(model, &means(model));
    // Where the coarse far field misses the mean (thin parts), there is nothing to go on from.
    let deviation = |i: usize| {
        if mean[i].is_nan() {
            return f32::NAN;
        }
        let far = sample::far(model, field.voxel(i).map(|v| v as f32)).map(|(far, _)| far);
        far.filter(|far| (far - mean[i]).abs() < FAITHFUL).map_or(f32::NAN, |far| field.values[i] - far)
    };
    let mut deviations: Vec<f32> = (0..mean.len()).into_par_iter().map(deviation).collect();
    for _ in 0..LAYERS {
        let grown = grow(&field, model, &deviations);
        for (i, deviation, value) in grown {
            (deviations[i], field.values[i]) = (deviation, value);
        }
    }
    let off = |voxel: [usize; 3]| sample::far(model, voxel.map(|v| v as f32)).is_none();
    for _ in 0..BEYOND {
        for (i, value) in straight(&field, off) {
            field.values[i] = value;
        }
    }
    field
}

/// Fills unknown voxels next to the scan's points, given in voxels, with the scan's own distances, within the
/// model's support: where somebody is farther from the mean than the model stores, the measured surface goes on.
pub fn extend(field: &mut Dense, model: &Model<'_>, scan: &Surface, placed: &Placed, points: &[Point]) {
    let reach = 2u8;
    let limit = f64::from(reach) * 1.8 / f64::from(placed.pose.scale);
    let near = field.mark(points, usize::from(reach), |_, _| true);
    let supported = |i: usize| sample::far(model, field.voxel(i).map(|v| v as f32)).is_some();
    let wanted = |&i: &usize| near[i] && field.values[i].is_nan() && supported(i);
    let wanted: Vec<usize> = (0..near.len()).filter(wanted).collect();
    let known = |&i: &usize| Some((i, field.measured(i, scan, placed, limit)?));
    let values: Vec<(usize, f32)> = wanted.par_iter().filter_map(known).collect();
    for (i, value) in values {
        field.values[i] = value;
    }
}

/// Unknown voxels `off` the support that two known ones in a row lead to, and their distances.
fn straight(field: &Dense, off: impl Fn([usize; 3]) -> bool + Sync) -> Vec<(usize, f32)> {
    let next = |&i: &usize| {
        let voxel = field.voxel(i);
        let (mut sum, mut count) = (0.0, 0);
        for (axis, step) in raster::strides(field.sides).into_iter().enumerate() {
            let ahead = (voxel[axis] + 2 < field.sides[axis]).then(|| [i + step, i + 2 * step]);
            let behind = (voxel[axis] >= 2).then(|| [i - step, i - 2 * step]);
            for [near, far] in ahead.into_iter().chain(behind) {
                let value = 2.0 * field.values[near] - field.values[far];
                if !value.is_nan() {
                    (sum, count) = (sum + value, count + 1);
                }
            }
        }
        (count > 0 && off(voxel)).then(|| (i, sum / count as f32))
    };
    let unknown: Vec<usize> = (0..field.values.len()).filter(|&i| field.values[i].is_nan()).collect();
    unknown.par_iter().filter_map(next).collect()
}

/// Unknown voxels on the support next to known deviations: place, deviation and distance.
fn grow(field: &Dense, model: &Model<'_>, deviations: &[f32]) -> Vec<(usize, f32, f32)> {
    let next = |i: usize| {
        let deviation = field.mean_beside(i, deviations)?;
        let (mean, _) = sample::far(model, field.voxel(i).map(|v| v as f32))?;
        Some((i, deviation, mean + deviation))
    };
    let unknown = (0..field.values.len()).into_par_iter().filter(|&i| field.values[i].is_nan());
    unknown.filter_map(next).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plane_goes_on_straight_off_the_support_and_nowhere_else() {
        let plane = |x: usize, y: usize| 0.3 * x as f32 - 0.8 * y as f32 + 1.0;
        let values = (0..125).map(|i| if i % 5 < 3 { plane(i % 5, i / 5 % 5) } else { f32::NAN }).collect();
        let mut field = Dense { sides: [5; 3], values };
        let grown = straight(&field, |[_, y, _]| y > 1);
        assert_eq!(grown.len(), 15);
        for (i, value) in grown {
            assert!(
                i % 5 == 3 && i / 5 % 5 > 1 && (value - plane(3, i / 5 % 5)).abs() < 1e-5,
                "{i}: {value}"
            );
            field.values[i] = value;
        }
        assert_eq!(straight(&field, |_| true).len(), 15 + 10);
    }
}
