//! Whether a completion can be trusted, in numbers and in a word.

use super::explained::Explained;
use super::outgrowth::Outgrowth;
use crate::register::Registration;
use crate::register::rank::SIZES;
use crate::uncertainty::spread::Spread;
use crate::unit::digits;
use serde::Serialize;
use std::ops::Range;

/// An overall judgement, best first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Grade {
    /// As expected for a scan of the class.
    Good,
    /// Something is unusual: look at the picture.
    Check,
    /// Not to be used.
    Reject,
}

/// A judgement with its reasons.
#[derive(Clone, Debug, Serialize)]
pub struct Verdict {
    /// The judgement.
    pub grade: Grade,
    /// Why it is not better.
    pub reasons: Vec<String>,
    /// What it rests on.
    #[serde(flatten)]
    pub evidence: Evidence,
}

/// What a completion is judged by. Lengths are in the model's unit, but for those of `spread`, which are in class millimetres.
#[derive(Clone, Debug, Serialize)]
pub struct Evidence {
    /// Share of the scan's points within two class millimetres of the fitted surface, of those near it.
    pub inlier_share: f64,
    /// Share of the scan's points that lie where the model stores nothing. What was left out of the completed mesh, by area,
    /// is the clutter's.
    pub outside_share: f64,
    /// Root mean square distance of the points counted by `inlier_share` from the fitted surface, before it is moved onto
    /// the scan.
    pub seen_rms: f64,
    /// Share of the completed surface that was inferred, by area.
    pub inferred_share: f64,
    /// Inferred area.
    pub inferred_area: f64,
    /// Share of the completed surface that one view can show at most.
    pub viewable_share: f64,
    /// Root mean square of the global weights, standard deviations: about 1 for a typical shape.
    pub weight_norm: f64,
    /// Scan units a model unit: 1 for a scan in true size.
    pub scale: f64,
    /// Inlier share of the pose, and what the next best pose that was tried explains, as such a share
    /// ([`Registration::runner_up`]).
    pub pose_inliers: [f64; 2],
    /// How exactly the points counted there lie on the surface fitted with the pose, which is what tells a face among hair
    /// and clothes from hair and clothes: the mean of (1 - (r / 3)²)², r their distances in class millimetres. 1 is
    /// exactly, 8/15 anywhere within the 3. None without an inlier.
    pub exactness: Option<f64>,
    /// How well the scan determines its own pose; none where the pose was held.
    pub spread: Option<Spread>,
    /// Median expected error of the inferred surface; none where nothing is inferred or the model is not calibrated.
    pub expected: Option<f64>,
    /// How far apart the scan's points are where they lie in two layers, root mean square; none where they do not.
    pub layers: Option<f64>,
    /// What of the measured surface stands out of the shapes that the class can take.
    pub outgrowth: Outgrowth,
    /// What of the inferred surface stands out of both fits.
    pub invented: Outgrowth,
}

/// Root mean square weight, standard deviations, from which a shape is unusual: below 1.8 in the right poses of 125 scenes of
/// faces with hair or a collar.
pub const UNUSUAL: f64 = 2.0;
/// Sizes of a scan in terms of the class's that nothing is said about, a third either way: nine scans of faces 0.94 to 1.09.
const USUAL_SIZES: Range<f64> = 0.75..1.34;
/// Where less than this share of the points near the model lies on the fitted surface, the shape is unlike the class: 0.98
/// of a raw head, 0.999 and more of nine scans.
const UNLIKE: f64 = 0.85;
/// Where less than this share of them does, the shape is none of the class.
const UNLIKE_ANY: f64 = 0.5;
/// Distance of the fit from the measured surface, class millimetres rms, from which that is told: nine scans 0.11 at most, a
/// raw head 0.27.
const MISSED: f64 = 1.0;
/// Distance of two layers of a scan from which that is told, class millimetres: of views that fit together none is seen.
const LAYERS: f64 = 1.0;
/// Root mean square weight, standard deviations, from which a shape is none of the class: nine scans 1.0 at most.
const ODD: f64 = 4.0;
/// Share of a surface that one view can show of faces. More of it is no reason to ask for more.
const OPEN: f64 = 0.62;
/// Where less of the surface was seen than this share of what one view can show of it, that is told: nine scans of faces
/// 0.59 and more, a vertebra from one side 0.28 to 0.31.
const LITTLE_SEEN: f64 = 0.31;
/// Where less than this share was seen, it is too little: a patch of 40 mm of a face 0.2.
const LEAST_SEEN: f64 = 0.22;

/// Deviation of the surface beyond which what was not seen is hardly known, class millimetres. Nine scans of faces:
/// 2.3 to 2.7 at a missing part's rms of 3.0 mm at most; six heads from the front 1.5 to 1.6, from the side 2.0 to 2.2 at
/// up to 4.6 mm; a femur from the side 1.2 at 1.5 mm, the upper half of one 3.0 at 3.1 mm.
const LOOSEST: f64 = 2.85;

/// Median expected error beyond which what was not seen is a guess, class millimetres. 38 single views of faces: 1.5 to
/// 3.5 at a missing part's rms of 1.4 to 4.7 mm; ten upper halves of femurs: 5.0 to 10 at 4.4 to 22 mm.
const VAGUEST: f64 = 4.0;

/// Something to be said about a scan, and how bad it is.
pub type Finding = (Grade, String);

/// The worst grade so far, and what was found.
struct Findings {
    grade: Grade,
    reasons: Vec<String>,
}

impl Findings {
    fn extend(&mut self, findings: impl IntoIterator<Item = Finding>) {
        findings.into_iter().for_each(|(grade, reason)| self.add(true, grade, reason));
    }

    fn add(&mut self, found: bool, grade: Grade, reason: String) {
        if found {
            self.reasons.push(reason);
            self.grade = self.grade.max(grade);
        }
    }
}

/// What is to be said about a pose that was found for a scan, `scale` times as large as the class.
pub fn of_pose(found: &Registration, scale: f64) -> impl Iterator<Item = Finding> {
    Explained::from(found).findings().chain(size(scale))
}

/// Root mean square of weights.
pub fn weight_norm(weights: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = weights.len().max(1) as f64;
    (weights.map(|weight| weight * weight).sum::<f64>() / count).sqrt()
}

/// What is to be said about a scan of which the pose says that it is so many times as large as the class; none where that
/// is usual.
fn size(scale: f64) -> Option<Finding> {
    let grade = if SIZES.contains(&scale) { Grade::Check } else { Grade::Reject };
    let usual = USUAL_SIZES.contains(&scale);
    (!usual).then(|| {
        (grade, format!("the scan is {scale:.2} times the size of the class: is the unit right, does it face outwards?"))
    })
}

/// What is to be said about a scan whose points lie in two layers, so far apart; none where they are nearly one.
/// `millimetre` is one class millimetre in the scan's unit, called `unit`.
pub fn in_layers(apart: f64, millimetre: f64, unit: &str) -> Option<Finding> {
    let text = format!(
        "the points lie in two layers, {} {unit} apart: were the views aligned, did anything move?",
        digits(apart, 1)
    );
    (apart > LAYERS * millimetre).then_some((Grade::Check, text))
}

impl Evidence {
    /// The verdict on it; `millimetre` is one class millimetre in the model's unit, called `unit`.
    pub fn judged(self, millimetre: f64, unit: &str) -> Verdict {
        let mut findings = Findings { grade: Grade::Good, reasons: Vec::new() };
        findings.extend(self.explained().findings());
        self.judge_fit(&mut findings, millimetre, unit);
        self.judge_unseen(&mut findings, millimetre, unit);
        findings.extend(size(self.scale));
        let Findings { grade, reasons } = findings;
        Verdict { grade, reasons, evidence: self }
    }

    /// What of it the pose explains.
    pub fn explained(&self) -> Explained {
        let [pose, runner_up] = self.pose_inliers;
        let (outside, exactness, weight_norm) = (self.outside_share, self.exactness, self.weight_norm);
        Explained { pose, runner_up, outside, exactness, weight_norm }
    }

    fn judge_fit(&self, findings: &mut Findings, millimetre: f64, unit: &str) {
        let inliers = self.inlier_share;
        let on_it = || format!("only {} of the scan near the model lies on it", percent(inliers));
        findings.add(
            inliers < UNLIKE_ANY,
            Grade::Reject,
            format!("{}: another kind of object, or a wrong pose", on_it()),
        );
        findings.add(
            (UNLIKE_ANY..UNLIKE).contains(&inliers),
            Grade::Check,
            format!("{}: it is unlike the class", on_it()),
        );
        findings.add(
            self.seen_rms > MISSED * millimetre,
            Grade::Check,
            format!("the fit misses the measured surface by {} {unit} rms", digits(self.seen_rms, 2)),
        );
        let Outgrowth { area, height, .. } = self.outgrowth;
        findings.add(
            self.outgrowth.is_large(),
            Grade::Check,
            format!(
                "{} {unit}2 of the measured surface stand out of what the model makes of the scan, by {} {unit} at most: a \
                 swelling, a strap, a hand, or a shape it does not know?",
                digits(area, 0),
                digits(height, 1)
            ),
        );
        findings.extend(self.layers.and_then(|apart| in_layers(apart, millimetre, unit)));
        findings.add(
            self.weight_norm >= UNUSUAL,
            if self.weight_norm > ODD { Grade::Reject } else { Grade::Check },
            format!("the shape is {:.1} deviations off the class", self.weight_norm),
        );
    }

    fn judge_unseen(&self, findings: &mut Findings, millimetre: f64, unit: &str) {
        let seen = (1.0 - self.inferred_share) / self.viewable_share.min(OPEN);
        findings.add(
            seen < LITTLE_SEEN,
            if seen < LEAST_SEEN { Grade::Reject } else { Grade::Check },
            format!(
                "{} of the surface is inferred; one view can show {} of it",
                percent(self.inferred_share),
                percent(self.viewable_share)
            ),
        );
        let loose = self.spread.map_or(0.0, |spread| spread.surface);
        findings.add(
            loose > LOOSEST,
            Grade::Check,
            format!(
                "what was not seen is hardly determined: by the model alone it varies by {} {unit} (one deviation)",
                digits(loose * millimetre, 1)
            ),
        );
        let Outgrowth { area, height, .. } = self.invented;
        findings.add(
            self.invented.is_large(),
            Grade::Check,
            format!(
                "{} {unit}2 of the inferred surface are in neither the global nor the local fit, {} {unit} from them at most: \
                 look at them in the picture, or scan that side, too",
                digits(area, 0),
                digits(height, 1)
            ),
        );
        let vague = self.expected.unwrap_or(0.0);
        findings.add(
            vague > VAGUEST * millimetre,
            Grade::Check,
            format!("half of what was not seen is expected to be off by {} {unit} or more", digits(vague, 1)),
        );
    }
}

/// A share in words.
pub(super) fn percent(share: f64) -> String {
    format!("{:.0} %", 100.0 * share)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn typical() -> Evidence {
        Evidence {
            inlier_share: 0.97,
            outside_share: 0.02,
            seen_rms: 0.2,
            inferred_share: 0.5,
            inferred_area: 1.0,
            viewable_share: 0.62,
            weight_norm: 1.1,
            scale: 1.0,
            pose_inliers: [0.9, 0.4],
            exactness: Some(0.8),
            spread: Some(Spread { turn: 0.5, surface: 2.4 }),
            expected: Some(2.5),
            layers: None,
            outgrowth: Outgrowth::default(),
            invented: Outgrowth::default(),
        }
    }

    #[test]
    fn a_typical_scan_is_good_and_every_oddity_is_named() {
        assert_eq!(typical().judged(1.0, "mm").grade, Grade::Good);
        let loose =
            Evidence { spread: Some(Spread { turn: 0.5, surface: 3.1 }), ..typical() }.judged(1.0, "mm");
        assert_eq!((loose.grade, loose.reasons.len()), (Grade::Check, 1));
        let vague = Evidence { expected: Some(4.5), ..typical() };
        assert_eq!(vague.clone().judged(1.0, "mm").grade, Grade::Check);
        assert_eq!(vague.judged(2.0, "mm").grade, Grade::Good, "a class twice as large");
        let layers = Evidence { layers: Some(1.5), ..typical() };
        assert_eq!(layers.clone().judged(1.0, "mm").grade, Grade::Check);
        assert_eq!(layers.judged(2.0, "mm").grade, Grade::Good, "a class twice as large");
        let patch_of = |area, height| Outgrowth { area, height, little: 320.0 };
        let bump = |area| Evidence { outgrowth: patch_of(area, 9.0), ..typical() };
        assert_eq!(
            [300.0, 900.0].map(|area| bump(area).judged(1.0, "mm").grade),
            [Grade::Good, Grade::Check]
        );
        let rod = Evidence { invented: patch_of(900.0, 20.0), ..typical() }.judged(1.0, "mm");
        assert_eq!((rod.grade, rod.reasons.len()), (Grade::Check, 1));
        let upside_down = Evidence { pose_inliers: [0.99, 0.98], ..typical() }.judged(1.0, "mm");
        assert_eq!((upside_down.grade, upside_down.reasons.len()), (Grade::Check, 1), "or not: a mug");
        let patch = |inferred_share, viewable_share| {
            Evidence { inferred_share, viewable_share, ..typical() }.judged(1.0, "mm").grade
        };
        assert_eq!(
            [0.69, 0.82, 0.87].map(|inferred| patch(inferred, 0.62)),
            [Grade::Good, Grade::Check, Grade::Reject]
        );
        assert_eq!(patch(0.78, 1.0), Grade::Good, "a relief");
        assert_eq!(patch(0.88, 0.42), Grade::Check, "of a closed shape one view shows less");
        let other = Evidence { inlier_share: 0.3, ..typical() }.judged(1.0, "mm");
        assert_eq!((other.grade, other.reasons.len()), (Grade::Reject, 1));
        let odd = Evidence { inlier_share: 0.7, seen_rms: 2.0, scale: 2.0, inferred_share: 0.9, ..typical() };
        assert_eq!(odd.judged(1.0, "mm").reasons.len(), 4);
        let strange = Evidence { inlier_share: 0.3, weight_norm: 3.0, ..typical() }.judged(1.0, "mm");
        assert_eq!((strange.grade, strange.reasons.len()), (Grade::Reject, 2));
    }
}
