//! The differences between rungs, as numbers and as a table.

use super::Results;
use crate::fit::Digests;
use crate::quantile::quantile;
use crate::unit;
use lacuna::Model;
use serde::Serialize;
use std::fmt;

/// A stage of the fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Stage {
    /// Measured distances.
    Hull,
    /// Weights of the global fit.
    GlobalWeights,
    /// Distances of the global fit.
    GlobalDistances,
    /// Distances of the local fit.
    LocalDistances,
}

/// Two neighbouring rungs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub enum Rungs {
    /// Reference on the training volumes, core in float: band, model and hull quantisation.
    #[serde(rename = "1-2")]
    ReferenceFloat,
    /// Reference on the model file's numbers and the core's hull, core in float: the core's arithmetic.
    #[serde(rename = "1f-2")]
    FileFloat,
    /// Core in float, core in fixed point: rounding.
    #[serde(rename = "2-3")]
    FloatFixed,
}

/// How far two rungs are apart after a stage.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// The stage.
    pub stage: Stage,
    /// The rungs.
    pub rungs: Rungs,
    /// Values compared: modes, or voxels within one voxel of the zero level.
    pub compared: usize,
    /// Median of the absolute differences: millimetres, or standard deviations for weights.
    pub median: f64,
    /// The largest of them.
    pub worst: f64,
    /// Voxels near the zero level that only one of the two rungs knows.
    pub unmatched: usize,
}

/// What became of a case.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Report {
    /// Name of the case.
    pub case: String,
    /// Stored voxels.
    pub voxels: usize,
    /// Modes.
    pub modes: usize,
    /// Edge of a voxel, millimetres; the core's distances are multiples of a 256th of it.
    pub voxel_mm: f64,
    /// Voxels in the hull.
    pub hull_voxels: u32,
    /// The differences.
    pub comparisons: Vec<Comparison>,
    /// What the fixed-point stages computed.
    pub digests: Digests,
    /// What they should have computed, where that is known.
    pub golden: Option<Digests>,
}

impl Report {
    /// A difference by stage and rungs.
    pub fn get(&self, stage: Stage, rungs: Rungs) -> Option<&Comparison> {
        self.comparisons.iter().find(|c| (c.stage, c.rungs) == (stage, rungs))
    }

    /// Names of the stages whose digests are not the golden ones, the first one being the cause; none where no golden ones are
    /// known.
    pub fn changed(&self) -> Vec<&'static str> {
        let Some(golden) = self.golden else { return vec![] };
        let pairs = self.digests.named().into_iter().zip(golden.named());
        pairs.filter(|(found, expected)| found != expected).map(|((name, _), _)| name).collect()
    }
}

/// The unit of a model.
pub(super) struct Scale {
    pub voxel_mm: f64,
}

impl Scale {
    pub fn of(model: &Model<'_>) -> Self {
        let header = model.header();
        Self { voxel_mm: f64::from(header.spacing) * unit::millimetres(header.unit) }
    }

    /// All stages of two rungs.
    pub fn compare_all(&self, rungs: Rungs, a: &Results, b: &Results) -> [Comparison; 4] {
        let hull = |r: &Results| r.hull.iter().map(|t| t.unwrap_or(f64::NAN)).collect::<Vec<f64>>();
        let weights: Vec<f64> = a.weights.iter().zip(&b.weights).map(|(a, b)| (a - b).abs()).collect();
        [
            self.surface(Stage::Hull, rungs, &hull(a), &hull(b)),
            comparison(Stage::GlobalWeights, rungs, weights, 0),
            self.surface(Stage::GlobalDistances, rungs, &a.global, &b.global),
            self.surface(Stage::LocalDistances, rungs, &a.local, &b.local),
        ]
    }

    /// Distances at the voxels within one voxel of the zero level, NaN where a rung knows nothing.
    fn surface(&self, stage: Stage, rungs: Rungs, a: &[f64], b: &[f64]) -> Comparison {
        let near = |v: &f64| v.abs() <= 1.0;
        let both = a.iter().zip(b).filter(|(a, b)| near(a) && !b.is_nan());
        let differences = both.map(|(a, b)| (a - b).abs() * self.voxel_mm).collect();
        let lone = a.iter().zip(b).filter(|(a, b)| (near(a) && b.is_nan()) || (near(b) && a.is_nan()));
        comparison(stage, rungs, differences, lone.count())
    }
}

fn comparison(stage: Stage, rungs: Rungs, mut differences: Vec<f64>, unmatched: usize) -> Comparison {
    differences.sort_unstable_by(f64::total_cmp);
    let compared = differences.len();
    let median = quantile(&differences, 0.5).unwrap_or(0.0);
    let worst = differences.last().copied().unwrap_or(0.0);
    Comparison { stage, rungs, compared, median, worst, unmatched }
}

impl fmt::Display for Stage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Hull => "hull",
            Self::GlobalWeights => "global weights",
            Self::GlobalDistances => "global distances",
            Self::LocalDistances => "local distances",
        })
    }
}

impl fmt::Display for Rungs {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::ReferenceFloat => "1-2",
            Self::FileFloat => "1f-2",
            Self::FloatFixed => "2-3",
        })
    }
}

impl fmt::Display for Comparison {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let unit = if self.stage == Stage::GlobalWeights { "sd" } else { "mm" };
        let Self { stage, rungs, compared, median, worst, unmatched } = self;
        write!(f, "{stage:<17}{rungs:<6}{compared:>8}{unmatched:>11}{median:>10.5}{worst:>10.5}  {unit}")
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { case, voxels, modes, voxel_mm, hull_voxels, .. } = self;
        writeln!(
            f,
            "{case}: {voxels} voxels of {voxel_mm} mm, {modes} modes, {hull_voxels} voxels in the hull"
        )?;
        writeln!(
            f,
            "{:<17}{:<6}{:>8}{:>11}{:>10}{:>10}",
            "stage", "rungs", "compared", "unmatched", "median", "worst"
        )?;
        self.comparisons.iter().try_for_each(|c| writeln!(f, "{c}"))?;
        let digests = &self.digests;
        writeln!(f, "digests: {digests}")?;
        match (self.golden, self.changed().as_slice()) {
            (None, _) => write!(f, "golden: none given"),
            (_, []) => write!(f, "golden: equal"),
            (_, changed) => write!(f, "golden: changed in {}", changed.join(", ")),
        }
    }
}
