//! Fits the constants of the expected error ([`Calibration`]) to the true errors of shapes that were held back.
//!
//! A one-sigma error is the quantile `SHARE` of the true ones. The quantile that a function of the cues should be is
//! where the mean of the tilted loss ρ(r) = max(τ r, (τ - 1) r), r = log error - log stated, τ = `SHARE`, is least
//! (Koenker & Bassett 1978); logarithms, so that small errors count as much as large ones. The minimum is searched
//! constant by constant; then places where the errors are larger than elsewhere get factors ([`factors`]), and all are
//! scaled so that the scan in the middle has that share. What the measured
//! vertices are off comes from scans of one view: stitched ones have an error besides that they do not show. How well it
//! does is measured on the scans of shapes it was not fitted to.

use super::choice::{self, Choice, Made};
use super::held_out::{HeldOut, Trial, trials};
use super::{Error, Settings, factors, model_file};
use crate::mesh::Mesh;
use crate::picks::evenly;
use crate::quantile::{median, quantile};
use crate::uncertainty::Cue;
use crate::uncertainty::expected::{expected, misfit, of_faces};
use crate::uncertainty::factors::Factors;
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
    /// Numbers of the shapes that were held back.
    pub held: Vec<usize>,
    /// Those of them that could be completed.
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
    let held = held.numbers(shapes.len());
    let model = Model::from_bytes(&file).map_err(Error::Unusable)?;
    let Some((fit, shares)) = calibrate(&trials, &model) else {
        return Ok(Trained { file, held, trials, shares: vec![], choice });
    };
    let factors = factors::bytes(&fit.factors, &model);
    let file = model_file::calibrated(&file, &fit.constants, Some(&factors)).map_err(Error::Unusable)?;
    Ok(Trained { file, held, trials, shares, choice })
}

/// What is fitted to some trials.
#[derive(Clone, Debug, PartialEq)]
pub struct Fit {
    /// Of the equation.
    pub constants: Calibration,
    /// Of places, over the bricks of the model.
    pub factors: Factors,
}

/// The fit to these trials for `model`, and the shares of each of them by what was fitted to other shapes. `None` where
/// there are too few.
pub fn calibrate(trials: &[Trial], model: &Model<'_>) -> Option<(Fit, Vec<[Option<f32>; 2]>)> {
    if trials.len() < FEWEST {
        return None;
    }
    let all: Vec<Member<'_>> = trials.iter().map(|trial| Member::new(trial, model)).collect();
    let fit = fit_to(&all.iter().collect::<Vec<_>>(), model)?;
    let [even, odd] = [0, 1].map(|half| {
        let members: Vec<&Member<'_>> = all.iter().filter(|m| half_of(m.trial, trials) == half).collect();
        fit_to(&members, model)
    });
    let halves = [even?, odd?];
    let counted = |member: &Member<'_>| member.counted(&halves[1 - half_of(member.trial, trials)]);
    let counts: Vec<[Count; 2]> = all.iter().map(counted).collect();
    let total = counts.iter().fold([Count::default(); 2], |sum, c| [sum[0].and(c[0]), sum[1].and(c[1])]);
    let shares = counts.into_iter().map(|pair| pair.map(Count::share)).collect();
    let scans = trials.len().min(usize::from(u16::MAX)) as u16;
    let of_all = total.map(|count| count.share().unwrap_or(0.0));
    Some((Fit { constants: Calibration { scans, shares: of_all, ..fit.constants }, ..fit }, shares))
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

/// A trial, as it is fitted to.
pub struct Member<'a> {
    trial: &'a Trial,
    /// Where its vertices lie in the model, voxels.
    voxels: Vec<[f32; 3]>,
    misfit: f32,
}

impl<'a> Member<'a> {
    fn new(trial: &'a Trial, model: &Model<'_>) -> Self {
        let header = model.header();
        let voxel = |p: &[f32; 3]| [0, 1, 2].map(|axis| (p[axis] - header.origin[axis]) / header.spacing);
        Self { trial, voxels: trial.places.iter().map(voxel).collect(), misfit: misfit(&trial.cues) }
    }

    /// The inferred vertices whose true error is known: cue, error and place, voxels.
    pub fn inferred(&self) -> impl Iterator<Item = (&'a Cue, f32, [f32; 3])> {
        let known = self.trial.cues.iter().zip(&self.trial.errors).zip(&self.voxels);
        known.filter(|((cue, _), _)| !cue.measured).filter_map(|((cue, e), &q)| Some((cue, (*e)?, q)))
    }

    /// True errors of the measured vertices of one view, times the misfit.
    fn noise(&self) -> Vec<f64> {
        let known = self.trial.cues.iter().zip(&self.trial.errors);
        let shown = known.filter(|(cue, _)| cue.measured && cue.hidden == 0.0);
        let errors: Vec<f64> = shown.filter_map(|(_, error)| *error).map(f64::from).collect();
        let misfit = f64::from(self.misfit.max(NONE));
        spread(&errors).into_iter().map(|error| error / misfit).collect()
    }

    /// Measured and inferred vertices within the error that is stated.
    fn counted(&self, fit: &Fit) -> [Count; 2] {
        let mut counts = [Count::default(); 2];
        for ((cue, error), &q) in self.trial.cues.iter().zip(&self.trial.errors).zip(&self.voxels) {
            let Some(error) = *error else { continue };
            let cue = Cue { factor: fit.factors.at(q), ..*cue };
            let within = usize::from(error <= expected(&fit.constants, &cue, self.misfit));
            let count = &mut counts[usize::from(!cue.measured)];
            *count = count.and(Count { within, of: 1 });
        }
        counts
    }
}

/// At most [`VERTICES`] of some, evenly.
fn spread<T: Copy>(all: &[T]) -> Vec<T> {
    evenly(all.len(), VERTICES).map(|i| all[i]).collect()
}

/// What goes through the quantile of the errors of the typical scan.
fn fit_to(members: &[&Member<'_>], model: &Model<'_>) -> Option<Fit> {
    let start = of_faces(model.header().scales.millimetre);
    let noise = members.iter().filter_map(|member| sigma(member.noise().into_iter()));
    let noise = median(noise.collect())?;
    let of_one =
        |member: &&Member<'_>| spread(&member.inferred().map(|(c, e, _)| (*c, e)).collect::<Vec<_>>());
    let inferred: Vec<(Cue, f32)> = members.iter().flat_map(of_one).collect();
    let constants = least(&inferred, &Calibration { noise: noise as f32, ..start });
    let factors = factors::factors(members, &constants, Factors::unknown(model));
    // The least loss gives the shape of the function. Its level is that of the scan in the middle: a few scans that
    // went wrong as a whole would raise it for all others.
    let level = |member: &&Member<'_>| {
        let stated = |(cue, error, q): (&Cue, f32, _)| (Cue { factor: factors.at(q), ..*cue }, error);
        sigma(member.inferred().map(stated).map(|(cue, error)| ratio(&constants, &cue, error)))
    };
    let factor = libm::exp(median(members.iter().filter_map(level).collect())?) as f32;
    let constants = bounded(&Calibration {
        seam: constants.seam * factor,
        posterior: constants.posterior * factor,
        residual: constants.residual * factor,
        ..constants
    });
    Some(Fit { constants, factors })
}

/// log error - log stated.
pub(super) fn ratio(constants: &Calibration, cue: &Cue, error: f32) -> f64 {
    libm::log(f64::from(error.max(NONE)) / f64::from(expected(constants, cue, 0.0)))
}

/// The quantile [`SHARE`]; `None` of nothing.
pub(super) fn sigma(values: impl Iterator<Item = f64>) -> Option<f64> {
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
    bounded(&Calibration {
        seam: start.seam * seam,
        posterior: start.posterior * posterior,
        posterior_way: start.posterior_way * posterior_way,
        residual: start.residual * residual,
        residual_way: start.residual_way * residual_way,
        ..*start
    })
}

/// Constants within what the core reads.
fn bounded(constants: &Calibration) -> Calibration {
    let value = |x: f32| x.clamp(0.0, Calibration::MOST);
    let way = |x: f32| x.clamp(Calibration::SHORTEST, Calibration::MOST);
    let c = constants;
    Calibration {
        noise: value(c.noise),
        seam: value(c.seam),
        posterior: value(c.posterior),
        posterior_way: way(c.posterior_way),
        residual: value(c.residual),
        residual_way: way(c.residual_way),
        ..*c
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synth::{Kind, Random};

    /// Eight bricks, of 8 voxels each way.
    fn model() -> Model<'static> {
        Model::from_bytes(lacuna_fixtures::VERSIONS[2].model).expect("a model")
    }

    /// How much farther off the surface is at a height of the model, voxels.
    fn factor(height: f32) -> f32 {
        if height < 8.0 { 1.0 } else { 2.0 }
    }

    /// Trials whose errors are normal with the deviation that `truth` states.
    fn trials(truth: &Calibration, count: usize) -> Vec<Trial> {
        let model = model();
        let header = model.header();
        let trial = |shape: usize| {
            let mut random = Random::new(5, shape as u64);
            let cue = |random: &mut Random| Cue {
                measured: random.unit() < 0.3,
                posterior: random.range(0.1, 1.0) as f32,
                away: random.range(0.0, 30.0) as f32,
                height: (0.1 * random.normal()) as f32,
                hidden: if shape % 4 < 2 { 0.05 } else { 0.0 },
                factor: 1.0,
            };
            let cues: Vec<Cue> = (0..2000).map(|_| cue(&mut random)).collect();
            let voxels: Vec<[f32; 3]> =
                cues.iter().map(|_| [0; 3].map(|_| random.range(0.0, 15.0) as f32)).collect();
            let misfit = misfit(&cues);
            let mut error = |(cue, q): (&Cue, &[f32; 3])| {
                let cue = Cue { factor: factor(q[1]), ..*cue };
                Some(expected(truth, &cue, misfit) * random.normal().abs() as f32)
            };
            let errors = cues.iter().zip(&voxels).map(&mut error).collect();
            let place = |q: &[f32; 3]| [0, 1, 2].map(|axis| header.origin[axis] + header.spacing * q[axis]);
            let places = voxels.iter().map(place).collect();
            Trial { shape, kind: Kind::Front, errors, cues, places, covered: vec![] }
        };
        (0..count).map(trial).collect()
    }

    #[test]
    fn constants_and_factors_are_found_again_and_state_the_right_share() {
        let model = model();
        let start = of_faces(model.header().scales.millimetre);
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
        let (Fit { constants: found, factors }, shares) = calibrate(&made, &model).expect("enough trials");
        assert!((found.noise / truth.noise - 1.0).abs() < 0.05, "{found:?}");
        let high = factors.at([8.0, 13.0, 8.0]) / factors.at([8.0, 2.0, 8.0]);
        assert!((1.5..2.1).contains(&high), "{high}");
        let member = Member::new(&made[0], &model);
        for (cue, _, q) in member.inferred().filter(|(_, _, q)| (q[1] - 8.0).abs() > 3.0) {
            let stated = expected(&found, &Cue { factor: factors.at(q), ..*cue }, 0.0);
            let ratio = stated / expected(&truth, &Cue { factor: factor(q[1]), ..*cue }, 0.0);
            assert!((0.7..1.4).contains(&ratio), "{ratio} at {cue:?}: {found:?}");
        }
        assert!(found.shares.iter().all(|share| (share - 0.683).abs() < 0.02), "{found:?}");
        assert!(shares.iter().flatten().all(|share| (share.unwrap() - 0.683).abs() < 0.1), "{shares:?}");
        assert_eq!(found.scans, 12);
    }

    #[test]
    fn shares_are_of_other_shapes_whatever_their_numbers() {
        let (model, truth) = (model(), of_faces(0.3));
        let found = calibrate(&trials(&truth, 12), &model).expect("enough trials");
        let even: Vec<Trial> =
            trials(&truth, 12).into_iter().map(|t| Trial { shape: 2 * t.shape, ..t }).collect();
        assert_eq!(found, calibrate(&even, &model).expect("enough trials"));
    }

    #[test]
    fn a_few_scans_calibrate_nothing() {
        assert!(calibrate(&trials(&of_faces(0.3), 5), &model()).is_none());
    }
}
