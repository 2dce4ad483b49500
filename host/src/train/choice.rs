//! Spacing and modes of the best model that a device has room for.
//!
//! Measured on 30 faces from 3.3 mm and 29 modes, mean rms of the missing (seen) part of 16 scans of other faces, 2.47
//! (0.36) mm with the whole model: in half of the file by modes alone 2.78 (0.42), by the spacing alone 2.53 (0.39),
//! by both 2.60 (0.39); in a third by the spacing alone 2.57 (0.50), by both 2.56 (0.41). Modes alone cost the missing
//! part most, the spacing alone the seen one, and both together neither much. So the voxels become coarser, step by
//! step, and at each spacing as many modes are kept as there is room for, until the share of the modes kept is no
//! longer less than that of the voxels, which goes with the cube of the spacing.

use super::footprint::{Footprint, Limits};
use super::prepared::Prepared;
use super::{Error, Settings, grid};
use crate::mesh::Mesh;
use lacuna::Model;

/// Farthest the voxels are coarsened, as a factor.
const COARSEST: f64 = 3.0;
/// Factor of a step in the spacing, at least: 29 steps are the most there can be, and three or four are usual.
const LEAST_STEP: f64 = 1.04;
/// The same at most, once some modes fit: where they are few, one more or less says little about how far there is to
/// go.
const FARTHEST_STEP: f64 = 1.12;

/// Voxel edge and number of modes of a model.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Size {
    /// Voxel edge in the unit of the shapes.
    pub spacing: f32,
    /// Modes.
    pub modes: usize,
}

/// What was chosen for a device.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Choice {
    /// Without limits.
    pub usual: Size,
    /// Within them.
    pub chosen: Size,
}

/// A model of all shapes, not calibrated yet.
pub(super) struct Made {
    pub prepared: Prepared,
    pub file: Vec<u8>,
    /// `None` where nothing is limited.
    pub choice: Option<Choice>,
}

/// The best model of all shapes within the limits of the settings.
///
/// # Errors
/// [`Error::TooLarge`], and shapes that cannot make a model.
pub(super) fn make(
    shapes: &[Mesh],
    settings: &Settings,
    progress: &(dyn Fn(u64, u64) + Sync),
) -> Result<Made, Error> {
    let prepared = Prepared::new(shapes, settings, 0.0, progress)?;
    if settings.limits == Limits::default() {
        let file = prepared.model_of_all()?;
        return Ok(Made { prepared, file, choice: None });
    }
    let mut search = Search::new(prepared, settings, grid::coarsest(shapes))?;
    while let Some(spacing) = search.next_spacing() {
        search = search.coarsened(shapes, spacing, progress)?;
    }
    search.made()
}

/// A model that may be too large.
struct Candidate {
    file: Vec<u8>,
    size: Size,
    footprint: Footprint,
    excess: f64,
}

impl Candidate {
    fn new(prepared: &Prepared, limits: &Limits) -> Result<Self, Error> {
        let file = prepared.model_of_all()?;
        let footprint = Footprint::when_calibrated(&file).map_err(Error::Unusable)?;
        let model = Model::from_bytes(&file).map_err(Error::Unusable)?;
        let size = Size { spacing: model.header().spacing, modes: model.modes() };
        Ok(Self { file, size, footprint, excess: limits.excess(&footprint) })
    }

    fn fits(&self) -> bool {
        self.excess <= 1.0
    }
}

/// The best model at one spacing.
struct Search {
    settings: Settings,
    /// Options that were asked for.
    fixed: Vec<&'static str>,
    usual: Size,
    /// Largest voxel edge that is tried.
    coarsest: f64,
    prepared: Prepared,
    /// The most modes that fit, or one if none does.
    best: Candidate,
}

impl Search {
    /// From the usual spacing; `limit` is the largest a model can have.
    fn new(mut prepared: Prepared, settings: &Settings, limit: f64) -> Result<Self, Error> {
        let whole = Candidate::new(&prepared, &settings.limits)?;
        let asked = [
            ("--spacing", settings.spacing.is_some()),
            ("--modes", settings.modes.is_some()),
            ("--stride", settings.stride.is_some()),
        ];
        let fixed = asked.iter().filter(|(_, asked)| *asked).map(|(option, _)| *option).collect();
        // A stride that follows the spacing would jump to fewer voxels, and the fit would take more memory than before.
        let settings = Settings { stride: Some(prepared.stride()), ..settings.clone() };
        let usual = whole.size;
        let coarsest = limit.min(COARSEST * f64::from(usual.spacing));
        let best = most_modes(&mut prepared, whole, &settings)?;
        Ok(Self { settings, fixed, usual, coarsest, prepared, best })
    }

    /// The same at another spacing.
    fn coarsened(
        self,
        shapes: &[Mesh],
        spacing: f64,
        progress: &(dyn Fn(u64, u64) + Sync),
    ) -> Result<Self, Error> {
        let Self { settings, fixed, usual, coarsest, prepared, best: _ } = self;
        // Two sets of volumes at a time would be twice the memory.
        drop(prepared);
        let coarser = Settings { spacing: Some(spacing), ..settings.clone() };
        let mut prepared = Prepared::new(shapes, &coarser, 0.0, progress)?;
        let whole = Candidate::new(&prepared, &settings.limits)?;
        let best = most_modes(&mut prepared, whole, &settings)?;
        Ok(Self { settings, fixed, usual, coarsest, prepared, best })
    }

    fn next_spacing(&self) -> Option<f64> {
        next_spacing(&self.settings, self.usual, self.coarsest, self.best.size, self.best.excess)
    }

    fn made(self) -> Result<Made, Error> {
        let Self { settings, fixed, usual, prepared, best, .. } = self;
        if !best.fits() {
            let Candidate { footprint: smallest, size, .. } = best;
            return Err(Error::TooLarge { smallest, size, limits: settings.limits, fixed });
        }
        let choice = Some(Choice { usual, chosen: best.size });
        Ok(Made { prepared, file: best.file, choice })
    }
}

/// The spacing to try after the model `now` with its excess, from the `usual` one to the `coarsest`; none where this one is as
/// good as any, or the last.
fn next_spacing(settings: &Settings, usual: Size, coarsest: f64, now: Size, excess: f64) -> Option<f64> {
    let [first, spacing] = [usual, now].map(|size| f64::from(size.spacing));
    if settings.spacing.is_some() || spacing >= coarsest * (1.0 - 1e-6) {
        return None;
    }
    let voxels = libm::pow(first / spacing, 3.0);
    let modes = now.modes as f64 / usual.modes as f64;
    let factor = match (excess <= 1.0, settings.modes) {
        (true, Some(_)) => return None,
        (true, None) if modes >= voxels => return None,
        (true, None) => libm::pow(voxels / modes, 1.0 / 6.0).min(FARTHEST_STEP),
        // Neither file nor memory shrinks faster than the number of voxels: the cubic root does not go too far.
        (false, _) => libm::cbrt(excess),
    };
    Some(rounded(spacing * factor.max(LEAST_STEP)).min(coarsest))
}

/// The most modes that fit at one spacing, or one if none does; `whole` has all of them.
fn most_modes(prepared: &mut Prepared, whole: Candidate, settings: &Settings) -> Result<Candidate, Error> {
    if whole.fits() || settings.modes.is_some() || whole.size.modes == 1 {
        return Ok(whole);
    }
    let mut with = |modes: usize| {
        prepared.keep_modes(modes);
        Candidate::new(prepared, &settings.limits)
    };
    let (mut best, mut too_many) = (with(1)?, whole.size.modes);
    while best.fits() && too_many - best.size.modes > 1 {
        let tried = with(best.size.modes.midpoint(too_many))?;
        if tried.fits() {
            best = tried;
        } else {
            too_many = tried.size.modes;
        }
    }
    prepared.keep_modes(best.size.modes);
    Ok(best)
}

/// A length in three digits, as it can be asked for by hand.
fn rounded(length: f64) -> f64 {
    format!("{length:.2e}").parse().unwrap_or(length)
}

#[cfg(test)]
mod tests {
    use super::*;

    const USUAL: Size = Size { spacing: 3.3, modes: 29 };

    fn next(spacing: f32, modes: usize, excess: f64) -> Option<f64> {
        next_spacing(&Settings::default(), USUAL, 9.9, Size { spacing, modes }, excess)
    }

    #[test]
    fn voxels_get_coarser_until_as_much_of_the_modes_is_left() {
        assert_eq!((next(3.3, 29, 0.9), next(3.7, 21, 0.9)), (None, None));
        assert_eq!(next(3.3, 20, 0.9), Some(3.51));
        assert_eq!(next(3.7, 20, 0.9), Some(3.85));
    }

    #[test]
    fn what_was_asked_for_stays() {
        let spaced = Settings { spacing: Some(3.3), ..Settings::default() };
        assert_eq!(next_spacing(&spaced, USUAL, 9.9, Size { modes: 1, ..USUAL }, 9.0), None);
        let all = Settings { modes: Some(29), ..Settings::default() };
        assert_eq!(next_spacing(&all, USUAL, 9.9, USUAL, 2.0), Some(4.16));
        assert_eq!(next_spacing(&all, USUAL, 9.9, Size { spacing: 4.5, ..USUAL }, 1.0), None);
        // Where the class allows no coarser voxel.
        assert_eq!(next_spacing(&Settings::default(), USUAL, 4.0, USUAL, 9.0), Some(4.0));
    }

    #[test]
    fn steps_come_to_an_end() {
        for excess in [0.5, 1.001, 1e9] {
            let mut steps = vec![3.3f32];
            while let Some(spacing) = next(steps[steps.len() - 1], 1, excess) {
                steps.push(spacing as f32);
                assert!(steps.len() < 31, "{steps:?}");
            }
            assert_eq!(steps.last(), Some(&9.9f32), "{steps:?}");
        }
    }
}
