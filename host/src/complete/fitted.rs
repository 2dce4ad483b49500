//! What the core's fit says about the scan's points, and the surface that is drawn from it to the scan.

use super::behind::{self, Deep};
use super::cues::cues;
use super::dense::Dense;
use super::extrapolate::{self, extrapolated};
use super::merge::Merged;
use super::start::Start;
use super::support::Support;
use super::{diffusion, level};
use crate::distance::Surface;
use crate::fit::Fit;
use crate::mesh::{Mesh, Point, Vector};
use crate::points::OrientedPoints;
use crate::register::{Placed, joint};
use crate::uncertainty::coarse::Coarse;
use crate::uncertainty::posterior::Posterior;
use crate::uncertainty::{Cue, hidden};
use lacuna::corners::Weights;
use lacuna::cube::Cube;
use lacuna::pose_row::steepness;
use lacuna::{Model, Standing};

/// How far from the scan its own distances are looked up, voxels.
const OWN_REACH: f64 = 2.0;

/// A point that lies farther inside the fitted surface than this is drawn to, class millimetres.
const DEEP: f32 = 4.0;

/// What the core's fit says about the scan's points.
pub struct Fitted<'m> {
    /// Where the scan lies.
    pub placed: Placed,
    /// The points, centred.
    all: OrientedPoints,
    /// Those that the core did not leave out.
    points: OrientedPoints,
    /// Weights of the shape that was found with the pose; those of the global fit where the pose was held.
    shape: Vec<f32>,
    /// Distances of the global fit.
    pub global: Dense,
    /// Distances of the local fit.
    pub local: Dense,
    /// What the points leave undecided; none where none of them lies on the model.
    pub posterior: Option<Posterior<'m>>,
}

impl<'m> Fitted<'m> {
    /// From a start and what the core made of it.
    pub fn new(model: &'m Model<'m>, start: &Start, fit: &Fit) -> Self {
        let placed = Placed { centre: start.thinned.rough.centre, pose: fit.outcome.pose };
        let points = without_clutter(model, start, fit);
        let held = start.is_held(model);
        let shape =
            if held { fit.global.iter().map(|&weight| weight as f32).collect() } else { fit.shape.clone() };
        let posterior = Posterior::new(model, &points, &placed.pose, &shape, !held);
        let [global, local] =
            [&fit.global_distances, &fit.local_distances].map(|distances| extrapolated(model, distances));
        let all = start.thinned.points.clone();
        Self { placed, all, points, shape, global, local, posterior }
    }

    /// The pose of the centred points.
    fn centred(&self) -> Placed {
        Placed { centre: Point::origin(), ..self.placed }
    }

    /// The local fit's distances: without what diverged, with the volume to be expected where nobody looked, no
    /// farther from the fits than these support, and the scan's own beyond what the model stores.
    pub fn drawn_to(&self, model: &Model<'_>, scan: &Surface, support: &Support) -> Dense {
        let (mut drawn, centred) = (self.local.clone(), self.centred());
        let behind = self.behind(model);
        let voxels = self.points.points.iter().map(|p| centred.to_model(p));
        let voxels: Vec<Point> = voxels.chain(behind.iter().map(|deep| deep.place)).collect();
        let near = OWN_REACH / f64::from(self.placed.pose.scale);
        // A voxel hears of the nodes around it, and they reach as far again.
        let reach = 2 * usize::from(model.header().stride);
        let own = |i: usize| self.global.measured(i, scan, &self.placed, near);
        let measured = diffusion::diffuse(&mut drawn, &self.global, &voxels, reach, &behind, own);
        if let Some(posterior) = &self.posterior {
            let deviations = level::deviations(&drawn, posterior);
            level::level(&mut drawn, &deviations, &measured);
            let millimetre = f64::from(model.header().scales.millimetre);
            support.limit(&mut drawn, &deviations, &measured, &self.placed, millimetre);
        }
        extrapolate::extend(&mut drawn, model, scan, &self.placed, &voxels);
        drawn
    }

    /// The points deep behind the fitted surface. Some of them the core leaves out, as if they were clutter.
    fn behind(&self, model: &Model<'_>) -> Vec<Deep> {
        let centred = self.centred();
        let voxels = |(p, n): (&Point, &Vector)| {
            let normal = centred.pose.rotate(n.map(|c| c as f32).into());
            (centred.to_model(p), Vector::from(normal.map(f64::from)))
        };
        let points: Vec<(Point, Vector)> =
            self.all.points.iter().zip(&self.all.normals).map(voxels).collect();
        let deep = f64::from(DEEP * model.header().scales.millimetre);
        behind::deep_points([&self.global, &self.local], &points, deep)
    }

    /// What is known at each vertex of the completed mesh about its error, where views of the scan are so many of its units
    /// apart.
    pub fn cues(
        &self,
        model: &Model<'_>,
        scan: &Mesh,
        (layers, sideways): (Option<f64>, Option<f64>),
        merged: &Merged,
    ) -> Vec<Cue> {
        let Some(posterior) = &self.posterior else { return vec![] };
        let unit = self.placed.class_millimetre(model);
        let layers = layers.map(|apart| apart / unit);
        let views = hidden::error(&self.points.normals, layers) * model.header().scales.millimetre;
        let (coarse, scale) = (Coarse::of(scan, unit), self.placed.pose.scale);
        let hidden = |place: &Point| libm::hypotf(views, coarse.error(place) as f32 * scale);
        cues(posterior, &self.placed, merged, &hidden, sideways.unwrap_or(0.0) as f32)
    }

    /// How the points, of `all` in the scan, lie on the surface of the local fit.
    pub fn agreement(&self, model: &Model<'_>, all: usize) -> Agreement {
        let (reach, centred) = (2.0 * f64::from(model.header().scales.millimetre), self.centred());
        let (mut near, mut inliers, mut squares) = (0usize, 0usize, 0.0);
        for point in &self.points.points {
            if let Some((d, gradient)) = self.local.at(&centred.to_model(point)) {
                near += 1;
                let r = d / f64::from(steepness(gradient.map(|c| c as f32).into()));
                if r.abs() <= reach {
                    inliers += 1;
                    squares += r * r;
                }
            }
        }
        Agreement {
            inliers: inliers as f64 / near.max(1) as f64,
            rms: (squares / inliers.max(1) as f64).sqrt(),
            outside: (self.points.points.len() - near) as f64 / all.max(1) as f64,
        }
    }

    /// Share of the points of a start that lie on the surface of `shape`, and how exactly these do; none without any.
    pub fn explained(&self, model: &Model<'_>, start: &Start) -> (f64, Option<f64>) {
        let packed = start.packed();
        let Ok(cloud) = packed.cloud() else { return (0.0, None) };
        let (inliers, agreement) =
            joint::agreement(model, cloud, &self.placed.pose, &Weights::new(&self.shape));
        (inliers, (inliers > 0.0).then(|| agreement / inliers))
    }
}

/// How the points lie on the fitted surface.
pub struct Agreement {
    /// Share of the points near the model, clutter aside, that are within two class millimetres.
    pub inliers: f64,
    /// Their root mean square distance, voxels.
    pub rms: f64,
    /// Share of all points, clutter among them, that lie where the model stores nothing.
    pub outside: f64,
}

/// The points that the core did not leave out.
fn without_clutter(model: &Model<'_>, start: &Start, fit: &Fit) -> OrientedPoints {
    if start.is_held(model) {
        return start.thinned.points.clone();
    }
    let packed = start.packed();
    let cloud = packed.cloud();
    let (pose, shape) = (&fit.outcome.pose, Weights::new(&fit.shape));
    let mut cube = Cube::new(model, &shape);
    let kept = |&i: &usize| {
        let Ok(Some((p, n))) = cloud.map(|cloud| cloud.point(i)) else { return false };
        let sample = cube.find(pose.apply(p)).map(Cube::distance);
        sample.is_none_or(|sample| Standing::from_sample(model, sample, pose.rotate(n)) != Standing::Clutter)
    };
    let kept: Vec<usize> = (0..start.thinned.points.points.len()).filter(kept).collect();
    start.thinned.points.chosen(&kept)
}

#[cfg(test)]
mod tests {
    use super::super::measured::scan_surface;
    use super::super::{Options, fit_here, prepare, zero_level};
    use super::*;
    use crate::io::{Format, parse_noted};
    use lacuna::Fixed;

    #[test]
    fn what_is_drawn_ends_near_the_fits_where_nothing_was_measured() {
        let model = Model::from_bytes(lacuna_fixtures::MODEL).expect("the built-in model");
        let scan = parse_noted(Format::Ply, lacuna_fixtures::SCAN).expect("the example").mesh;
        let options = Options::of(&model);
        let prepared = prepare(&model, &scan, &options).expect("a start");
        let fit = fit_here::<Fixed>(&model, &prepared.start, options.schedule).expect("a fit");
        let fitted = Fitted::new(&model, &prepared.start, &fit);
        let measured = scan_surface(&prepared.scan, &model).expect("a surface").surface;

        let seen = zero_level::surface(&fitted.local, &fitted.placed, 1);
        let area = |seen: &Mesh| {
            let support = Support::of([seen, &Mesh::default()]);
            let drawn = fitted.drawn_to(&model, &measured, &support);
            zero_level::surface(&drawn, &fitted.placed, 1).area()
        };
        let mut apart = crate::surface::shapes::sheet(9);
        let far = seen.bounds().expect("points").1 * 3.0;
        apart.points.iter_mut().for_each(|p| *p += far.coords);
        let (all, without) = (area(&seen), area(&apart));
        // The other half of the head.
        assert!(without < 0.8 * all && without > 0.3 * all, "{without} of {all}");
    }
}
