//! The global model over the whole volume, where eq. (9) gives its weights in closed form.
//!
//! Near the surface distances are exact; farther off they are propagated from there (FH04 in section 3.2).

use crate::mesh::Vector;
use crate::reference::{Model as Reference, global, pca};
use crate::train::prepared::Prepared;
use crate::train::propagate::propagate;
use crate::verify::decode;
use crate::volume::{Lattice, Volume};
use lacuna::Model;
use rayon::prelude::*;

/// A model of the whole box around the stored voxels.
pub struct Whole {
    model: Reference,
    /// Voxels the model file stores.
    stored: Vec<bool>,
}

impl Whole {
    /// Trains on the shapes with these numbers, over the grid of their model file.
    pub fn train(prepared: &Prepared, members: &[usize], model: &Model<'_>) -> Self {
        let one = |&member: &usize| volume(prepared, prepared.volume(member), model);
        let volumes: Vec<Vec<f64>> = members.par_iter().map(one).collect();
        let grid = decode::grid(model);
        let mut stored = vec![false; grid.len()];
        decode::places(model).into_iter().for_each(|place| stored[place] = true);
        Self { model: pca::pca(grid, &volumes, vec![true; grid.len()], members.len()), stored }
    }

    /// The approximation of a complete volume by eqs. (8) and (9), at the stored voxels.
    pub fn approximate(&self, volume: &[f64]) -> Vec<f32> {
        let weights = self.model.sigmas(&global::project(&self.model, volume));
        self.at_stored(&self.model.synthesise(&weights))
    }

    /// A volume as the model file would store it: NaN elsewhere.
    pub fn at_stored(&self, volume: &[f64]) -> Vec<f32> {
        let pair = |(&d, &stored): (&f64, &bool)| if stored { d as f32 } else { f32::NAN };
        volume.iter().zip(&self.stored).map(pair).collect()
    }
}

/// Distances measured at [`Prepared::places`] as a whole volume over the model's grid, voxels.
pub fn volume(prepared: &Prepared, measured: &Volume, model: &Model<'_>) -> Vec<f64> {
    let lattice = prepared.lattice();
    let values = filled(lattice, prepared.places(), measured);
    let header = model.header();
    let corner = Vector::from(header.origin.map(f64::from)) - lattice.origin.coords;
    let corner: [usize; 3] = (corner / lattice.spacing).map(|c| c.round().max(0.0) as usize).into();
    let grid = decode::grid(model);
    let place = |n: usize| {
        let within = grid.position(n);
        // The model's bricks may reach over the edge of the lattice by part of a brick.
        lattice.index(std::array::from_fn(|a| (corner[a] + within[a]).min(lattice.sides[a] - 1)))
    };
    (0..grid.len()).map(|n| f64::from(values[place(n)])).collect()
}

fn filled(lattice: &Lattice, places: &[u32], measured: &Volume) -> Vec<f32> {
    let spacing = lattice.spacing as f32;
    let mut values = vec![f32::NAN; lattice.len()];
    let known = || places.iter().zip(&measured.distances).map(|(&place, &d)| (place as usize, d / spacing));
    // Only the layer at the surface is a source: from farther off the transform would take short cuts.
    for ((place, distance), &border) in known().zip(&measured.border) {
        if distance.abs() <= 1.0 && !border {
            values[place] = distance;
        }
    }
    propagate(&mut values, lattice.sides);
    known().for_each(|(place, distance)| values[place] = distance);
    values
}
