//! Models of the real data, trained when they are first asked for: for a test within it, for examples kept in
//! `target/models`.

use crate::program::json;
use crate::real_data;
use lacuna::Model;
use lacuna_host::io;
use lacuna_host::mesh::Mesh;
use lacuna_host::train::align::{Align, align};
use lacuna_host::train::{Settings, train};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// Thirty faces at 3.3 mm, not calibrated; none without the real data.
pub fn thirty_faces() -> Option<Model<'static>> {
    thirty_faces_bytes().map(|bytes| Model::from_bytes(bytes).expect("a model"))
}

/// The same as a file has them.
pub fn thirty_faces_bytes() -> Option<&'static [u8]> {
    static BYTES: OnceLock<Option<Vec<u8>>> = OnceLock::new();
    let made = || {
        let faces = real_data("faces/train")?;
        let read = |i: usize| io::read(&faces.join(format!("train_{i:03}.ply"))).expect("a mesh");
        let shapes: Vec<Mesh> = (0..30).map(read).collect();
        let aligned = align(&shapes, Align::Auto, 1, &|_, _| ()).expect("faces in one pose");
        let settings = Settings { spacing: Some(3.3), apart: aligned.way.apart(), ..Settings::default() };
        Some(train(&aligned.shapes, &settings, &|_, _| ()).expect("a model"))
    };
    BYTES.get_or_init(made).as_deref()
}

/// Thirty faces at 3.3 mm.
pub fn faces(folder: &Path) -> Vec<u8> {
    let shapes = (0..30).map(|i| folder.join(format!("train/train_{i:03}.ply")));
    trained("face.lacuna", &["--spacing", "3.3"], shapes.collect())
}

/// Eight femurs.
pub fn femurs(folder: &Path) -> Vec<u8> {
    trained("femur.lacuna", &[], (0..8).map(|i| folder.join(format!("train_{i:02}.ply"))).collect())
}

fn trained(name: &str, options: &[&str], shapes: Vec<PathBuf>) -> Vec<u8> {
    let models = Path::new(env!("CARGO_MANIFEST_DIR")).join("../target/models");
    std::fs::create_dir_all(&models).expect("a folder for models");
    let shapes = shapes.into_iter().map(|path| std::fs::canonicalize(path).expect("a training shape"));
    let shapes: Vec<String> = shapes.map(|path| path.display().to_string()).collect();
    // By another build of the program they may be other models.
    let program = std::fs::read(crate::program::path()).expect("the program");
    let name = &format!("{:08x}-{name}", lacuna::format::checksum(&program));
    let arguments = ["train", "--json", "-o", name].into_iter().chain(options.iter().copied());
    if !models.join(name).exists() {
        json(&models, &arguments.chain(shapes.iter().map(String::as_str)).collect::<Vec<_>>());
    }
    std::fs::read(models.join(name)).expect("the model")
}
