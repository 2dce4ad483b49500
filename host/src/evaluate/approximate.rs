//! One target approximated by every model of one draw.

use super::digest::digest_of;
use super::whole::{Whole, volume};
use super::{Error, Fitter, Score, Scores, Settings, score};
use crate::correspondence::Correspondence;
use crate::distance::Surface;
use crate::io::{self, PlyOut};
use crate::mesh::{Mesh, Point, Vector};
use crate::points::thin;
use crate::register::{Placed, refine_hint, refine_whole, register};
use crate::surface::{Volume, largest_component, marching_cubes};
use crate::train::prepared::Prepared;
use crate::volume::sample;
use lacuna::Model;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// A model of figure 2.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Approximation {
    /// The local volumetric model.
    Local,
    /// The global volumetric model, least squares in the hull.
    Global,
    /// The global volumetric model, eq. (9) over the whole volume.
    Eq9,
    /// The correspondence model.
    Correspondence,
    /// Marching cubes of the target's own distances: nothing below it means anything.
    Floor,
}

impl std::fmt::Display for Approximation {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Local => "local",
            Self::Global => "global",
            Self::Eq9 => "eq9",
            Self::Correspondence => "correspondence",
            Self::Floor => "floor",
        })
    }
}

/// Where the approximations of a target by the models of a draw are written.
#[derive(Clone, Copy, Debug)]
pub(super) struct Names<'a> {
    pub folder: &'a Path,
    pub count: usize,
    pub draw: usize,
    pub target: &'a str,
}

impl Names<'_> {
    fn path(&self, kind: Approximation) -> PathBuf {
        let Self { folder, count, draw, target } = self;
        folder.join(format!("{count}-{draw}-{target}-{kind}.ply"))
    }

    /// Whether all of them are there: the local one is written last.
    pub fn are_complete(&self) -> bool {
        self.path(Approximation::Local).is_file()
    }
}

/// How targets come to the model.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum PoseMode {
    /// They are in the training shapes' frame already and stay as they are.
    Identity,
    /// They are there roughly: pose, size and shape are found together, for every model.
    Joint,
    /// They are anywhere.
    Search,
}

/// A complete shape to be approximated.
pub struct Target {
    /// Its name.
    pub name: String,
    /// Digest of its vertices.
    pub digest: u32,
    pub(super) mesh: Mesh,
    surface: Surface,
}

impl Target {
    /// Prepares a mesh.
    ///
    /// # Errors
    /// A mesh without area.
    pub fn new(name: &str, mesh: Mesh) -> Result<Self, Error> {
        let surface = Surface::new(&mesh).ok_or_else(|| Error::NoSurface(name.into()))?;
        Ok(Self { name: name.into(), digest: digest_of(&mesh), mesh, surface })
    }
}

/// What one draw trained.
pub struct Models<'a> {
    pub prepared: &'a Prepared,
    pub model: &'a Model<'a>,
    pub fitter: Fitter<'a>,
    pub whole: Option<Whole>,
    pub correspondence: Option<Correspondence>,
}

/// Hull points are this far apart, voxels: a little closer together than for completions.
const HULL_CELL: f64 = 0.4;

impl Models<'_> {
    /// Approximates a target by every model. With `surfaces` all approximations are written there as PLY.
    pub fn scores(
        &self,
        target: &Target,
        settings: &Settings,
        surfaces: Option<Names<'_>>,
    ) -> Result<Scores, Error> {
        let found = self.approximations(target, settings)?;
        let mut scores = Scores::new();
        for (kind, surface) in &found {
            let score: Option<Score> = score(surface, &target.surface);
            scores.insert(*kind, score.ok_or_else(|| Error::NoResult(target.name.clone(), *kind))?);
        }
        if let Some(names) = surfaces {
            // The first one last: where it is, all are.
            for (kind, surface) in found.iter().rev() {
                io::write_ply(&names.path(*kind), &PlyOut::new(surface))?;
            }
        }
        Ok(scores)
    }

    fn approximations(
        &self,
        target: &Target,
        settings: &Settings,
    ) -> Result<Vec<(Approximation, Mesh)>, Error> {
        let placed = self.place(target, settings)?;
        let fields = self.fit(target, &placed)?;
        let mut found = vec![
            (Approximation::Local, self.surface(&fields.local, &placed)),
            (Approximation::Global, self.surface(&fields.global, &placed)),
        ];
        if let Some(whole) = &self.whole {
            let distances = self.distances(target, &placed)?;
            found.push((Approximation::Eq9, self.surface(&whole.approximate(&distances), &placed)));
            found.push((Approximation::Floor, self.surface(&whole.at_stored(&distances), &placed)));
        }
        let moving = settings.pose != PoseMode::Identity;
        let corresponding = |model: &Correspondence| model.approximate(&target.mesh, moving).ok();
        if let Some(mesh) = self.correspondence.as_ref().and_then(corresponding) {
            found.push((Approximation::Correspondence, mesh));
        }
        Ok(found)
    }

    /// Where the target lies in the model.
    fn place(&self, target: &Target, settings: &Settings) -> Result<Placed, Error> {
        let still = Placed::identity(self.model);
        let found = match settings.pose {
            PoseMode::Identity => return Ok(still),
            PoseMode::Joint => refine_hint(self.model, &target.mesh, &still),
            PoseMode::Search => register(self.model, &target.mesh, settings.seed),
        };
        let found = found.and_then(|found| refine_whole(self.model, &target.mesh, &found.placed));
        let found = found.map_err(|error| Error::Register(target.name.clone(), error))?;
        Ok(found.placed)
    }

    fn fit(&self, target: &Target, placed: &Placed) -> Result<super::Fields, Error> {
        let mut points = thin(&target.mesh, HULL_CELL / f64::from(placed.pose.scale));
        points.points.iter_mut().for_each(|p| *p -= placed.centre.coords);
        self.fitter.fit(&points, &placed.pose).map_err(|error| Error::Fit(target.name.clone(), error))
    }

    /// The target's own distances over the model's grid, voxels.
    fn distances(&self, target: &Target, placed: &Placed) -> Result<Vec<f64>, Error> {
        let header = self.model.header();
        let origin = Vector::from(header.origin.map(f64::from));
        let mut moved = target.mesh.clone();
        for point in &mut moved.points {
            *point = Point::from(placed.to_model(point).coords * f64::from(header.spacing) + origin);
        }
        let surface = Surface::new(&moved).ok_or_else(|| Error::NoSurface(target.name.clone()))?;
        let measured = sample(&surface, self.prepared.lattice(), self.prepared.places());
        Ok(volume(self.prepared, &measured, self.model))
    }

    /// The zero level within the stored voxels, in the target's frame.
    fn surface(&self, values: &[f32], placed: &Placed) -> Mesh {
        let dims = self.model.grid().sides().map(usize::from);
        let mut mesh = largest_component(&marching_cubes(&Volume { dims, values }, &Point::origin(), 1.0));
        mesh.points.iter_mut().for_each(|p| *p = placed.to_scan(p));
        mesh
    }
}
