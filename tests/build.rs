//! Takes the firmware out of the README, so that a test compiles and runs it as it is printed there.

use std::error::Error;
use std::path::Path;

fn main() -> Result<(), Box<dyn Error>> {
    let readme = Path::new(env!("CARGO_MANIFEST_DIR")).join("../README.md");
    println!("cargo:rerun-if-changed={}", readme.display());
    let text = std::fs::read_to_string(&readme)?;
    let section =
        text.split("## In your firmware").nth(1).ok_or("README.md: no section \"In your firmware\"")?;
    let code = section.split("```rust\n").nth(1).and_then(|rest| rest.split("```").next());
    let code = code.ok_or("README.md: no Rust in the section \"In your firmware\"")?;
    let function = format!(
        "#[allow(unused_variables, clippy::needless_borrow)]\nfn firmware(points: &[Packed], step: f32, rough_pose: Pose, \
         memory: Memory<'_, lacuna::Fixed>) -> Result<Outcome, Error> {{\n{code}\nOk(outcome)\n}}\n"
    );
    std::fs::write(Path::new(&std::env::var("OUT_DIR")?).join("readme.rs"), function)?;
    Ok(())
}
