//! From what is known at a vertex to its expected error; the equation is that of [`Calibration`].

use super::cue::Cue;
use crate::quantile::{median, quantile};
use lacuna::Model;
use lacuna::format::Calibration;
use serde::Serialize;

/// What 30 faces give, in class millimetres: for models that no trainer has calibrated.
const FACES: Calibration = Calibration {
    scans: 0,
    shares: [0.0; 2],
    noise: 0.95,
    seam: 0.07,
    posterior: 4.8,
    posterior_way: 14.0,
    residual: 4.5,
    residual_way: 113.0,
};

/// The expected errors of a completed mesh, one sigma: 68 % of the true ones are smaller.
#[derive(Clone, Debug, Default)]
pub struct Expected {
    /// One a vertex, in the scan's unit.
    pub errors: Vec<f32>,
    /// That of a measured vertex.
    pub noise: f32,
    /// What the scan is off without showing it, a part of all of them: half of the measured vertices have less.
    pub hidden: f32,
    /// Whether the model's trainer has compared such errors with true ones.
    pub calibrated: bool,
}

/// Median and 95th percentile of some expected errors.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Share {
    /// Half of the vertices have less.
    pub median: f64,
    /// 95 % have less.
    pub p95: f64,
}

impl Expected {
    /// The errors of a mesh with these cues; `scale` is voxels a scan unit. `noise` (scan units) is left in the scan: no measured
    /// vertex is expected to be nearer, for of a scan with much noise only what lies near the shape is taken to be measured.
    pub fn new(cues: &[Cue], model: &Model<'_>, scale: f32, noise: f32) -> Self {
        let calibration = model.calibration();
        let constants = calibration.copied().unwrap_or_else(|| of_faces(model.header().scales.millimetre));
        let misfit = misfit(cues);
        let least = |cue: &Cue| if cue.measured { noise } else { 0.0 };
        let errors =
            cues.iter().map(|cue| (expected(&constants, cue, misfit) / scale).max(least(cue))).collect();
        let hidden = median(cues.iter().filter(|cue| cue.measured).map(|cue| cue.hidden.into()).collect());
        let hidden = hidden.unwrap_or(0.0) as f32;
        let noise = (measured(&constants, misfit, hidden) / scale).max(noise);
        Self { errors, noise, hidden: hidden / scale, calibrated: calibration.is_some() }
    }
}

/// The constants of 30 faces; `millimetre` is one class millimetre in voxels.
pub fn of_faces(millimetre: f32) -> Calibration {
    Calibration {
        seam: FACES.seam * millimetre,
        posterior_way: FACES.posterior_way * millimetre,
        residual: FACES.residual * millimetre,
        residual_way: FACES.residual_way * millimetre,
        ..FACES
    }
}

/// Root mean square distance of the measured vertices from the fitted surface, voxels.
pub fn misfit(cues: &[Cue]) -> f32 {
    let (sum, count) = cues.iter().filter(|cue| cue.measured).fold((0.0f64, 0.0f64), |(sum, count), cue| {
        (sum + f64::from(cue.height) * f64::from(cue.height), count + 1.0)
    });
    (sum / count.max(1.0)).sqrt() as f32
}

/// The expected error of a measured vertex, voxels.
fn measured(constants: &Calibration, misfit: f32, hidden: f32) -> f32 {
    libm::hypotf(constants.noise * misfit, hidden)
}

/// The expected error of a vertex, voxels.
pub fn expected(constants: &Calibration, cue: &Cue, misfit: f32) -> f32 {
    if cue.measured {
        return measured(constants, misfit, cue.hidden);
    }
    let reached = |way: f32| 1.0 - libm::expf(-cue.away / way);
    let within = reached(constants.posterior_way) * constants.posterior * cue.posterior;
    let beyond = reached(constants.residual_way) * constants.residual;
    let near = constants.seam * constants.seam;
    libm::hypotf(cue.factor * (near + within * within + beyond * beyond).sqrt(), cue.hidden)
}

/// Median and 95th percentile of the errors of measured and of inferred vertices; `None` where there are none.
pub fn shares(errors: &[f32], measured: &dyn Fn(usize) -> bool) -> [Option<Share>; 2] {
    [true, false].map(|wanted| {
        let mut chosen: Vec<f64> = errors
            .iter()
            .enumerate()
            .filter(|&(v, _)| measured(v) == wanted)
            .map(|(_, &error)| f64::from(error))
            .collect();
        chosen.sort_by(f64::total_cmp);
        Some(Share { median: quantile(&chosen, 0.5)?, p95: quantile(&chosen, 0.95)? })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cue(measured: bool, away: f32) -> Cue {
        Cue { measured, posterior: 0.5, away, height: 0.2, hidden: 0.0, factor: 1.0 }
    }

    #[test]
    fn errors_grow_with_the_way_to_the_scan_and_with_what_it_leaves_open() {
        let of = |cue: &Cue| expected(&FACES, cue, 0.2);
        let errors = [0.0, 1.0, 5.0, 5000.0].map(|away| of(&cue(false, away)));
        assert!(errors.is_sorted() && errors[0] == FACES.seam, "{errors:?}");
        let far = (0.07f32 * 0.07 + 2.4 * 2.4 + 4.5 * 4.5).sqrt();
        assert!((errors[3] - far).abs() < 1e-4, "{errors:?}");
        assert!(of(&Cue { posterior: 2.0, ..cue(false, 5.0) }) > errors[2]);
        assert_eq!(of(&Cue { factor: 2.0, ..cue(false, 5.0) }), 2.0 * errors[2]);
        assert_eq!(of(&Cue { factor: 2.0, ..cue(true, 0.0) }), of(&cue(true, 0.0)));
    }

    #[test]
    fn measured_vertices_are_as_good_as_the_scan() {
        let cues = [cue(true, 0.0), cue(false, 9.0), cue(true, 0.0)];
        assert!((misfit(&cues) - 0.2).abs() < 1e-6);
        let model = Model::from_bytes(lacuna_fixtures::VERSIONS[0].model).expect("a model of version 1");
        let found = Expected::new(&cues, &model, 0.5, 0.0);
        assert!((found.errors[0] - 0.95 * 0.2 / 0.5).abs() < 1e-6 && !found.calibrated);
        assert_eq!(found.errors[0], found.noise);
        let stitched = Expected::new(&cues.map(|cue| Cue { hidden: 0.3, ..cue }), &model, 0.5, 0.0);
        let grown = |i: usize| stitched.errors[i] * stitched.errors[i] - found.errors[i] * found.errors[i];
        assert!((0..3).all(|i| (grown(i) - 0.36).abs() < 1e-4) && stitched.noise == stitched.errors[0]);
        let noisy = Expected::new(&cues, &model, 0.5, 2.0);
        assert_eq!((noisy.errors[0], noisy.errors[1], noisy.noise), (2.0, found.errors[1], 2.0));
        let [measured, inferred] = shares(&found.errors, &|v| cues[v].measured);
        assert!(measured.unwrap().p95 < inferred.unwrap().median);
        assert_eq!(shares(&[], &|_| true), [None, None]);
    }
}
