//! Poses compared by what they explain.

use super::Placed;
use super::field::Field;
use crate::mesh::Point;
use lacuna::Pose;
use std::cmp::Ordering;
use std::ops::Range;

/// Sizes of a scan in terms of the class's that the search can find (25 % either way) with some room.
pub const SIZES: Range<f64> = 0.66..1.5;

/// A refined pose.
#[derive(Clone, Debug)]
pub struct Scored {
    /// From the centred scan to voxels.
    pub pose: Pose,
    /// How exactly the points lie on the fitted surface, on average, times the root of the scale: shrinking must not pay, and
    /// growing must not outweigh what it loses.
    pub explained: f64,
    /// Share of the points that lie on the fitted surface and face its way.
    pub inliers: f64,
    /// Share of the points that may belong to the class in this pose.
    pub near: f64,
    /// Size of the scan in terms of the class's.
    pub size: f64,
    /// Weights of the shape found with it, standard deviations.
    pub shape: Vec<f32>,
}

/// A pose that explains this share of its scan leaves no room for clutter that could mislead it. Nine scans of faces: 0.9 to
/// 0.96; faces among hair that ended 11 to 20 % too large: 0.66 to 0.73.
const CLEAN: f64 = 0.88;
/// Nor does one whose inliers times exactness are so much: 0.73 to 0.82 of the same faces, 0.47 to 0.63 of those among hair.
const EXACTLY_CLEAN: f64 = 0.7;

/// Whether clutter may mislead a pose that explains so much of its scan so exactly.
pub fn among_clutter(inliers: f64, exactness: f64) -> bool {
    inliers < CLEAN && inliers * exactness < EXACTLY_CLEAN
}

/// A pose among clutter that explains less than this share of its scan may be that of another thing than the one looked for, and
/// so may one in an impossible size: 32 scenes of a head on smooth shoulders were all found on these, with 0.25 to 0.61.
const HALF: f64 = 0.5;

impl Scored {
    /// Whether clutter may mislead the pose.
    pub fn is_among_clutter(&self) -> bool {
        among_clutter(self.inliers, self.exactness())
    }

    /// Whether the pose may be that of another thing of the scene.
    pub fn is_one_of_several_things(&self) -> bool {
        self.is_among_clutter() && (self.inliers < HALF || !SIZES.contains(&self.size))
    }

    /// How exactly the inliers lie on the fitted surface: the mean of (1 - (r / τ)²)² over them; 0 without any.
    pub fn exactness(&self) -> f64 {
        self.explained * self.size.sqrt() / self.inliers.max(f64::MIN_POSITIVE)
    }

    /// The same pose, with what it explains of all points if those it was scored with are this share of them and no others may
    /// belong to the class.
    #[must_use]
    pub fn of_all(self, share: f64) -> Self {
        Self { inliers: share * self.inliers, explained: share * self.explained, near: share, ..self }
    }

    /// How exactly the points that may belong to the class lie on the fitted surface: [`exactness`](Self::exactness) with all of
    /// them counted.
    fn precision(&self) -> f64 {
        self.explained * self.size.sqrt() / self.near.max(f64::MIN_POSITIVE)
    }

    /// How likely this thing of a scene is one of the class, in comparison with another: large and smooth things, as shoulders,
    /// explain more of a scan in their place than a face does, but less of what lies there. Nine scenes of a face on smooth
    /// shoulders: a precision of 0.71 to 0.79 in the right pose, 0.39 to 0.66 in the others, which explain up to 1.9 times as
    /// much.
    fn likelihood(&self) -> f64 {
        self.explained * self.precision().powi(3)
    }
}

/// An order of poses, best first.
fn by_what_they_explain(a: &Scored, b: &Scored) -> Ordering {
    b.explained.total_cmp(&a.explained)
}

/// Least share of a scan that a pose explains which ends the search.
const CONVINCING: f64 = 0.8;
/// Largest share of what such a pose explains that the next best one explains as well; where it is more, the search goes on.
const CONVINCING_RIVAL: f64 = 0.8;

/// Whether the best of the poses explains enough, and enough more than the next one.
pub fn convincing(field: &Field, ranked: &[Scored]) -> bool {
    let Some((best, others)) = ranked.split_first() else { return false };
    best.inliers >= CONVINCING && next_best(field, best, others) <= CONVINCING_RIVAL * best.inliers
}

/// Least share of a scan that a pose explains otherwise than by chance: scans of noise and of shuffled triangles 0.02 to 0.05, a
/// raw photogrammetry scan with hair and shoulders 0.33.
const NEXT_TO_NOTHING: f64 = 0.1;
/// Exactness below which a pose that explains less than that does so by chance: points anywhere within reach make 8/15. The same
/// scans 0.53 to 0.6 and 0.74.
const BY_CHANCE: f64 = 0.62;

/// Whether a pose explains no more than chance does. More turns seldom find a better one, of a scan that is inside out one that
/// explains a fifth; [`alternatives`](crate::check::alternatives) tell of that.
pub fn hopeless(best: &Scored) -> bool {
    best.inliers < NEXT_TO_NOTHING && best.exactness() < BY_CHANCE
}

/// A pose among clutter is sure if it explains its inliers this exactly. Three wrong ones among 168 scenes with hair: 0.69
/// to 0.742.
const SURE: f64 = 0.75;
/// It is sure, too, if the next best explains at most this share of what it does. The same three: 0.69 to 0.98.
const SURE_RIVAL: f64 = 0.6;

/// Whether other pairs would hardly lead to a better pose than `best`; `others` were found beside it.
pub fn sure<'s>(field: &Field, best: &Scored, others: impl IntoIterator<Item = &'s Scored>) -> bool {
    !best.is_among_clutter()
        || best.exactness() >= SURE
        || next_best(field, best, others) <= SURE_RIVAL * best.inliers
}

/// What the best of `others` that is another pose than `best` explains, as a share of inliers at the scale of `best`: more than
/// that where it is a larger, less likely thing of a scene; 0 without any.
pub fn next_best<'s>(field: &Field, best: &Scored, others: impl IntoIterator<Item = &'s Scored>) -> f64 {
    let others = others.into_iter().filter(|other| apart(field, &best.pose, &other.pose));
    let explained = best.explained.max(f64::MIN_POSITIVE);
    others.map(|other| other.explained / explained * best.inliers).fold(0.0, f64::max)
}

/// The poses, best first, with the likeliest of a scene's things in front: the same where the best explains half of the
/// scan.
pub fn likeliest(field: &Field, mut ranked: Vec<Scored>) -> Vec<Scored> {
    let Some(best) = ranked.first().filter(|best| best.is_one_of_several_things()) else { return ranked };
    let likelier = |other: &&Scored| {
        SIZES.contains(&other.size)
            && other.likelihood() > best.likelihood()
            && apart(field, &best.pose, &other.pose)
    };
    let others = ranked.iter().filter(likelier);
    let Some(thing) = others.max_by(|a, b| a.likelihood().total_cmp(&b.likelihood())) else { return ranked };
    // Of the poses of one thing the one that explains most is the best.
    let of_it = |other: &Scored| !apart(field, &thing.pose, &other.pose);
    let Some(at) = ranked.iter().position(of_it) else { return ranked };
    ranked[..=at].rotate_right(1);
    ranked
}

/// The poses in which the scan has a size that is searched for, or all if there are none (a scan that fits nowhere may be
/// shrunk until a shape of many times its size explains all of it), best first.
pub fn ranked(mut poses: Vec<Scored>) -> Vec<Scored> {
    if poses.iter().any(|pose| SIZES.contains(&pose.size)) {
        poses.retain(|pose| SIZES.contains(&pose.size));
    }
    poses.sort_by(by_what_they_explain);
    poses
}

/// A pose may still turn out the best with many points if it explains this share of what the best explains with few.
const CLOSE: f64 = 0.75;

/// The poses that are refined with many points, and the rest: the first `count`, the best other pose than the first, and
/// up to `most` that come close to it and are other poses than all these.
pub fn finals(field: &Field, ranked: Vec<Scored>, count: usize, most: usize) -> [Vec<Scored>; 2] {
    let least = CLOSE * ranked.first().map_or(0.0, |best| best.explained);
    let (mut finals, mut rest): (Vec<Scored>, Vec<Scored>) = (Vec::new(), Vec::new());
    let mut has_other = false;
    for pose in ranked {
        let is_other = finals.first().is_some_and(|first| apart(field, &first.pose, &pose.pose));
        let is_new = || finals.iter().all(|chosen| apart(field, &chosen.pose, &pose.pose));
        let is_close = finals.len() < most && pose.explained >= least && is_new();
        if finals.len() < count || (is_other && !has_other) || is_close {
            has_other |= is_other;
            finals.push(pose);
        } else {
            rest.push(pose);
        }
    }
    [finals, rest]
}

/// Whether two poses differ by more than ten degrees, or move the surface by more than fifteen class millimetres.
fn apart(field: &Field, a: &Pose, b: &Pose) -> bool {
    let entries = a.rotation.as_flattened().iter().zip(b.rotation.as_flattened());
    let trace: f32 = entries.map(|(x, y)| x * y).sum();
    let [a, b] = [a, b].map(|pose| Placed { centre: Point::origin(), pose: *pose });
    let moved = |q: &Point| (b.to_model(&a.to_scan(q)) - q).norm();
    let points = &field.samples.points;
    let mean = points.iter().map(moved).sum::<f64>() / points.len().max(1) as f64;
    (trace - 1.0) / 2.0 < libm::cosf(10f32.to_radians()) || mean > 15.0 * field.millimetre
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A ball.
    fn field() -> Field {
        let away = |i: usize| [i % 12, i / 12 % 12, i / 144].map(|v| v as f32 - 5.5);
        let ball = |i: usize| away(i).iter().map(|v| v * v).sum::<f32>().sqrt() - 4.0;
        Field::of_values([12; 3], &(0..1728).map(ball).collect::<Vec<_>>(), 1.0)
    }

    fn scored(size: f64, shift: f32) -> Scored {
        let pose = Pose { translation: [shift, 0.0, 0.0], ..Pose::IDENTITY };
        Scored { pose, explained: 0.5, inliers: 0.5, near: 1.0, size, shape: vec![] }
    }

    #[test]
    fn poses_of_impossible_sizes_are_the_last_resort() {
        let sizes = |all: &[f64]| -> Vec<f64> {
            let poses = all.iter().map(|&size| scored(size, 0.0)).collect();
            ranked(poses).iter().map(|pose| pose.size).collect()
        };
        assert_eq!(sizes(&[4.8, 1.3, 0.3, 0.9]), [1.3, 0.9]);
        assert_eq!(sizes(&[4.8, 0.3]), [4.8, 0.3]);
    }

    #[test]
    fn only_poses_that_leave_much_unexplained_inexactly_are_among_clutter() {
        let explains = |inliers: f64, exactness: f64| {
            let found = Scored { inliers, explained: inliers * exactness / 1.2, ..scored(1.44, 0.0) };
            found.is_among_clutter()
        };
        assert!(explains(0.82, 0.77), "a face that takes the size of its hair");
        assert!(!explains(0.92, 0.7), "a bone that is followed badly");
        assert!(!explains(0.85, 0.85), "a face with a few specks");
    }

    #[test]
    fn what_little_is_explained_inexactly_is_hopeless() {
        let scored = |inliers: f64, exactness: f64| Scored {
            pose: Pose::IDENTITY,
            explained: inliers * exactness,
            inliers,
            near: 1.0,
            size: 1.0,
            shape: vec![],
        };
        let verdicts = [(0.04, 0.56), (0.04, 0.75), (0.3, 0.56)].map(|(i, e)| hopeless(&scored(i, e)));
        assert_eq!(verdicts, [true, false, false], "noise, a face in a large scene, another kind of object");
    }

    #[test]
    fn a_pose_among_clutter_is_sure_if_it_is_exact_or_without_a_rival() {
        let field = field();
        let best = |exactness: f64| Scored { explained: 0.6 * exactness, inliers: 0.6, ..scored(1.0, 0.0) };
        let rival = |explained: f64| [Scored { explained, ..scored(1.0, 90.0) }];
        assert!(sure(&field, &best(0.76), &rival(0.44)));
        assert!(!sure(&field, &best(0.7), &rival(0.3)));
        assert!(sure(&field, &best(0.7), &rival(0.2)));
        assert!(sure(&field, &Scored { inliers: 0.9, ..best(0.7) }, &rival(0.4)));
    }

    #[test]
    fn of_a_scenes_things_the_one_of_which_more_of_what_lies_there_is_explained_is_the_likeliest() {
        let field = field();
        let thing = |explained: f64, near: f64, shift: f32| Scored {
            explained,
            inliers: explained / 0.85,
            near,
            ..scored(1.0, shift)
        };
        let (shoulders, face) = (thing(0.25, 0.6, 0.0), thing(0.17, 0.21, 90.0));
        let of = |poses: Vec<Scored>| -> Vec<f32> {
            likeliest(&field, poses).iter().map(|p| p.pose.translation[0]).collect()
        };
        let worse = thing(0.16, 0.19, 90.1);
        assert_eq!(
            of(vec![shoulders.clone(), thing(0.2, 0.6, 0.1), face.clone(), worse]),
            [90.0, 0.0, 0.1, 90.1]
        );
        assert_eq!(of(vec![shoulders.clone(), thing(0.17, 0.4, 90.0)]), [0.0, 90.0], "not much more exactly");
        assert_eq!(of(vec![shoulders.clone(), Scored { size: 3.0, ..face.clone() }]), [0.0, 90.0]);
        assert_eq!(
            of(vec![thing(0.82, 1.0, 0.0), thing(0.8, 0.9, 90.0)]),
            [0.0, 90.0],
            "nothing misleads it"
        );
        let share = next_best(&field, &face, [&shoulders]) / face.inliers;
        assert!((share - 0.25 / 0.17).abs() < 1e-9, "they explain more: it is not without a rival");
    }

    #[test]
    fn the_best_other_pose_is_among_the_finals_and_its_share_is_told() {
        let field = field();
        let shifts = |poses: &[Scored]| -> Vec<f32> { poses.iter().map(|p| p.pose.translation[0]).collect() };
        let of = |all: &[f32]| {
            let ranked = all.iter().map(|&shift| scored(1.0, shift)).collect();
            finals(&field, ranked, 2, 2).map(|poses| shifts(&poses))
        };
        assert_eq!(of(&[0.0, 0.1, 0.2, 90.0, 80.0]), [vec![0.0, 0.1, 90.0], vec![0.2, 80.0]]);
        assert_eq!(of(&[0.0, 90.0, 0.2]), [vec![0.0, 90.0], vec![0.2]]);
        assert_eq!(of(&[0.0]), [vec![0.0], vec![]]);
        let weak = Scored { explained: 0.3, ..scored(1.0, 360.0) };
        let close =
            [scored(1.0, 0.0), scored(1.0, 90.0), scored(1.0, 0.1), scored(1.0, 180.0), weak].to_vec();
        assert_eq!(
            finals(&field, close.clone(), 1, 9).map(|p| shifts(&p)),
            [vec![0., 90., 180.], vec![0.1, 360.]]
        );
        assert_eq!(finals(&field, close, 1, 2).map(|p| shifts(&p)), [vec![0., 90.], vec![0.1, 180., 360.]]);
        let others = [scored(1.0, 0.1), Scored { explained: 0.4, ..scored(1.0, 90.0) }];
        assert_eq!(next_best(&field, &scored(1.0, 0.0), &others), 0.4);
        assert_eq!(next_best(&field, &scored(1.0, 0.0), &others[..1]), 0.0);
    }
}
