//! The command line: one file a subcommand, all errors as sentences.

mod bug;
mod check;
mod complete;
mod completed;
mod device;
mod evaluate;
mod inputs;
mod inspect;
mod interrupt;
mod outputs;
mod register;
mod scatter;
mod shapes;
mod synth;
mod train;
mod trained;
mod verify;

use clap::{Args, Parser, Subcommand};
use indicatif::{ProgressBar, ProgressStyle};
use std::process::ExitCode;
use std::sync::OnceLock;

/// Completes 3D scans with a local statistical shape prior.
#[derive(Parser)]
#[command(name = "lacuna", version, about, max_term_width = 100)]
struct Cli {
    #[command(subcommand)]
    command: Command,
    #[command(flatten)]
    common: Common,
}

/// Options of every subcommand.
#[derive(Args, Clone)]
struct Common {
    /// Print JSON for programs instead of text: one object, of `check` and `verify` an array
    #[arg(long, global = true)]
    json: bool,
    /// Threads to use, 1 to 256; the results do not depend on it [default: all processors]
    #[arg(long, global = true, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=256))]
    threads: Option<u16>,
    /// Refuse files that may need more memory than this: bytes, or with K, M or G
    #[arg(long, global = true, value_name = "BYTES", value_parser = crate::io::limit::parse)]
    max_memory: Option<u64>,
}

#[derive(Subcommand)]
enum Command {
    /// Complete a scan: without arguments, the example scan with the built-in model
    Complete(complete::Complete),
    /// Look for what is wrong with scans or training meshes, without using them
    Check(check::Check),
    /// Let a device complete scans: over a serial port, TCP, or in QEMU
    Device(device::Device),
    /// Train a shape model on meshes of one class
    Train(train::Train),
    /// Compare local, global and correspondence models over the number of training shapes
    Evaluate(evaluate::Evaluate),
    /// Show what a model holds and what memory its fit needs
    Inspect(inspect::Inspect),
    /// Find the pose of a scan in a model's frame
    Register(register::Register),
    /// Make heads and scans of the built-in shape class
    Synth(synth::Synth),
    /// Check this build: reference against float against fixed point, digests against the golden ones
    Verify(verify::Verify),
}

/// A subcommand's failure: data that cannot be used.
type Failure = Box<dyn std::error::Error + Send + Sync>;

/// Runs the program: 0 for success, 1 for data that cannot be used, 2 for wrong usage.
pub fn run() -> ExitCode {
    let cli = Cli::parse();
    bug::report_panics();
    interrupt::watch();
    if let Some(bytes) = cli.common.max_memory {
        crate::io::limit::set(bytes);
    }
    if let Some(threads) = cli.common.threads {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(usize::from(threads));
        if let Err(error) = pool.build_global() {
            return fail(&error.into());
        }
    }
    let result = match &cli.command {
        Command::Complete(args) => args.run(&cli.common),
        Command::Check(args) => args.run(&cli.common),
        Command::Device(args) => args.run(&cli.common),
        Command::Train(args) => args.run(&cli.common),
        Command::Evaluate(args) => args.run(&cli.common),
        Command::Inspect(args) => args.run(&cli.common),
        Command::Register(args) => args.run(&cli.common),
        Command::Synth(args) => args.run(&cli.common),
        Command::Verify(args) => args.run(&cli.common),
    };
    let said = || UNSAID.get().map_or(Ok(()), |why| Err(why.as_str().into()));
    result.and_then(|()| said()).map_or_else(|error| fail(&error), |()| ExitCode::SUCCESS)
}

fn fail(error: &Failure) -> ExitCode {
    eprintln!("lacuna: {error}");
    ExitCode::from(if error.is::<outputs::Usage>() { 2 } else { 1 })
}

/// Why a line could not be printed, if one could not.
static UNSAID: OnceLock<String> = OnceLock::new();

/// Prints a line to standard output. A reader that has gone away is no error; a full disk is one at the end.
fn say(text: &str) {
    use std::io::{ErrorKind, Write};
    match writeln!(std::io::stdout(), "{text}") {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
            let _ = UNSAID.set(format!("cannot write to standard output: {error}"));
        }
        _ => {}
    }
}

/// A progress bar on a terminal, nothing in a pipe.
fn bar(total: u64, what: &str) -> ProgressBar {
    let style = ProgressStyle::with_template("{msg:20} {wide_bar} {pos}/{len} {eta}");
    let bar = ProgressBar::new(total).with_message(what.to_owned());
    if let Ok(style) = style { bar.with_style(style) } else { bar }
}
