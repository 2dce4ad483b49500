//! What a model takes of a device, and what the device has.

use super::model_file;
use crate::uncertainty::expected::of_faces;
use lacuna::format::Calibration;
use lacuna::{Error, Fixed, Model, Schedule, Sizes};

/// Bytes that a model takes of a device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Footprint {
    /// Its file.
    pub flash: u64,
    /// The fit's memory without momentum, in fixed point; the scan's points come on top.
    pub ram: u64,
}

impl Footprint {
    /// What the model in this file takes.
    ///
    /// # Errors
    /// A file without a model whose fit can run.
    pub fn of(file: &[u8]) -> Result<Self, Error> {
        let model = Model::from_bytes(file)?;
        let schedule = Schedule::of(&model);
        let ram = Sizes::required(&model, &schedule)?.bytes::<Fixed>();
        Ok(Self { flash: file.len() as u64, ram: ram as u64 })
    }

    /// The same once the longest calibration there can be is written into the file.
    ///
    /// # Errors
    /// As [`Self::of`].
    pub(super) fn when_calibrated(file: &[u8]) -> Result<Self, Error> {
        let longest = Calibration { scans: u16::MAX, ..of_faces(1.0) };
        let factors = vec![0; usize::from(Model::from_bytes(file)?.header().bricks)];
        Self::of(&model_file::calibrated(file, &longest, Some(&factors))?)
    }
}

/// Bytes that a device has for a model, where that is limited.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Limits {
    /// For its file.
    pub flash: Option<u64>,
    /// For its fit.
    pub ram: Option<u64>,
}

impl Limits {
    /// How many times as large as allowed the larger excess is; what fits has at most 1.
    pub fn excess(&self, taken: &Footprint) -> f64 {
        let share = |taken: u64, limit: Option<u64>| limit.map_or(0.0, |limit| taken as f64 / limit as f64);
        share(taken.flash, self.flash).max(share(taken.ram, self.ram))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_larger_excess_counts_and_no_limit_is_none() {
        let taken = Footprint { flash: 300, ram: 500 };
        let excess = |flash, ram| Limits { flash, ram }.excess(&taken);
        assert_eq!((excess(None, None), excess(Some(300), None)), (0.0, 1.0));
        assert_eq!((excess(Some(100), Some(500)), excess(Some(300), Some(250))), (3.0, 2.0));
    }

    #[test]
    fn a_calibration_to_come_is_counted() {
        let file = lacuna_fixtures::MODEL;
        let [now, later] = [Footprint::of(file), Footprint::when_calibrated(file)].map(Result::unwrap);
        assert!(later.flash >= now.flash && later.flash < now.flash + 8, "{now:?} {later:?}");
        assert_eq!(later.ram, now.ram);
    }
}
