//! Instructions per stage.

use crate::Machine;
use lacuna::completion::Stage;
use lacuna::local_fit::Task;

/// Rounds of the calibration loop.
const ROUNDS: u32 = 1 << 16;

/// Ticks spent in the stages of a completion.
#[derive(Clone, Copy, Debug, Default)]
pub struct Counts {
    ticks: [u64; 8],
    steps: [u32; 8],
    longest: [u32; 8],
}

/// The work that is counted.
pub type Work = (Stage, Option<Task>);

/// Its names.
pub const WORK: [(Work, &str); 8] = [
    ((Stage::Pose, None), "pose"),
    ((Stage::Hull, None), "hull"),
    ((Stage::Global, None), "global"),
    ((Stage::Local, Some(Task::Curvature)), "local curvature"),
    ((Stage::Local, Some(Task::Residuals)), "local residuals"),
    ((Stage::Local, Some(Task::Gradient)), "local gradient"),
    ((Stage::Local, Some(Task::Update)), "local update"),
    ((Stage::Local, Some(Task::Sweep)), "local sweep"),
];

impl Counts {
    /// Adds a step.
    pub fn add(&mut self, work: Work, ticks: u32) {
        let sums = self.ticks.iter_mut().zip(&mut self.steps).zip(&mut self.longest);
        for (((sum, steps), longest), (name, _)) in sums.zip(WORK) {
            if name == work {
                *sum += u64::from(ticks);
                *steps += 1;
                *longest = (*longest).max(ticks);
            }
        }
    }

    /// Ticks, steps and ticks of the longest step of each stage.
    pub fn stages(&self) -> impl Iterator<Item = (&'static str, u64, u32, u32)> + '_ {
        let sums = self.ticks.iter().zip(&self.steps).zip(&self.longest).zip(WORK);
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
    pub fn measure<M: Machine>() -> Self {
        let before = M::ticks();
        let executed = M::spin(ROUNDS);
        let ticks = M::ticks().wrapping_sub(before);
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
