//! What `complete` tells of a completion: one JSON object, or lines to read.

use crate::complete::Completion;
use crate::complete::noise::Noise;
use crate::complete::verdict::Verdict;
use crate::device::Statistics;
use crate::fit::Digests;
use crate::uncertainty::{Share, hidden};
use crate::unit::digits;
use lacuna::Model;
use lacuna::format::Calibration;
use lacuna::wire::message::{Count, Counters};

/// A completion in numbers and names; the fields in this order are the JSON object.
#[derive(serde::Serialize)]
pub struct Completed<'a> {
    pub scan: String,
    pub class: &'a str,
    pub model_checksum: String,
    pub output: String,
    pub picture: Option<String>,
    pub report: Option<String>,
    pub vertices: usize,
    pub triangles: usize,
    pub measured_vertices: usize,
    pub specks_removed: usize,
    /// Null where none was taken out; in the model's unit.
    pub noise: Option<Noise>,
    pub scan_to_model: [[f64; 4]; 4],
    pub verdict: &'a Verdict,
    pub clutter: Clutter,
    pub expected_error: ExpectedError<'a>,
    pub hull_voxels: u32,
    /// Those of them that only mirror images of the scan reach; null of a device's hull, which stays there.
    pub mirrored_voxels: Option<usize>,
    pub buffer_bytes: usize,
    pub digests: Digests,
    /// Null where the fit was made here.
    pub device: Option<OnDevice>,
    pub seconds: f64,
    pub notes: Vec<String>,
}

/// What a fit on a device cost there, and what the line to it was like.
#[derive(serde::Serialize)]
pub struct OnDevice {
    pub counters: Counters,
    pub line: Statistics,
}

/// What of the scan is not part of the class; areas in the model's unit squared.
#[derive(serde::Serialize)]
pub struct Clutter {
    points: usize,
    area_share: f64,
    area: f64,
    kept: bool,
}

/// One-sigma errors of the vertices, in the model's unit.
#[derive(serde::Serialize)]
pub struct ExpectedError<'a> {
    calibrated: bool,
    measured: Option<Share>,
    inferred: Option<Share>,
    /// A part of both; 0 for one view whose points are close together.
    hidden: f32,
    /// Lengths of it in voxels.
    calibration: Option<&'a Calibration>,
}

impl Completed<'_> {
    /// The lines; `symbol` is that of the model's unit.
    pub fn lines(&self, symbol: &str) -> Vec<String> {
        let mut lines = self.judgement();
        lines.extend(self.surface(symbol));
        lines.extend(self.fit());
        lines.extend(self.outputs());
        lines.extend(self.device.iter().flat_map(OnDevice::lines));
        lines
    }

    /// How far the result can be trusted, and why.
    fn judgement(&self) -> Vec<String> {
        let grade = format!("{:?}", self.verdict.grade).to_lowercase();
        let reasons = self.verdict.reasons.iter().map(|reason| format!("                {reason}"));
        let notes = self.notes.iter().map(|note| format!("note            {note}"));
        [format!("verdict         {grade}")].into_iter().chain(reasons).chain(notes).collect()
    }

    /// How well the scan is met, and what was not seen of the surface.
    fn surface(&self, symbol: &str) -> Vec<String> {
        let evidence = &self.verdict.evidence;
        let mut lines = vec![
            format!(
                "fitted surface  {:.1} % of the scan near the model lies on it",
                100.0 * evidence.inlier_share
            ),
            format!("seen part       {} {symbol} rms from the fitted surface", digits(evidence.seen_rms, 3)),
            format!(
                "inferred part   {:.0} % of the surface, {} {symbol}2",
                100.0 * evidence.inferred_share,
                digits(evidence.inferred_area, 0)
            ),
            self.expected_error.line(symbol),
        ];
        lines.extend(self.noise.map(|Noise { before, after }| {
            let [before, after] = [before, after].map(|noise| digits(noise, 2));
            format!("noise           {before} {symbol} in the scan, {after} after smoothing (--keep-noise keeps it)")
        }));
        lines.extend(evidence.layers.map(|apart| {
            format!("two layers      {} {symbol} apart, where views overlap", digits(apart, 2))
        }));
        lines.extend(self.clutter.line(symbol));
        if let Some(mirrored) = self.mirrored_voxels.filter(|&mirrored| mirrored > 0) {
            lines.push(format!(
                "mirror prior    {mirrored} of {} hull voxels from the other side",
                self.hull_voxels
            ));
        }
        lines
    }

    /// Shape, size, pose, and the digests that a device must reach too.
    fn fit(&self) -> [String; 4] {
        let evidence = &self.verdict.evidence;
        let [found, next] = evidence.pose_inliers.map(|share| 100.0 * share);
        // Beside a pose that was given none was tried.
        let next = if next > 0.0 { format!(", the next best {next:.1} %") } else { String::new() };
        [
            format!("weights         {:.2} deviations rms", evidence.weight_norm),
            format!("scale           {:.3} of the class", evidence.scale),
            format!("pose            explains {found:.1} % of the scan{next}"),
            format!("digests         {}", self.digests),
        ]
    }

    /// The files written.
    fn outputs(&self) -> Vec<String> {
        let mesh =
            format!("mesh            {} ({} vertices, {:.2} s)", self.output, self.vertices, self.seconds);
        let picture = self.picture.iter().map(|path| format!("picture         {path}"));
        let report = self.report.iter().map(|path| format!("report          {path}"));
        [mesh].into_iter().chain(picture).chain(report).collect()
    }
}

impl OnDevice {
    fn lines(&self) -> [String; 2] {
        let Statistics { sent, repeated, sessions, .. } = self.line;
        [
            format!("device          {}", costs(&self.counters)),
            format!("line            {sent} requests, {repeated} repeated, {sessions} sessions"),
        ]
    }
}

/// What the stages cost, by the device's own counter.
pub fn costs(counters: &Counters) -> String {
    let Counters { pose, hull, global, local, distances } = counters;
    let stages =
        [("pose", pose), ("hull", hull), ("global", global), ("local", local), ("distances", distances)];
    let cost = |(name, count): (&str, &Count)| match count.work {
        0 => format!("{name} {} steps", count.steps),
        work => format!("{name} {:.1} M", work as f64 / 1e6),
    };
    stages.map(cost).join(", ")
}

impl Clutter {
    /// That of a completion; `kept` in its mesh or not.
    pub fn of(completion: &Completion, kept: bool) -> Self {
        let clutter = &completion.clutter;
        Self { points: clutter.mesh.points.len(), area_share: clutter.area_share, area: clutter.area, kept }
    }

    fn line(&self, symbol: &str) -> Option<String> {
        let how = if self.kept { "kept with label 2" } else { "left out (--keep-clutter keeps it)" };
        let Self { points, area_share, area, .. } = self;
        (*points > 0).then(|| {
            let share = 100.0 * area_share;
            let of = if *area > 0.0 {
                format!("area, {} {symbol}2, ", digits(*area, 0))
            } else {
                "points, ".into()
            };
            format!("not the class   {share:.0} % of the scan's {of}{points} points: {how}")
        })
    }
}

impl<'a> ExpectedError<'a> {
    /// Those of a completion.
    pub fn of(completion: &Completion, model: &'a Model<'_>) -> Self {
        let [measured, inferred] = completion.expected_shares;
        let calibrated = completion.expected.calibrated;
        let hidden = completion.expected.hidden;
        Self { calibrated, measured, inferred, hidden, calibration: model.calibration() }
    }

    fn line(&self, symbol: &str) -> String {
        let part = |share: Option<Share>| {
            share.map_or("-".into(), |s| match [s.median, s.p95].map(|error| digits(error, 2)) {
                [median, most] if median == most => format!("{median} {symbol} nearly everywhere"),
                [median, most] => format!("{median} {symbol} (95 % under {most})"),
            })
        };
        let guess = if self.calibrated { "" } else { "; a guess, the model is not calibrated" };
        let (measured, inferred) = (part(self.measured), part(self.inferred));
        let views = hidden::told(self.hidden, symbol);
        format!("expected error  {measured} where measured, {inferred} where inferred{views}{guess}")
    }
}
