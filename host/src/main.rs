//! The `lacuna` program.

fn main() -> std::process::ExitCode {
    lacuna_host::cli::run()
}
