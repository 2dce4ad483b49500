//! Everything but `on_target`, in one program: one to link instead of thirty, and its tests keep all processors busy.
//! `cargo test --release --test suite quality` runs those of one file.

mod behind;
mod cli;
mod cli_check;
mod cli_device;
mod cli_errors;
mod clutter;
mod device_limits;
mod doubt;
mod evaluate;
mod exact_pose;
mod fuzz_regressions;
mod golden;
mod kill;
mod layers;
mod memory;
mod model;
mod nasty;
mod other_objects;
mod parts;
mod pieces;
mod properties;
mod quality;
mod readme;
mod rebuild;
mod register;
mod report;
mod rough_pose;
mod seam;
mod symmetry;
mod training;
mod training_checks;
mod uncertainty;
mod versions;
mod wire;
