//! Asks the model how much memory its fit needs, so that every buffer is a static of the right size.
//!
//! `LACUNA_MODEL` links another model than the built-in one, `LACUNA_CLOUD` another scan than the example
//! (as `lacuna register --pack` writes it).

use lacuna::{Model, Schedule, Sizes};
use std::env;
use std::fs;
use std::path::{Path, PathBuf};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let out = PathBuf::from(env::var("OUT_DIR")?);
    let model = input("LACUNA_MODEL", lacuna_fixtures::MODEL)?;
    let cloud = input("LACUNA_CLOUD", lacuna_fixtures::PACKED_SCAN)?;
    fs::write(out.join("model.lacuna"), &model)?;
    fs::write(out.join("scan.cloud"), cloud)?;
    fs::write(
        out.join("sizes.rs"),
        sizes(&model).map_err(|error| format!("the model is refused: {error:?}"))?,
    )?;
    println!("cargo:rerun-if-changed=build.rs");
    Ok(())
}

/// The file an environment variable names, or what is built in.
fn input(variable: &str, built_in: &[u8]) -> Result<Vec<u8>, Box<dyn std::error::Error>> {
    println!("cargo:rerun-if-env-changed={variable}");
    let Ok(path) = env::var(variable) else { return Ok(built_in.to_vec()) };
    println!("cargo:rerun-if-changed={path}");
    if Path::new(&path).is_relative() {
        // Cargo runs this in the folder of the package, not where the file was named.
        return Err(
            format!("{variable}={path}: give the whole path, for instance {variable}=$PWD/{path}").into()
        );
    }
    fs::read(Path::new(&path)).map_err(|error| format!("{variable}: cannot read {path}: {error}").into())
}

/// The sizes of all buffers as Rust constants.
fn sizes(model: &[u8]) -> Result<String, lacuna::Error> {
    let model = Model::from_bytes(model)?;
    let schedule = Schedule::of(&model);
    let sizes = Sizes::required(&model, &schedule)?.named();
    Ok(sizes.map(|(name, size)| format!("pub const {name}: usize = {size};\n")).concat())
}
