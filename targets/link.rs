//! Build script of all machines: puts each one's memory layout where the linker finds it, its own or that of the MPS2
//! boards, and links as the runtime of its processor wants.

fn main() {
    let own = std::env::var("CARGO_MANIFEST_DIR").unwrap_or_default();
    let folder = if std::path::Path::new("memory.x").exists() { own } else { format!("{own}/../mps2") };
    println!("cargo:rustc-link-search={folder}");
    println!("cargo:rerun-if-changed={folder}/memory.x");
    let is_arm = std::env::var("CARGO_CFG_TARGET_ARCH").is_ok_and(|arch| arch == "arm");
    // The script of Cortex-M includes the layout; that of RISC-V is given it first.
    let option = if is_arm { "--nmagic" } else { "-Tmemory.x" };
    println!("cargo:rustc-link-arg-bins={option}");
    println!("cargo:rustc-link-arg-bins=-Tlink.x");
    if std::env::var_os("CARGO_FEATURE_DEFMT").is_some() {
        println!("cargo:rustc-link-arg-bins=-Tdefmt.x");
    }
}
