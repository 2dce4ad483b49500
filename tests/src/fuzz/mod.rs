//! Fuzz targets: what each does with arbitrary bytes, and the seeds it starts from.
//!
//! The bodies live here so that three callers share them: `cargo fuzz` (the package in `tests/fuzz`), the replay of
//! cases once found, and the bounded mutation of the seeds that runs with the ordinary tests. A body panics
//! when something is wrong, and for no other reason.

pub mod depth;
pub mod device;
pub mod fit;
pub mod host_end;
pub mod meshes;
pub mod model;
pub mod mutate;
pub mod source;
pub mod surface;
pub mod tiny;

/// A target.
pub struct Target {
    /// Its name: of the `cargo fuzz` target, and of the folders of its corpus and regressions.
    pub name: &'static str,
    /// The body.
    pub run: fn(&[u8]),
    /// Inputs that reach far.
    pub seeds: fn() -> Vec<Vec<u8>>,
}

/// All targets.
pub static TARGETS: [Target; 11] = [
    Target { name: "model", run: model::run, seeds: model::seeds },
    Target { name: "fit", run: fit::run, seeds: fit::seeds },
    Target { name: "device", run: device::run, seeds: device::seeds },
    Target { name: "host_end", run: host_end::run, seeds: host_end::seeds },
    Target { name: "ply", run: meshes::ply, seeds: meshes::ply_seeds },
    Target { name: "obj", run: meshes::obj, seeds: meshes::obj_seeds },
    Target { name: "stl", run: meshes::stl, seeds: meshes::stl_seeds },
    Target { name: "pcd", run: meshes::pcd, seeds: meshes::pcd_seeds },
    Target { name: "xyz", run: meshes::xyz, seeds: meshes::xyz_seeds },
    Target { name: "depth", run: depth::run, seeds: depth::seeds },
    Target { name: "surface", run: surface::run, seeds: surface::seeds },
];
