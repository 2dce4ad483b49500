//! What the core's completion starts from: a rough pose, and as many of the scan's points as a device takes.

use super::depth_rows::DepthScan;
use super::{Error, Options};
use crate::mesh::{Mesh, Point};
use crate::points::{OrientedPoints, PackedPoints, thin_scan, thin_to};
use crate::register::{FEWEST_POINTS, Placed, Registration, centred, refine_hint, register};
use lacuna::cloud::CAPACITY;
use lacuna::corners::Weights;
use lacuna::cube::Cube;
use lacuna::pose_fit::Round;
use lacuna::{Model, Standing, pose_fit, sample};

/// Points are this far apart, voxels; further where there would be more than [`CAPACITY`] of them.
pub const CELL: f64 = 0.5;
/// Least share of the points where the model has something that lie near the shape, in a scan without much clutter.
const CLEAN: f64 = 0.75;

/// What is known of the pose beforehand.
#[derive(Clone, Copy, Debug)]
pub enum GivenPose {
    /// Nothing.
    None,
    /// Roughly: refined from there.
    Rough(Placed),
    /// Exactly, in the frame of the training shapes.
    Exact(Placed),
}

/// Where a scan lies, as far as that is known before its points are chosen.
#[derive(Clone, Debug)]
pub struct Known {
    /// Its place.
    pub placed: Placed,
    /// How well that is known.
    pub hint: pose_fit::Hint,
    /// Pose and shape fitted to the scan from there; none where the pose is exact, or the scan too little for that.
    pub registration: Option<Registration>,
}

/// A thinned scan.
#[derive(Clone)]
pub struct Thinned {
    /// Its points, centred.
    pub points: OrientedPoints,
    /// Share of it that has no points, because it is more than a device takes and lies where the model has nothing.
    pub elsewhere: f64,
    /// Share of it that has no points, because most of it lies beside the shape, as this part does.
    pub clutter: f64,
    /// Where it lies roughly, with the points' centre.
    pub rough: Placed,
}

/// What the core's completion starts from.
pub struct Start {
    /// The scan as a device takes it.
    pub thinned: Thinned,
    /// What is known of its place.
    pub known: Known,
    /// The depth image that the points come from, if they do.
    pub depth: Option<DepthScan>,
}

impl Start {
    /// The scan thinned where it is known to lie.
    pub fn new(model: &Model<'_>, scan: &Mesh, known: Known) -> Self {
        Self { thinned: thinned(model, scan, &known), known, depth: None }
    }

    /// The points as the core takes them.
    pub fn packed(&self) -> PackedPoints {
        self.depth.as_ref().map_or_else(|| self.thinned.points.packed(), |depth| depth.packed.clone())
    }

    /// Rounds in which the core refines the pose.
    pub fn rounds(&self, model: &Model<'_>) -> &'static [Round] {
        self.known.hint.rounds(model)
    }

    /// Whether the pose is not estimated, and no shape with it.
    pub fn is_held(&self, model: &Model<'_>) -> bool {
        self.rounds(model).is_empty()
    }
}

/// Thins the scan in the pose that is given or found.
///
/// # Errors
/// A scan that does not fit the model.
pub fn start(model: &Model<'_>, scan: &Mesh, options: &Options<'_>) -> Result<Start, Error> {
    Ok(Start::new(model, scan, place(model, scan, options)?))
}

/// The pose that is given or found, and the shape with it.
///
/// # Errors
/// A scan that does not fit the model, when its pose is to be found.
pub fn place(model: &Model<'_>, scan: &Mesh, options: &Options<'_>) -> Result<Known, Error> {
    Ok(match options.pose {
        GivenPose::None => Known::found(register(model, scan, options.seed)?),
        GivenPose::Rough(placed) => match refine_hint(model, scan, &placed).ok() {
            Some(settled) if settled.hint() == pose_fit::Hint::Settled => Known::found(settled),
            registration => Known { placed, hint: pose_fit::Hint::Rough, registration },
        },
        GivenPose::Exact(placed) => Known { placed, hint: pose_fit::Hint::Exact, registration: None },
    })
}

impl Known {
    /// A pose that was found, which the core refines.
    pub fn found(found: Registration) -> Self {
        Self { placed: found.placed, hint: found.hint(), registration: Some(found) }
    }

    /// What the next best pose that was tried explains, in terms of what this one does, 0 to 1; 0 where none was.
    pub fn rival(&self) -> f64 {
        let found = self.registration.as_ref();
        found.map_or(0.0, |found| found.runner_up / found.inliers.max(f64::MIN_POSITIVE))
    }
}

/// The scan thinned for a pose. Of one that has more points than a device takes, those that lie where the model has
/// nothing (shoulders, hair) go first: the fit has no use for them, and the others lie closer together. Of one that is
/// mostly clutter, what does not lie near the shape goes too: of the few points that the pose is estimated from on the
/// device, few would be on the shape.
pub fn thinned(model: &Model<'_>, scan: &Mesh, known: &Known) -> Thinned {
    let cell = CELL / f64::from(known.placed.pose.scale);
    let all = thin_scan(scan, cell, |_| true);
    let found = known.registration.as_ref();
    let placed = found.map_or(known.placed, |found| found.placed);
    let supported = |p: &Point| sample::far(model, placed.to_voxels(p)).is_some();
    let shape = found.map(|found| Weights::new(&found.shape));
    let mut surface = shape.as_ref().map(|shape| Cube::new(model, shape));
    let mut belongs =
        |p: &Point| surface.as_mut().is_none_or(|surface| belongs(surface, placed.to_voxels(p)));
    let whole = all.points.len();
    let near: Vec<&Point> = all.points.iter().filter(|p| supported(p)).collect();
    let on_it = near.iter().filter(|p| belongs(p)).count();
    let share = |count: usize| count as f64 / whole.max(1) as f64;
    let cluttered = (on_it as f64) < CLEAN * near.len() as f64;
    // With fewer points on the model the pose is wrong: all are kept, so that the fit can tell.
    let (points, elsewhere, clutter) = if cluttered && on_it >= FEWEST_POINTS {
        let kept = thin_to(scan, cell, CAPACITY, |p| supported(p) && belongs(p));
        (kept, 1.0 - share(near.len()), share(near.len() - on_it))
    } else if whole > CAPACITY && near.len() >= FEWEST_POINTS {
        (thin_to(scan, cell, CAPACITY, supported), 1.0 - share(near.len()), 0.0)
    } else if whole > CAPACITY {
        (thin_to(scan, cell, CAPACITY, |_| true), 0.0, 0.0)
    } else {
        (all, 0.0, 0.0)
    };
    let (centre, points) = centred(&points);
    Thinned { points, elsewhere, clutter, rough: known.placed.about(centre) }
}

/// Whether a place lies near the shape that was fitted with the pose. What is farther is clutter: the core leaves it out of
/// the hull, too, but takes the pose from it.
fn belongs(surface: &mut Cube<'_, '_>, place: [f32; 3]) -> bool {
    let model = surface.model();
    let sample = surface.find(place).map(Cube::distance);
    // Of clutter no normal is asked for.
    sample.is_some_and(|sample| Standing::from_sample(model, sample, [0.0; 3]) != Standing::Clutter)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::distance::Surface;
    use crate::synth::{Head, Surrounding};
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
        let exactly = |placed| Known { placed, hint: pose_fit::Hint::Exact, registration: None };
        let kept = thinned(&model, &scan, &exactly(beside(&model, 0.0)));
        assert!(kept.points.points.len() <= CAPACITY && kept.elsewhere > 0.5, "{}", kept.elsewhere);
        let surface = Surface::new(&head).expect("a surface");
        let near = |p: &&Point| {
            let place = Point::from(p.coords + kept.rough.centre.coords);
            surface.distance(&place, 40.0).is_some()
        };
        let on_head = kept.points.points.iter().filter(near).count();
        assert!(on_head * 10 > kept.points.points.len() * 9, "{on_head} of {}", kept.points.points.len());
        assert_eq!(kept.clutter, 0.0, "a pose that is given is not looked into");
        let far = thinned(&model, &scan, &exactly(beside(&model, 900.0)));
        assert!(far.elsewhere == 0.0 && far.points.points.len() > CAPACITY / 2);
    }

    #[test]
    fn of_a_scan_that_is_mostly_clutter_the_points_on_the_shape_are_kept() {
        let model = Model::from_bytes(lacuna_fixtures::MODEL).expect("the built-in model");
        let head = Head::sample(1, 1001).mesh();
        let mut scan = head.clone();
        let bounds = head.bounds().expect("a head");
        let things = [Surrounding::Hair, Surrounding::Collar, Surrounding::Table];
        scan.append(&Surrounding::meshes(things, bounds, 1));
        let options = Options { pose: GivenPose::Rough(beside(&model, 2.0)), ..Options::of(&model) };
        let [alone, among] = [&head, &scan].map(|scan| start(&model, scan, &options).expect("a start"));
        let hints = [alone.known.hint, among.known.hint];
        assert_eq!(hints, [pose_fit::Hint::Rough, pose_fit::Hint::Settled], "clutter would mislead the fit");
        let (alone, among) = (alone.thinned, among.thinned);
        assert_eq!(alone.clutter, 0.0);
        let near = 1.0 - among.elsewhere;
        assert!(among.clutter > 0.25 * near, "{} of {near}", among.clutter);
        let surface = Surface::new(&head).expect("a surface");
        let centre = among.rough.centre.coords;
        let on_head = |p: &&Point| surface.distance(&(*p + centre), 20.0).is_some();
        let (count, on_head) =
            (among.points.points.len(), among.points.points.iter().filter(on_head).count());
        assert!(on_head * 10 > count * 9, "{on_head} of {count}");
        assert!(count * 10 > alone.points.points.len() * 9, "{count} of {}", alone.points.points.len());
    }
}
