//! The weight grid of the local fit: a node every q voxels, trilinear weights in between, box means over it.

use super::{Grid, Model};

/// The nodes of a model's grid.
#[derive(Clone, Debug)]
pub struct Nodes {
    /// q: voxels between nodes.
    pub stride: usize,
    /// The dense grid of nodes, one more along each side than cells.
    pub grid: Grid,
    /// Nodes at a corner of a cell that holds a voxel of the mask: only they have weights.
    pub active: Vec<bool>,
}

impl Nodes {
    /// The nodes of a model, `stride` voxels apart.
    pub fn new(model: &Model, stride: usize) -> Self {
        let grid = Grid { sides: model.grid.sides.map(|side| side / stride + 1) };
        let mut nodes = Self { stride, grid, active: vec![false; grid.len()] };
        for voxel in (0..model.grid.len()).filter(|&n| model.mask[n]) {
            let cell = model.grid.position(voxel).map(|v| v / stride);
            for corner in 0..8 {
                nodes.active[grid.index(corner_of(cell, corner))] = true;
            }
        }
        nodes
    }

    /// The eight nodes j around a voxel n with their trilinear weights φ_jn.
    pub fn trilinear(&self, voxel: [usize; 3]) -> [(usize, f64); 8] {
        let cell = voxel.map(|v| v / self.stride);
        let within = voxel.map(|v| (v % self.stride) as f64 / self.stride as f64);
        std::array::from_fn(|corner| {
            let along = |axis: usize| if corner >> axis & 1 == 1 { within[axis] } else { 1.0 - within[axis] };
            (self.grid.index(corner_of(cell, corner)), along(0) * along(1) * along(2))
        })
    }

    /// B: the mean of a field over the box of `radius` nodes around each active node, zero outside the grid
    /// and, because fields are, at inactive nodes.
    pub fn box_mean(&self, field: &[f64], radius: usize) -> Vec<f64> {
        let volume = (2 * radius + 1).pow(3) as f64;
        let mean = |node: usize| {
            let around = self.grid.around(self.grid.position(node), radius);
            around.map(|other| field[self.grid.index(other)]).sum::<f64>() / volume
        };
        (0..self.grid.len()).map(|node| if self.active[node] { mean(node) } else { 0.0 }).collect()
    }
}

/// Corner 0..8 of a cell: bit 0 is x, bit 1 is y, bit 2 is z.
fn corner_of(cell: [usize; 3], corner: usize) -> [usize; 3] {
    std::array::from_fn(|axis| cell[axis] + (corner >> axis & 1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reference::toy;

    #[test]
    fn trilinear_weights_interpolate_a_linear_field_exactly() {
        let nodes = Nodes::new(&toy::model(), 2);
        let value = |[x, y, z]: [usize; 3]| 1.0 + 2.0 * x as f64 - 3.0 * y as f64 + 0.5 * z as f64;
        for voxel in toy::GRID.within([0; 3], [9; 3]) {
            let weights = nodes.trilinear(voxel);
            assert!((weights.iter().map(|s| s.1).sum::<f64>() - 1.0).abs() < 1e-12);
            let found: f64 =
                weights.iter().map(|&(j, f)| f * value(nodes.grid.position(j).map(|v| 2 * v))).sum();
            assert!((found - value(voxel)).abs() < 1e-12);
        }
    }

    #[test]
    fn only_corners_of_occupied_cells_are_active() {
        let mut model = toy::model();
        model.mask = vec![false; toy::GRID.len()];
        model.mask[toy::GRID.index([3, 5, 2])] = true;
        let nodes = Nodes::new(&model, 2);
        let active: Vec<_> = (0..nodes.grid.len()).filter(|&j| nodes.active[j]).collect();
        assert_eq!(active.len(), 8);
        assert_eq!(nodes.grid.position(active[0]), [1, 2, 1]);
    }

    #[test]
    fn a_box_mean_divides_by_the_whole_box() {
        let nodes = Nodes::new(&toy::model(), 2);
        let means = nodes.box_mean(&vec![27.0; nodes.grid.len()], 1);
        assert_eq!(means[nodes.grid.index([0, 0, 0])], 8.0);
        assert_eq!(means[nodes.grid.index([1, 1, 1])], 27.0);
    }
}
