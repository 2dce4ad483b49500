//! Fits the constants of the expected error ([`Calibration`]) to the true errors of shapes that were held back.
//!
//! A one-sigma error is the quantile `SHARE` of the true ones. The quantile that a function of the cues should be is
//! where the mean of the tilted loss ρ(r) = max(τ r, (τ - 1) r), r = log error - log stated, τ = `SHARE`, is least
//! (Koenker & Bassett 1978); logarithms, so that small errors count as much as large ones. The minimum is searched
//! constant by constant; then all errors are scaled so that the scan in the middle has that share. What the measured
//! vertices are off comes from scans of one view: stitched ones have an error besides that they do not show. How well it
//! does is measured on the scans of shapes it was not fitted to.

use super::choice::{self, Choice, Made};
use super::held_out::{HeldOut, Trial, trials};
use super::{Error, Settings, model_file};
use crate::mesh::Mesh;
use crate::quantile::{median, quantile};
use crate::uncertainty::Cue;
use crate::uncertainty::expected::{expected, misfit, of_faces};
use lacuna::Model;
use lacuna::format::Calibration;
use std::collections::BTreeSet;

/// Share of the errors within one standard deviation.
const SHARE: f64 = 0.6827;
/// Vertices of a scan that are fitted to, at most.
const VERTICES: usize = 400;
/// Fewest scans that say something about others.
const FEWEST: usize = 6;
/// The search ends with steps of this factor.
const FINEST: f64 = 1.02;
/// Farthest from where the search starts, as a factor.
const FARTHEST: f64 = 300.0;
/// Errors below this are as good as none, voxels.
const NONE: f32 = 1e-3;

/// A model and what its calibration was made from.
pub struct Trained {
    /// The model file.
    pub file: Vec<u8>,
    /// The held-back shapes.
    pub trials: Vec<Trial>,
    /// Shares of each trial's measured and inferred vertices whose error is below the one that the other shapes make
    /// one expect; empty without a calibration.
    pub shares: Vec<[Option<f32>; 2]>,
    /// Spacing and modes, where the settings limit what the model takes of a device.
    pub choice: Option<Choice>,
}

/// Trains a model on aligned shapes and calibrates its expected errors on some of them, held back. `progress` is told
/// of shapes measured, then of scans completed.
///
/// # Errors
/// Shapes that cannot make a model; see [`Error`]. Without enough scans the model stays uncalibrated.
pub fn train_calibrated(
    shapes: &[Mesh],
    settings: &Settings,
    held: HeldOut,
    progress: [&(dyn Fn(u64, u64) + Sync); 2],
) -> Result<Trained, Error> {
    let Made { prepared, file, choice } = choice::make(shapes, settings, progress[0])?;
    let trials = trials(&prepared, shapes, held, progress[1]);
    let Ok(model) = Model::from_bytes(&file) else {
        return Ok(Trained { file, trials, shares: vec![], choice });
    };
    let Some((calibration, shares)) = calibrate(&trials, model.header().scales.millimetre) else {
        return Ok(Trained { file, trials, shares: vec![], choice });
    };
    let file = model_file::calibrated(&file, &calibration).unwrap_or(file);
    Ok(Trained { file, trials, shares, choice })
}

/// The constants for these trials, and the shares of each of them by constants fitted to other shapes; `millimetre` is
/// one class millimetre in voxels. `None` where there are too few.
pub fn calibrate(trials: &[Trial], millimetre: f32) -> Option<(Calibration, Vec<[Option<f32>; 2]>)> {
    if trials.len() < FEWEST {
        return None;
    }
    let all: Vec<Samples> = trials.iter().map(|trial| Samples::new(trial, VERTICES)).collect();
    let start = of_faces(millimetre);
    let constants = fitted(&all.iter().collect::<Vec<_>>(), &start)?;
    let [even, odd] = [0, 1].map(|half| {
        let members = trials.iter().zip(&all).filter(|(trial, _)| half_of(trial, trials) == half);
        fitted(&members.map(|(_, samples)| samples).collect::<Vec<_>>(), &start)
    });
    let halves = [even?, odd?];
    let other = |trial: &Trial| &halves[1 - half_of(trial, trials)];
    let counts: Vec<[Count; 2]> = trials.iter().map(|trial| counted(trial, other(trial))).collect();
    let total = counts.iter().fold([Count::default(); 2], |sum, c| [sum[0].and(c[0]), sum[1].and(c[1])]);
    let shares = counts.into_iter().map(|pair| pair.map(Count::share)).collect();
    let scans = trials.len().min(usize::from(u16::MAX)) as u16;
    let of_all = total.map(|count| count.share().unwrap_or(0.0));
    Some((Calibration { scans, shares: of_all, ..constants }, shares))
}

/// In which half of the held-back shapes a trial's shape is, 0 or 1: every other one, whatever their numbers are.
fn half_of(trial: &Trial, trials: &[Trial]) -> usize {
    let before: BTreeSet<usize> =
        trials.iter().map(|t| t.shape).filter(|&shape| shape < trial.shape).collect();
    before.len() % 2
}

/// Vertices within their expected error, of how many.
#[derive(Clone, Copy, Default)]
struct Count {
    within: usize,
    of: usize,
}

impl Count {
    fn and(self, other: Self) -> Self {
        Self { within: self.within + other.within, of: self.of + other.of }
    }

    fn share(self) -> Option<f32> {
        (self.of > 0).then(|| (self.within as f64 / self.of as f64) as f32)
    }
}

/// Measured and inferred vertices of a trial within the error that `constants` state.
fn counted(trial: &Trial, constants: &Calibration) -> [Count; 2] {
    let misfit = misfit(&trial.cues);
    let mut counts = [Count::default(); 2];
    for (cue, error) in trial.cues.iter().zip(&trial.errors) {
        let Some(error) = *error else { continue };
        let within = usize::from(error <= expected(constants, cue, misfit));
        let count = &mut counts[usize::from(!cue.measured)];
        *count = count.and(Count { within, of: 1 });
    }
    counts
}

/// What is fitted to of a trial.
struct Samples {
    /// True errors of the measured vertices of one view, times the misfit.
    noise: Vec<f32>,
    /// Inferred vertices with their true errors, voxels.
    inferred: Vec<(Cue, f32)>,
}

impl Samples {
    fn new(trial: &Trial, most: usize) -> Self {
        let misfit = misfit(&trial.cues).max(NONE);
        let known = |wanted: fn(&Cue) -> bool| {
            let pairs = trial.cues.iter().zip(&trial.errors);
            let all: Vec<(Cue, f32)> =
                pairs.filter(|(cue, _)| wanted(cue)).filter_map(|(cue, e)| Some((*cue, (*e)?))).collect();
            let count = all.len().min(most);
            (0..count).map(|i| all[i * all.len() / count]).collect::<Vec<_>>()
        };
        Self {
            noise: known(|cue| cue.measured && cue.hidden == 0.0)
                .into_iter()
                .map(|(_, error)| error / misfit)
                .collect(),
            inferred: known(|cue| !cue.measured),
        }
    }
}

/// The constants that go through the quantile of the errors of the typical scan.
fn fitted(samples: &[&Samples], start: &Calibration) -> Option<Calibration> {
    let noise = samples.iter().filter_map(|s| sigma(s.noise.iter().map(|&e| f64::from(e))));
    let noise = median(noise.collect())?;
    let inferred: Vec<(Cue, f32)> = samples.iter().flat_map(|s| s.inferred.iter().copied()).collect();
    let constants = least(&inferred, &Calibration { noise: noise as f32, ..*start });
    // The least loss gives the shape of the function. Its level is that of the scan in the middle: a few scans that
    // went wrong as a whole would raise it for all others.
    let level = |s: &&Samples| sigma(s.inferred.iter().map(|(cue, error)| ratio(&constants, cue, *error)));
    let factor = libm::exp(median(samples.iter().filter_map(level).collect())?) as f32;
    Some(Calibration {
        seam: constants.seam * factor,
        posterior: constants.posterior * factor,
        residual: constants.residual * factor,
        ..constants
    })
}

/// log error - log stated.
fn ratio(constants: &Calibration, cue: &Cue, error: f32) -> f64 {
    libm::log(f64::from(error.max(NONE)) / f64::from(expected(constants, cue, 0.0)))
}

/// The quantile [`SHARE`]; `None` of nothing.
fn sigma(values: impl Iterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    quantile(&values, SHARE)
}

/// The constants of the least loss.
fn least(samples: &[(Cue, f32)], start: &Calibration) -> Calibration {
    let loss = |logs: &[f64; 5]| {
        let constants = with(start, logs);
        let tilted = |(cue, error): &(Cue, f32)| {
            let r = ratio(&constants, cue, *error);
            (SHARE * r).max((SHARE - 1.0) * r)
        };
        samples.iter().map(tilted).sum::<f64>()
    };
    let (mut best, mut step) = ([0.0; 5], libm::log(2.0));
    let mut lowest = loss(&best);
    while step > libm::log(FINEST) {
        let mut moved = false;
        for (axis, change) in (0..5).flat_map(|axis| [(axis, step), (axis, -step)]) {
            let mut next = best;
            next[axis] += change;
            if next[axis].abs() > libm::log(FARTHEST) {
                continue;
            }
            let found = loss(&next);
            if found < lowest {
                (best, lowest, moved) = (next, found, true);
            }
        }
        step = if moved { step } else { step / 2.0 };
    }
    with(start, &best)
}

/// The constants of `start`, each times the exponential of a number.
fn with(start: &Calibration, logs: &[f64; 5]) -> Calibration {
    let [seam, posterior, posterior_way, residual, residual_way] = logs.map(|log| libm::exp(log) as f32);
    Calibration {
        seam: start.seam * seam,
        posterior: start.posterior * posterior,
        posterior_way: start.posterior_way * posterior_way,
        residual: start.residual * residual,
        residual_way: start.residual_way * residual_way,
        ..*start
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synth::{Kind, Random};

    /// Trials whose errors are normal with the deviation that `truth` states.
    fn trials(truth: &Calibration, count: usize) -> Vec<Trial> {
        let trial = |shape: usize| {
            let mut random = Random::new(5, shape as u64);
            let cue = |random: &mut Random| Cue {
                measured: random.unit() < 0.3,
                posterior: random.range(0.1, 1.0) as f32,
                away: random.range(0.0, 30.0) as f32,
                height: (0.1 * random.normal()) as f32,
                hidden: if shape % 4 < 2 { 0.05 } else { 0.0 },
            };
            let cues: Vec<Cue> = (0..2000).map(|_| cue(&mut random)).collect();
            let misfit = misfit(&cues);
            let error = |cue: &Cue, normal: f64| Some(expected(truth, cue, misfit) * normal.abs() as f32);
            let errors = cues.iter().map(|cue| error(cue, random.normal())).collect();
            Trial { shape, kind: Kind::Front, errors, cues, covered: vec![] }
        };
        (0..count).map(trial).collect()
    }

    #[test]
    fn constants_are_found_again_and_state_the_right_share() {
        let start = of_faces(0.3);
        let truth = Calibration {
            noise: 1.4,
            seam: 0.1,
            posterior: 1.0,
            posterior_way: 3.0,
            residual: 0.5,
            residual_way: 12.0,
            ..start
        };
        let made = trials(&truth, 12);
        let (found, shares) = calibrate(&made, 0.3).expect("enough trials");
        assert!((found.noise / truth.noise - 1.0).abs() < 0.05, "{found:?}");
        for cue in made[0].cues.iter().filter(|cue| !cue.measured) {
            let ratio = expected(&found, cue, 0.0) / expected(&truth, cue, 0.0);
            assert!((0.75..1.33).contains(&ratio), "{ratio} at {cue:?}: {found:?}");
        }
        assert!(found.shares.iter().all(|share| (share - 0.683).abs() < 0.02), "{found:?}");
        assert!(shares.iter().flatten().all(|share| (share.unwrap() - 0.683).abs() < 0.1), "{shares:?}");
        assert_eq!(found.scans, 12);
    }

    #[test]
    fn shares_are_of_other_shapes_whatever_their_numbers() {
        let made = trials(&of_faces(0.3), 12);
        let (found, shares) = calibrate(&made, 0.3).expect("enough trials");
        let even: Vec<Trial> =
            trials(&of_faces(0.3), 12).into_iter().map(|t| Trial { shape: 2 * t.shape, ..t }).collect();
        assert_eq!((found, shares), calibrate(&even, 0.3).expect("enough trials"));
    }

    #[test]
    fn a_few_scans_calibrate_nothing() {
        assert!(calibrate(&trials(&of_faces(0.3), 5), 0.3).is_none());
    }
}
