//! Explicit surfaces: extracting them from signed distances, their connectivity, refining them.

mod carry;
mod cases;
mod cluster;
mod components;
mod fairing;
mod geodesic;
mod holes;
mod marching_cubes;
mod neighbours;
mod opening;
mod quadric;
mod rim;
mod signs;
mod specks;
mod topology;

pub use carry::{carry, carry_next_to_known};
pub use cluster::clustered;
pub use components::{components, keep, keep_triangles, largest_component, pieces};
pub use fairing::fair;
pub use geodesic::path_lengths;
pub use holes::{close_holes, open_curves};
pub use marching_cubes::{CLAMP, Volume, marching_cubes};
pub use neighbours::corner_pairs;
pub use opening::open_rim;
pub use quadric::{Moments, Quadric};
pub use rim::trim_rim;
pub use specks::specks;
pub use topology::{Edge, Edges, boundary_edges, is_manifold};

#[cfg(test)]
pub(crate) mod shapes;
