//! The host side of Lacuna: files, training, registration, completion, pictures.
//!
//! Data flows one way: scan → pose → hull → global fit → local fit → surface.

// Tests compute what they expect as they like.
#![cfg_attr(test, allow(clippy::disallowed_methods))]

pub mod bvh;
pub mod check;
pub mod class;
pub mod cli;
pub mod complete;
pub mod correspondence;
pub mod cubes;
pub mod depth_view;
pub mod device;
pub mod distance;
pub mod evaluate;
pub mod fit;
pub mod io;
pub mod mesh;
pub mod modes;
pub mod normals;
pub mod picks;
pub mod points;
pub mod quantile;
pub mod raster;
pub mod reference;
pub mod register;
pub mod render;
pub mod report;
pub mod score;
pub mod sentence;
pub mod similarity;
pub mod size;
pub mod surface;
pub mod synth;
pub mod train;
pub mod uncertainty;
pub mod unit;
pub mod verify;
pub mod volume;
