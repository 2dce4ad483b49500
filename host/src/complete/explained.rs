//! What a pose explains of a scan, and what that tells: the same of one that was searched for as of one that a scan was
//! completed in.

use super::verdict::{Finding, Grade, UNUSUAL, percent, weight_norm};
use crate::register::Registration;

/// Least share of the points near the model that a pose must explain. Nine scans of faces: 0.93 to 0.99, a raw
/// photogrammetry scan with hair and collar: 0.81, eight parts of it 0.80 to 0.90, its shoulders and hair alone 0.53 and 0.66;
/// ellipsoid 0.50, sphere 0.40, half a sphere 0.56.
const LEAST: f64 = 0.72;
/// A pose that explains less is still not one of another kind of object, where what it does explain lies so exactly on
/// the shape. 125 scenes of faces with hair or a collar: 0.68 to 0.9 in poses within 9 degrees, a quarter of them below 0.75,
/// 0.61 and 0.64 in wrong ones; hair, collars, femurs and blobs in sizes of the class 0.69 at most, the hair of a raw
/// photogrammetry scan 0.74.
const EXACT: f64 = 0.75;
/// The same for a pose without a rival. 70 scenes of faces with hair and collar: eight right poses 0.717 to 0.748.
const EXACT_ALONE: f64 = 0.7;
/// A pose is without a rival if the next best explains at most this share of what it does: 0.51 to 0.68 beside those eight;
/// beside hair, collars, shoulders and femurs in sizes of the class, where their shape is not unusual, 0.74 or more.
const RIVAL: f64 = 0.7;
/// A pose beside which another one explains more than this share of what it explains may be the wrong one of them. The other
/// one explains 0.36 to 0.50 beside the right poses of nine scans of faces, 0.67 at most of single views of others and of
/// femurs, 0.56 to 0.88 on eight parts of a raw head with shoulders, and 0.94 to 1.0 on ten mugs from the side, be they right
/// or upside down.
const AMBIGUOUS: f64 = 0.9;
/// Least share of a whole scan that a pose explains without a word: half a head with shoulders 0.26 to 0.36.
const LITTLE: f64 = 0.25;
/// Least share that a pose explains at all: a head on a table of a square metre 0.07.
const LEAST_OF_ALL: f64 = 0.04;
/// Share of a scan where the class has no surface, beyond which that is told: nine scans of faces 0.03 at most, a head with
/// shoulders 0.6.
const MOST_OUTSIDE: f64 = 0.3;

/// What a pose explains of a scan.
#[derive(Clone, Copy, Debug)]
pub struct Explained {
    /// Share of the scan's points that lie on the fitted surface and face its way.
    pub pose: f64,
    /// What the next best pose that was tried explains, as such a share, at most `pose`; 0 where none was.
    pub runner_up: f64,
    /// Share of the scan's points that lie where the model stores nothing.
    pub outside: f64,
    /// How exactly the points counted by `pose` lie on the surface ([`Registration::exactness`]); none without any.
    pub exactness: Option<f64>,
    /// Root mean square of the shape's weights, standard deviations.
    pub weight_norm: f64,
}

impl From<&Registration> for Explained {
    fn from(found: &Registration) -> Self {
        Self {
            pose: found.inliers,
            runner_up: found.runner_up,
            outside: found.outside,
            exactness: (found.inliers > 0.0).then_some(found.exactness),
            weight_norm: weight_norm(found.shape.iter().map(|&weight| f64::from(weight))),
        }
    }
}

impl Explained {
    /// What is to be said about it.
    pub fn findings(self) -> impl Iterator<Item = Finding> {
        [self.of_all(), self.near_the_model(), self.ambiguous(), self.elsewhere()].into_iter().flatten()
    }

    /// `pose` as a share of the points near the model: of those that do not lie where it stores nothing.
    pub fn near(&self) -> f64 {
        self.pose / f64::max(1.0 - self.outside, f64::MIN_POSITIVE)
    }

    /// Whether what the pose explains lies exactly on a usual shape: then the rest of the scan is clutter. (A sphere, of
    /// which a tenth is explained, is followed exactly by a shape three deviations off the class; of half a sphere a quarter
    /// by a usual skull, in one pose as in another.) No rival is known of a pose that is given.
    pub fn is_of_the_class(&self) -> bool {
        let alone = self.runner_up > 0.0 && self.runner_up <= RIVAL * self.pose;
        let least = if alone { EXACT_ALONE } else { EXACT };
        let exact = self.exactness.is_some_and(|exactness| exactness >= least);
        exact && self.weight_norm < UNUSUAL && !self.is_ambiguous()
    }

    fn is_ambiguous(&self) -> bool {
        self.runner_up > AMBIGUOUS * self.pose
    }

    fn of_all(&self) -> Option<Finding> {
        // How large a table is says nothing of what lies on it.
        let fits = self.is_of_the_class() && self.near() >= LEAST;
        let grade = if self.pose < LEAST_OF_ALL && !fits { Grade::Reject } else { Grade::Check };
        let share = percent(self.pose);
        let text =
            format!("only {share} of the scan lies on the fitted shape: another kind of object, or a scene?");
        (self.pose < LITTLE).then_some((grade, text))
    }

    fn near_the_model(&self) -> Option<Finding> {
        let (grade, guess) = if self.is_of_the_class() {
            (Grade::Check, "much of something else (hair, clothes, a table), or another kind of object?")
        } else {
            (Grade::Reject, "another kind of object, or normals that face both ways?")
        };
        let share = percent(self.near());
        let text = format!("the best pose explains only {share} of the scan near the model: {guess}");
        (self.near() < LEAST).then_some((grade, text))
    }

    fn ambiguous(&self) -> Option<Finding> {
        let text = format!(
            "another pose explains {} of the scan, this one {}: the scan does not tell which is right",
            percent(self.runner_up),
            percent(self.pose)
        );
        self.is_ambiguous().then_some((Grade::Check, text))
    }

    fn elsewhere(&self) -> Option<Finding> {
        let text =
            format!("{} of the scan's points lie where the class has no surface", percent(self.outside));
        (self.outside > MOST_OUTSIDE).then_some((Grade::Check, text))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Half of a face from the front.
    const FACE: Explained =
        Explained { pose: 0.98, runner_up: 0.4, outside: 0.01, exactness: Some(0.85), weight_norm: 1.1 };

    fn grades(explained: &Explained) -> Vec<Grade> {
        explained.findings().map(|(grade, _)| grade).collect()
    }

    #[test]
    fn a_face_is_one_and_what_is_odd_is_told() {
        assert_eq!(grades(&FACE), []);
        assert_eq!(grades(&Explained { runner_up: 0.95, ..FACE }), [Grade::Check], "a mug");
        assert_eq!(
            grades(&Explained { pose: 0.33, outside: 0.6, runner_up: 0.1, ..FACE }),
            [Grade::Check],
            "shoulders"
        );
        let table = Explained { pose: 0.07, outside: 0.92, runner_up: 0.02, ..FACE };
        assert_eq!(grades(&table), [Grade::Check; 2], "on a table");
        let large = Explained { pose: 0.02, outside: 0.975, runner_up: 0.01, ..FACE };
        assert_eq!(grades(&large), [Grade::Check; 2], "on a table of more than a square metre");
        assert_eq!(grades(&Explained { exactness: Some(0.6), ..large })[0], Grade::Reject, "a table");
    }

    #[test]
    fn of_what_explains_little_near_the_model_the_exact_and_usual_is_a_face_among_clutter() {
        let scene = Explained { pose: 0.6, runner_up: 0.2, ..FACE };
        assert_eq!(grades(&scene), [Grade::Check], "among hair");
        let of = |exactness, weight_norm| Explained { exactness, weight_norm, ..scene };
        for other in [of(Some(0.65), 1.1), of(None, 1.1), of(Some(0.8), 3.3)] {
            assert_eq!(grades(&other), [Grade::Reject], "hair, or a sphere");
        }
        let with = |runner_up| grades(&Explained { runner_up, ..of(Some(0.72), 1.1) });
        assert_eq!(with(0.36), [Grade::Check], "a face with much hair");
        assert_eq!(with(0.46), [Grade::Reject], "hair alone");
        assert_eq!(with(0.0), [Grade::Reject], "a pose that was given");
        let half_a_sphere = Explained { pose: 0.3, runner_up: 0.29, ..of(Some(0.94), 1.1) };
        assert_eq!(grades(&half_a_sphere), [Grade::Reject, Grade::Check], "an exact fit, as another is");
    }
}
