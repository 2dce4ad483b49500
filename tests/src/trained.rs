//! Models of the real data, trained when they are first asked for: for a test within it, for examples kept in
//! `target/models`.

use crate::program::{json, succeeds};
use crate::real_data;
use lacuna::Model;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::OnceLock;
use std::time::Duration;

/// Thirty faces at 3.3 mm, not calibrated; none without the real data.
pub fn thirty_faces() -> Option<Model<'static>> {
    thirty_faces_bytes().map(|bytes| Model::from_bytes(bytes).expect("a model"))
}

/// The same as a file has them.
pub fn thirty_faces_bytes() -> Option<&'static [u8]> {
    static TRAINED: OnceLock<Option<Trained>> = OnceLock::new();
    let made = || {
        Some(train_watched(
            &training_faces(&real_data("faces/train")?, 0..30),
            &["--spacing", "3.3", "--no-calibration"],
        ))
    };
    TRAINED.get_or_init(made).as_ref().map(|trained| trained.model.as_slice())
}

/// Training shapes of faces in their folder.
pub fn training_faces(folder: &Path, numbers: Range<usize>) -> Vec<PathBuf> {
    numbers.map(|i| folder.join(format!("train_{i:03}.ply"))).collect()
}

/// The built-in model from its seeds, by the program and its files, not calibrated.
pub fn thirty_heads() -> &'static Trained {
    static TRAINED: OnceLock<Trained> = OnceLock::new();
    TRAINED.get_or_init(|| {
        let folder = tempfile::tempdir().expect("a folder");
        succeeds(folder.path(), &["synth", "heads", "heads", "--count", "30"]);
        let options = ["--spacing", "3.3", "--class", "head", "--no-calibration"];
        train_watched(&[folder.path().join("heads")], &options)
    })
}

/// A model, and the memory that its training took.
pub struct Trained {
    /// The file.
    pub model: Vec<u8>,
    /// Peak resident memory, KiB; none where there is no /proc.
    pub peak_kib: Option<u64>,
}

/// Trains with the program on meshes or folders of them.
///
/// # Panics
/// A training that fails.
pub fn train_watched(meshes: &[PathBuf], options: &[&str]) -> Trained {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("m.lacuna");
    let mut command = Command::new(crate::program::path());
    command.arg("train").args(meshes).arg("-o").arg(&path).args(options);
    let mut child = command.stdout(Stdio::null()).spawn().expect("the program starts");
    let mut highest = 0;
    // The kernel keeps the peak: the last look before the end misses at most what the last moments added.
    while child.try_wait().expect("a child").is_none() {
        highest = peak(child.id()).unwrap_or(0).max(highest);
        std::thread::sleep(Duration::from_millis(20));
    }
    assert!(child.wait().expect("a child").success());
    println!("{} MiB at most", highest / 1024);
    let peak_kib = peak(std::process::id()).map(|_| highest);
    Trained { model: std::fs::read(path).expect("the model"), peak_kib }
}

/// Peak resident memory of a running program, KiB; none once it has ended, or where there is no /proc.
fn peak(process: u32) -> Option<u64> {
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    line.split_whitespace().next()?.parse().ok()
}

/// Thirty faces at 3.3 mm.
pub fn faces(folder: &Path) -> Vec<u8> {
    trained("face.lacuna", &["--spacing", "3.3"], training_faces(&folder.join("train"), 0..30))
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
