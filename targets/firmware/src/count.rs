//! Instructions per stage.

use crate::Machine;
use lacuna::completion::Stage;

/// Rounds of the calibration loop.
const ROUNDS: u32 = 1 << 16;

/// Ticks spent in the stages of a completion.
#[derive(Clone, Copy, Debug, Default)]
pub struct Counts {
    ticks: [u64; 4],
    steps: [u32; 4],
    longest: [u32; 4],
}

/// The stages that are counted, with their names.
pub const STAGES: [(Stage, &str); 4] =
    [(Stage::Pose, "pose"), (Stage::Hull, "hull"), (Stage::Global, "global"), (Stage::Local, "local")];

impl Counts {
    /// Adds a step of a stage.
    pub fn add(&mut self, stage: Stage, ticks: u32) {
        let sums = self.ticks.iter_mut().zip(&mut self.steps).zip(&mut self.longest);
        for (((sum, steps), longest), (name, _)) in sums.zip(STAGES) {
            if name == stage {
                *sum += u64::from(ticks);
                *steps += 1;
                *longest = (*longest).max(ticks);
            }
        }
    }

    /// Ticks, steps and ticks of the longest step of each stage.
    pub fn stages(&self) -> impl Iterator<Item = (&'static str, u64, u32, u32)> + '_ {
        let sums = self.ticks.iter().zip(&self.steps).zip(&self.longest).zip(STAGES);
        sums.map(|(((&ticks, &steps), &longest), (_, name))| (name, ticks, steps, longest))
    }
}

/// How ticks become instructions: `instructions = ticks * executed / ticks taken`, measured with a loop of known
/// length, so that no clock of the emulator has to be known.
#[derive(Clone, Copy, Debug)]
pub struct Scale {
    executed: u64,
    ticks: u64,
}

impl Scale {
    /// Times the loop.
    pub fn measure<M: Machine>(machine: &mut M) -> Self {
        let before = machine.ticks();
        let executed = M::spin(ROUNDS);
        let ticks = machine.ticks().wrapping_sub(before);
        Self { executed: u64::from(executed), ticks: u64::from(ticks).max(1) }
    }

    /// Instructions in so many ticks.
    pub const fn instructions(&self, ticks: u64) -> u64 {
        match (ticks * self.executed).checked_div(self.ticks) {
            Some(instructions) => instructions,
            None => 0,
        }
    }
}
