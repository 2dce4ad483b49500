//! What the core's completion starts from: a rough pose, and as many of the scan's points as a device takes.

use super::depth_rows::DepthScan;
use super::{Error, Options};
use crate::mesh::{Mesh, Point};
use crate::points::{OrientedPoints, PackedPoints, thin_scan, thin_to};
use crate::register::{Placed, centred, refine_hint, register};
use lacuna::cloud::CAPACITY;
use lacuna::{Model, pose_fit, sample};

/// Points are this far apart, voxels; further where there would be more than [`CAPACITY`] of them.
pub const CELL: f64 = 0.5;
/// With fewer points than this on the model the pose is wrong: all are kept, so that the fit can tell.
const FEWEST: usize = 60;

/// What is known of the pose beforehand.
#[derive(Clone, Copy, Debug)]
pub enum Hint {
    /// Nothing.
    None,
    /// Roughly: refined from there.
    Rough(Placed),
    /// Exactly, in the frame of the training shapes.
    Exact(Placed),
}

/// What the core's completion starts from.
pub struct Start {
    /// Thinned points, centred.
    pub points: OrientedPoints,
    /// Share of the scan that has no points, because it is more than a device takes and lies where the model has nothing.
    pub elsewhere: f64,
    /// Where the scan lies roughly, with the points' centre.
    pub rough: Placed,
    /// How well that is known.
    pub hint: pose_fit::Hint,
    /// Inlier share of the next best pose that was tried.
    pub runner_up: f64,
    /// The depth image that the points come from, if they do.
    pub depth: Option<DepthScan>,
}

impl Start {
    /// The points as the core takes them.
    pub fn packed(&self) -> PackedPoints {
        self.depth.as_ref().map_or_else(|| self.points.packed(), |depth| depth.packed.clone())
    }

    /// Takes the points anew from a scan.
    pub fn thin(&mut self, model: &Model<'_>, scan: &Mesh) {
        let Thinned { points, elsewhere, rough } = thinned(model, scan, &self.rough, self.hint);
        (self.points, self.elsewhere, self.rough) = (points, elsewhere, rough);
    }
}

/// Thins the scan in the pose that is given or found.
///
/// # Errors
/// A scan that does not fit the model.
pub fn start(model: &Model<'_>, scan: &Mesh, options: &Options<'_>) -> Result<Start, Error> {
    let (known, hint, runner_up) = place(model, scan, options)?;
    let Thinned { points, elsewhere, rough } = thinned(model, scan, &known, hint);
    Ok(Start { points, elsewhere, rough, hint, runner_up, depth: None })
}

/// The pose that is given or found, how well it is known, and the inlier share of the next best.
pub fn place(
    model: &Model<'_>,
    scan: &Mesh,
    options: &Options<'_>,
) -> Result<(Placed, pose_fit::Hint, f64), Error> {
    Ok(match options.hint {
        Hint::None => {
            let found = register(model, scan, options.seed)?;
            (found.placed, pose_fit::Hint::Rough, found.runner_up)
        }
        Hint::Rough(hint) => (hint, pose_fit::Hint::Rough, 0.0),
        Hint::Exact(hint) => (hint, pose_fit::Hint::Exact, 0.0),
    })
}

/// A thinned scan.
pub struct Thinned {
    /// Its points, centred.
    pub points: OrientedPoints,
    /// Share of it that has no points.
    pub elsewhere: f64,
    /// Where they lie.
    pub rough: Placed,
}

/// The scan thinned for a pose. Of one that has more points than a device takes, those that lie where the model has
/// nothing (shoulders, hair) go first: the fit has no use for them, and the others lie closer together.
pub fn thinned(model: &Model<'_>, scan: &Mesh, known: &Placed, hint: pose_fit::Hint) -> Thinned {
    let cell = CELL / f64::from(known.pose.scale);
    let all = thin_scan(scan, cell, |_| true);
    let whole = all.points.len();
    let (points, elsewhere) = if whole <= CAPACITY {
        (all, 0.0)
    } else {
        let settled = match hint {
            pose_fit::Hint::Exact => *known,
            pose_fit::Hint::Rough => refine_hint(model, scan, known).map_or(*known, |found| found.placed),
        };
        let place = |p: &Point| settled.to_model(p).coords.map(|c| c as f32).into();
        let supported = |p: &Point| sample::far(model, place(p)).is_some();
        let near = all.points.iter().filter(|p| supported(p)).count();
        if near < FEWEST {
            (thin_to(scan, cell, CAPACITY, |_| true), 0.0)
        } else {
            (thin_to(scan, cell, CAPACITY, supported), 1.0 - near as f64 / whole as f64)
        }
    };
    let (centre, points) = centred(&points);
    Thinned { points, elsewhere, rough: known.about(centre) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::distance::Surface;
    use crate::synth::Head;
    use lacuna::Pose;

    /// The pose in which the heads of the built-in class lie, moved by some voxels.
    fn beside(model: &Model<'_>, voxels: f32) -> Placed {
        let header = model.header();
        let moved = [voxels * header.spacing; 3];
        let pose = Pose::in_frame_of(header, Pose::IDENTITY.rotation, 1.0, moved);
        Placed { centre: Point::origin(), pose }
    }

    #[test]
    fn of_a_large_scan_the_points_on_the_model_are_kept_and_of_one_beside_it_all() {
        let model = Model::from_bytes(lacuna_fixtures::MODEL).expect("the built-in model");
        let head = Head::sample(1, 1001).mesh();
        let mut scan = head.clone();
        // A table of a square metre.
        let first = scan.points.len() as u32;
        let corners = [[-500., -500.], [500., -500.], [500., 500.], [-500., 500.]];
        scan.points.extend(corners.map(|[x, z]| Point::new(x, -150.0, z)));
        scan.triangles.extend([[first, first + 2, first + 1], [first, first + 3, first + 2]]);
        let exact = pose_fit::Hint::Exact;
        let kept = thinned(&model, &scan, &beside(&model, 0.0), exact);
        assert!(kept.points.points.len() <= CAPACITY && kept.elsewhere > 0.5, "{}", kept.elsewhere);
        let surface = Surface::new(&head).expect("a surface");
        let near = |p: &&Point| {
            let place = Point::from(p.coords + kept.rough.centre.coords);
            surface.distance(&place, 40.0).is_some()
        };
        let on_head = kept.points.points.iter().filter(near).count();
        assert!(on_head * 10 > kept.points.points.len() * 9, "{on_head} of {}", kept.points.points.len());
        let far = thinned(&model, &scan, &beside(&model, 900.0), exact);
        assert!(far.elsewhere == 0.0 && far.points.points.len() > CAPACITY / 2);
    }
}
