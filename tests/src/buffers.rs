//! A fit in exactly the memory that is lent, as firmware runs it.

use crate::in_voxels;
use lacuna::error::Buffer;
use lacuna::{Arithmetic, hull::Hull};
use lacuna::{
    Error, Fixed, GlobalFit, HullBuilder, LocalFit, Model, Pose, Reach, Schedule, Sizes, Workspace,
};
use lacuna_host::points::OrientedPoints;

/// All buffers of a fit, in fixed point.
pub struct Lent {
    /// Hull targets.
    pub targets: Vec<i16>,
    /// Residuals; first the hull's keys.
    pub residuals: Vec<i16>,
    /// Normal equations.
    pub normal: Vec<f64>,
    /// Sums over a brick.
    pub block: Vec<i32>,
    /// Global weights.
    pub global: Vec<f64>,
    weights: Vec<i16>,
    previous: Vec<i16>,
    gradient: Vec<i32>,
    dense: Vec<i32>,
    reciprocals: Vec<<Fixed as Arithmetic>::Reciprocal>,
    nodes: Vec<u32>,
    cell: Vec<i32>,
}

impl Lent {
    /// As many elements as `sizes` asks for.
    pub fn new(sizes: &Sizes) -> Self {
        Self {
            targets: vec![0; sizes.targets],
            residuals: vec![0; sizes.residuals],
            normal: vec![0.0; sizes.normal],
            block: vec![0; sizes.block],
            global: vec![0.0; sizes.global],
            weights: vec![0; sizes.weights],
            previous: vec![0; sizes.previous],
            gradient: vec![0; sizes.gradient],
            dense: vec![0; sizes.dense],
            reciprocals: vec![Default::default(); sizes.reciprocals],
            nodes: vec![0; sizes.nodes],
            cell: vec![0; sizes.cell],
        }
    }

    /// The local fit's part.
    pub fn workspace(&mut self) -> Workspace<'_, Fixed> {
        Workspace {
            weights: &mut self.weights,
            previous: &mut self.previous,
            residuals: &mut self.residuals,
            gradient: &mut self.gradient,
            dense: &mut self.dense,
            reciprocals: &mut self.reciprocals,
            nodes: &mut self.nodes,
            cell: &mut self.cell,
        }
    }

    /// Bytes of all buffers.
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.targets)
            + size_of_val(&*self.residuals)
            + size_of_val(&*self.normal)
            + size_of_val(&*self.block)
            + size_of_val(&*self.global)
            + size_of_val(&*self.weights)
            + size_of_val(&*self.previous)
            + size_of_val(&*self.gradient)
            + size_of_val(&*self.dense)
            + size_of_val(&*self.reciprocals)
            + size_of_val(&*self.nodes)
            + size_of_val(&*self.cell)
    }

    /// Takes the last element of a buffer away.
    pub fn shorten(&mut self, buffer: Buffer) {
        match buffer {
            Buffer::Targets => drop(self.targets.pop()),
            Buffer::Keys | Buffer::Residuals => drop(self.residuals.pop()),
            Buffer::Normal => drop(self.normal.pop()),
            Buffer::Block => drop(self.block.pop()),
            Buffer::Weights => drop(self.global.pop()),
            Buffer::NodeWeights => drop(self.weights.pop()),
            Buffer::Previous => drop(self.previous.pop()),
            Buffer::Gradient => drop(self.gradient.pop()),
            Buffer::Dense => drop(self.dense.pop()),
            Buffer::Reciprocals => drop(self.reciprocals.pop()),
            Buffer::Nodes => drop(self.nodes.pop()),
            Buffer::Cell => drop(self.cell.pop()),
        }
    }

    /// Hull of the points and the global weights.
    ///
    /// # Errors
    /// A buffer that is too small.
    pub fn global(&mut self, model: &Model<'_>, points: &OrientedPoints, pose: &Pose) -> Result<(), Error> {
        let reach = Reach::of(model);
        let mut builder = HullBuilder::new(model, reach, &mut self.targets, &mut self.residuals)?;
        for (point, normal) in in_voxels(points, pose) {
            builder.add(point, normal);
        }
        let hull = builder.finish();
        GlobalFit::new(model, hull, None, &mut self.normal, &mut self.block, &mut self.global)?.run();
        Ok(())
    }

    /// The local fit of the hull from the global weights: digest of the node weights.
    ///
    /// # Errors
    /// A buffer that is too small.
    pub fn local(&mut self, model: &Model<'_>, schedule: Schedule<'_>) -> Result<u32, Error> {
        let (targets, global) = (self.targets.clone(), self.global.clone());
        let hull = Hull::new(&targets);
        let mut fit = LocalFit::new(model, hull, &global, schedule, self.workspace())?;
        fit.run();
        Ok(fit.digest())
    }
}
