//! From the core's formats to the reference's: dense volumes of voxels in `f64`.

use crate::fit::{dense, means};
use crate::reference::{Grid, Hull, Model as Reference, pca::pca};
use lacuna::Model;
use lacuna::hull::Target;

/// The reference's grid for a model.
pub fn grid(model: &Model<'_>) -> Grid {
    Grid { sides: model.grid().sides().map(usize::from) }
}

/// Distances of stored voxels as a dense volume, voxels, NaN where nothing is stored.
pub fn distances(model: &Model<'_>, distances: &[i16]) -> Vec<f64> {
    dense(model, distances).into_iter().map(f64::from).collect()
}

/// NaN off the mask.
pub fn masked(mut volume: Vec<f64>, mask: &[bool]) -> Vec<f64> {
    volume.iter_mut().zip(mask).for_each(|(value, &stored)| *value = if stored { *value } else { f64::NAN });
    volume
}

/// A hull without the voxels that are not stored.
pub fn stored(hull: Hull, mask: &[bool]) -> Hull {
    hull.into_iter().zip(mask).map(|(target, &stored)| target.filter(|_| stored)).collect()
}

/// The measured distances among packed targets.
pub fn hull(model: &Model<'_>, targets: &[i16]) -> Hull {
    let targets: Vec<Target> = targets.iter().map(|&t| Target(t)).collect();
    let weights: Vec<i16> = targets.iter().map(|t| t.weight() as i16).collect();
    let values: Vec<i16> = targets.iter().map(|t| t.distance()).collect();
    let known = dense(model, &weights).into_iter().map(|w| w > 0.0);
    dense(model, &values).into_iter().zip(known).map(|(t, known)| known.then_some(f64::from(t))).collect()
}

/// The numbers of a model file as a reference model.
pub fn model(model: &Model<'_>) -> Reference {
    let grid = grid(model);
    let mut modes = vec![vec![0.0; grid.len()]; model.modes()];
    let places = places(model);
    for brick in model.bricks() {
        for voxel in 0..brick.voxels() {
            let place = places[brick.first + voxel];
            for ((mode, &b), &e) in modes.iter_mut().zip(brick.basis(voxel)).zip(brick.exponents()) {
                mode[place] = f64::from(b as i8) / f64::from(1u32 << e);
            }
        }
    }
    let mean = distances(model, &means(model));
    let mask: Vec<bool> = mean.iter().map(|m| !m.is_nan()).collect();
    let mean = mean.into_iter().map(|m| if m.is_nan() { 0.0 } else { m }).collect();
    // The file keeps the root mean square of b' over the band, s / sqrt(N).
    let root = (model.voxels() as f64).sqrt();
    let deviations: Vec<f64> = (0..model.modes()).map(|k| f64::from(model.deviation(k)) * root).collect();
    for (mode, s) in modes.iter_mut().zip(&deviations) {
        mode.iter_mut().for_each(|b| *b /= s);
    }
    Reference { grid, mask, mean, axes: modes, deviations }
}

/// Places in the dense volume of the stored voxels.
pub fn places(model: &Model<'_>) -> Vec<usize> {
    let grid = grid(model);
    let mut places = vec![0; model.voxels()];
    for brick in model.bricks() {
        for (voxel, place) in brick.places() {
            places[brick.first + voxel] = grid.index(place.map(usize::from));
        }
    }
    places
}

/// The reference's own model of training volumes on the band of a file's model; modes have the file's signs,
/// which are arbitrary.
pub fn trained(volumes: &[Vec<f64>], file: &Reference) -> Reference {
    let mut trained = pca(file.grid, volumes, file.mask.clone(), file.modes());
    for (axis, other) in trained.axes.iter_mut().zip(&file.axes) {
        if axis.iter().zip(other).map(|(a, b)| a * b).sum::<f64>() < 0.0 {
            axis.iter_mut().for_each(|b| *b = -*b);
        }
    }
    trained
}
