//! Shapes whose distances are measured: models of all of them, or of some, without measuring again.

use super::grid::Budget;
use super::{Distances, Error, Plan, Settings, pca};
use crate::mesh::Mesh;
use crate::volume::{Lattice, Volume};
use lacuna::format::MAX_MODES;
use rayon::prelude::*;
use std::sync::atomic::{AtomicU64, Ordering};

/// Training shapes with their distances on one grid.
pub struct Prepared {
    plan: Plan,
    settings: Settings,
    /// Voxels whose distances are measured, ascending.
    places: Vec<u32>,
    volumes: Vec<Volume>,
}

impl Prepared {
    /// Measures the distances of aligned shapes. `margin` is 0 for the model of all shapes. Models of some of
    /// them have other bands: with 0 they are cut at that of all, 3 standard deviations more hold nearly all of theirs.
    ///
    /// # Errors
    /// Shapes that cannot make a model; see [`Error`].
    pub fn new(
        shapes: &[Mesh],
        settings: &Settings,
        margin: f64,
        progress: &(dyn Fn(u64, u64) + Sync),
    ) -> Result<Self, Error> {
        if shapes.len() < 2 {
            return Err(Error::TooFew(shapes.len()));
        }
        let plan = Plan::new(shapes, settings)?;
        let places = plan.candidates(margin);
        let sight = if plan.distances == Distances::Sight { plan.lattice.len() } else { 0 };
        Budget::new(shapes, settings).check_voxels(places.len(), sight)?;
        let total = shapes.len() as u64;
        let done = AtomicU64::new(0);
        let volumes = plan
            .surfaces
            .par_iter()
            .zip(shapes)
            .map(|(surface, shape)| {
                let volume = plan.measure(surface, shape, &plan.lattice, &places);
                progress(done.fetch_add(1, Ordering::Relaxed) + 1, total);
                volume
            })
            .collect();
        Ok(Self { plan, settings: settings.clone(), places, volumes })
    }

    /// The grid the distances are measured on.
    pub fn lattice(&self) -> &Lattice {
        &self.plan.lattice
    }

    /// The voxels whose distances are measured, ascending.
    pub fn places(&self) -> &[u32] {
        &self.places
    }

    /// Distances of one shape at [`Self::places`].
    pub fn volume(&self, shape: usize) -> &Volume {
        &self.volumes[shape]
    }

    /// Voxels between the nodes of the weight field.
    pub(super) const fn stride(&self) -> u8 {
        self.plan.stride()
    }

    /// Models keep at most this many modes from now on.
    pub(super) const fn keep_modes(&mut self, modes: usize) {
        self.settings.modes = Some(modes);
    }

    /// Trains on all shapes: the model file.
    ///
    /// # Errors
    /// As [`Self::model`].
    pub fn model_of_all(&self) -> Result<Vec<u8>, Error> {
        self.model(&(0..self.volumes.len()).collect::<Vec<_>>())
    }

    /// Trains on the shapes with these numbers: the model file.
    ///
    /// # Errors
    /// Shapes that cannot make a model; see [`Error`].
    pub fn model(&self, members: &[usize]) -> Result<Vec<u8>, Error> {
        if members.len() < 2 {
            return Err(Error::TooFew(members.len()));
        }
        let volumes: Vec<&Volume> = members.iter().map(|&m| &self.volumes[m]).collect();
        let band = self.plan.band(&volumes);
        if band.is_empty() {
            return Err(Error::NoBand);
        }
        let spacing = self.plan.lattice.spacing as f32;
        let column = |v: &&Volume| band.iter().map(|&i| v.distances[i] / spacing).collect();
        let columns: Vec<Vec<f32>> = volumes.iter().map(column).collect();
        let most = self.settings.modes.unwrap_or(usize::MAX).min(usize::from(MAX_MODES));
        let pca = pca::pca(&columns, most);
        if pca.modes.is_empty() {
            return Err(Error::NoVariation);
        }
        let voxels: Vec<u32> = band.iter().map(|&i| self.places[i]).collect();
        let surfaces: Vec<_> = members.iter().map(|&m| &self.plan.surfaces[m]).collect();
        self.plan.encode(&self.settings, &voxels, pca, &surfaces)
    }
}
