//! Which voxels are stored, by what the training shapes' distances are there.

use crate::distance::Surface;
use crate::volume::{self, Lattice, Volume};
use rayon::prelude::*;

/// Which voxels are stored: those where the surface of a plausible shape, or the hull around it, may be.
#[derive(Clone, Copy)]
pub(super) struct Band {
    pub behind: f64,
    pub front: f64,
    pub spread: f64,
    /// At least this far on both sides: marching cubes needs whole cells around the surface.
    pub least: f64,
}

impl Band {
    /// Whether a place with these distances is in the band; `slack` is added on both sides.
    pub fn holds(&self, at: &Moments, slack: f64) -> bool {
        let wider = self.spread * at.deviation;
        let reach = |base: f64| (base + wider).max(self.least) + slack;
        at.mean >= -reach(self.behind) && at.mean <= reach(self.front)
    }
}

/// The shapes' distances at one place.
pub(super) struct Moments {
    pub mean: f64,
    pub deviation: f64,
    /// Share of the shapes seen across their border.
    pub border: f64,
}

impl Moments {
    /// Those of candidate `i`.
    pub fn of(volumes: &[&Volume], i: usize) -> Self {
        let m = volumes.len() as f64;
        let values = || volumes.iter().map(|v| f64::from(v.distances[i]));
        let mean = values().sum::<f64>() / m;
        let squares = values().map(|d| (d - mean) * (d - mean)).sum::<f64>();
        let border = volumes.iter().filter(|v| v.border[i]).count() as f64 / m;
        Self { mean, deviation: (squares / (m - 1.0).max(1.0)).sqrt(), border }
    }
}

/// The shapes' distances at every point of a lattice.
pub(super) fn coarse(surfaces: &[&Surface], nodes: &Lattice) -> Vec<Moments> {
    let places: Vec<u32> = (0..nodes.len() as u32).collect();
    let volumes: Vec<Volume> = surfaces.par_iter().map(|s| volume::sample(s, nodes, &places)).collect();
    let volumes: Vec<&Volume> = volumes.iter().collect();
    (0..nodes.len()).map(|i| Moments::of(&volumes, i)).collect()
}
