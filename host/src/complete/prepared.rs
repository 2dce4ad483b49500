//! What of a scan is fitted, and where it lies: without specks and noise, with those of its small pieces that belong to the
//! shape.

use super::clean::{Cleaned, clean};
use super::noise::Noise;
use super::pieces::belonging;
use super::start::thinned;
use super::{Error, Options, Start, start};
use crate::mesh::Mesh;
use lacuna::Model;

/// A scan that is ready to be fitted.
pub struct Prepared {
    /// The scan as it is used.
    pub scan: Mesh,
    /// Triangles (of a cloud, points) left out of it as specks.
    pub specks: usize,
    /// Its noise, where that was taken out.
    pub noise: Option<Noise>,
    /// What the core starts from.
    pub start: Start,
}

/// A scan in the pose that is given or found.
///
/// # Errors
/// A scan that does not fit the model.
pub fn prepare(model: &Model<'_>, scan: &Mesh, options: &Options<'_>) -> Result<Prepared, Error> {
    prepare_by(model, scan, options, |scan| start(model, scan, options))
}

/// The same from what `begin` makes of the scan without its small pieces.
///
/// # Errors
/// Those of `begin`.
pub fn prepare_by(
    model: &Model<'_>,
    scan: &Mesh,
    options: &Options<'_>,
    begin: impl FnOnce(&Mesh) -> Result<Start, Error>,
) -> Result<Prepared, Error> {
    let cleaned = clean(scan, options.widest(model));
    let start = begin(&cleaned.scan)?;
    Ok(Prepared::new(model, cleaned, start))
}

impl Prepared {
    /// The scan whose place is known from `start`, which was made without the small pieces.
    pub fn new(model: &Model<'_>, cleaned: Cleaned, mut start: Start) -> Self {
        let pieces = belonging(model, &cleaned, &start.known);
        let Cleaned { mut scan, noise, small, .. } = cleaned;
        let specks = small.elements() - pieces.elements();
        if pieces.points.is_empty() {
            return Self { scan, specks, noise, start };
        }
        scan.append(&pieces);
        // The points of a depth image are not those of its mesh, and have all pieces.
        if start.depth.is_none() {
            start.thinned = thinned(model, &scan, &start.known);
        }
        Self { scan, specks, noise, start }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::complete::start::{Known, Thinned};
    use crate::mesh::Point;
    use crate::points::OrientedPoints;
    use crate::register::Placed;
    use crate::surface::shapes::sheet;
    use lacuna::{Pose, pose_fit};

    #[test]
    fn triangles_of_merged_vertices_are_no_specks() {
        let model = Model::from_bytes(lacuna_fixtures::MODEL).expect("the built-in model");
        // So fine that its vertices are merged, with a triangle far away.
        let mut scan = sheet(150);
        scan.points.iter_mut().for_each(|p| p.coords *= 0.1);
        let triangles = scan.triangles.len();
        scan.append(&Mesh {
            points: [[90.0, 0.0, 0.0], [91.0, 0.0, 0.0], [90.0, 1.0, 0.0]].map(Point::from).into(),
            normals: vec![],
            triangles: vec![[0, 1, 2]],
        });
        let rough = Placed { centre: Point::origin(), pose: Pose::IDENTITY };
        let known = Known { placed: rough, hint: pose_fit::Hint::Exact, registration: None };
        let thinned = Thinned { points: OrientedPoints::default(), elsewhere: 0.0, clutter: 0.0, rough };
        let begin = |_: &Mesh| Ok(Start { thinned, known, depth: None });
        let prepared = prepare_by(&model, &scan, &Options::of(&model), begin).expect("a start");
        assert!(prepared.scan.triangles.len() < triangles / 2, "{}", prepared.scan.triangles.len());
        assert_eq!(prepared.specks, 1);
    }
}
