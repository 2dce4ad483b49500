//! Build script of the Cortex-M machines: puts each one's memory layout where the linker finds it, its own or that of the
//! MPS2 boards.

fn main() {
    let own = std::env::var("CARGO_MANIFEST_DIR").unwrap_or_default();
    let folder = if std::path::Path::new("memory.x").exists() { own } else { format!("{own}/../mps2") };
    println!("cargo:rustc-link-search={folder}");
    println!("cargo:rerun-if-changed={folder}/memory.x");
    println!("cargo:rustc-link-arg-bins=--nmagic");
    println!("cargo:rustc-link-arg-bins=-Tlink.x");
    if std::env::var_os("CARGO_FEATURE_DEFMT").is_some() {
        println!("cargo:rustc-link-arg-bins=-Tdefmt.x");
    }
}
