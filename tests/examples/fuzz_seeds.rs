//! Writes the seeds of all fuzz targets into `tests/fuzz/corpus/TARGET`, where `cargo fuzz` begins.

use lacuna_tests::fuzz::TARGETS;
use std::io;
use std::path::Path;

fn main() -> io::Result<()> {
    for target in &TARGETS {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/corpus").join(target.name);
        std::fs::create_dir_all(&folder)?;
        for (number, seed) in (target.seeds)().iter().enumerate() {
            std::fs::write(folder.join(format!("seed-{number}")), seed)?;
        }
    }
    Ok(())
}
