//! The firmware in QEMU: the same bits as the host on every machine, within the instructions that are written down.
//!
//! What is missing on this computer is said in one loud line; with `LACUNA_REQUIRE_TARGETS=1` it is a failure.
//! `LACUNA_WRITE_COUNTS=1` writes the measured table into targets/README.md.

use lacuna::Model;
use lacuna::pose_fit::Hint;
use lacuna_fixtures::golden;
use lacuna_host::device::{self, Client, Machine, Qemu, Timing};
use lacuna_host::verify::{CLASSES, Case, Class};
use lacuna_tests::firmware::{MACHINES, Run, build, build_with, folder, is_cortex, missing, run};
use lacuna_tests::required::lacks;
use lacuna_tests::small::{small, small_depth};
use std::collections::{BTreeMap, BTreeSet};
use std::panic::resume_unwind;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::{Mutex, MutexGuard};

/// Two tests must not build the same folder at a time; there is one a machine.
static BUILDING: [Mutex<()>; MACHINES.len()] = [const { Mutex::new(()) }; MACHINES.len()];

/// Waits until nobody else builds a machine's firmware.
fn alone(machine: &str) -> MutexGuard<'static, ()> {
    let place = MACHINES.iter().position(|&(name, _)| name == machine).expect("a machine");
    BUILDING[place].lock().unwrap_or_else(|poisoned| poisoned.into_inner())
}

fn assert_golden(machine: &str, name: &str, run: &Run) {
    for (stage, digest) in golden(name).expect("a golden case").stages() {
        assert_eq!(
            run.digests.get(stage),
            Some(&digest),
            "{name} on {machine}: first stage that differs is {stage}"
        );
    }
}

/// Columns of the table, in the order of the work.
const WORK: [&str; 10] = [
    "model",
    "setup",
    "pose",
    "hull",
    "global",
    "local curvature",
    "local residuals",
    "local gradient",
    "local update",
    "local sweep",
];

/// What of it is no step: the checks of the model and of the settings.
const UNDIVIDED: usize = 2;

/// Columns after them.
const SUMS: [&str; 5] = ["all", "longest step", "flash", "static RAM", "stack"];

/// Bytes of flash and static RAM, as `size` tells them.
fn sizes(elf: &Path) -> Option<[u64; 2]> {
    let output = Command::new("size").arg(elf).output().ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    let numbers: Vec<u64> =
        text.lines().nth(1)?.split_whitespace().take(3).filter_map(|w| w.parse().ok()).collect();
    let [text, data, bss] = numbers[..] else { return None };
    Some([text + data, data + bss])
}

fn row(machine: &str, run: &Run, [flash, ram]: [u64; 2]) -> Vec<u64> {
    let counted: BTreeSet<&str> = run.counts.keys().map(String::as_str).collect();
    assert_eq!(counted, BTreeSet::from(WORK), "{machine}: kinds of work that are counted");
    assert!(run.stack > 0, "{machine}: its stack is not measured");
    let counts = WORK.map(|name| run.counts[name]);
    assert_eq!(run.longest.len() + UNDIVIDED, WORK.len(), "{machine}: work whose longest step is counted");
    let longest = run.longest.values().max().copied().unwrap_or(0);
    counts.into_iter().chain([counts.iter().sum(), longest, flash, ram, run.stack]).collect()
}

fn table_path() -> PathBuf {
    folder().join("README.md")
}

/// The rows of the table between its marks.
fn written() -> BTreeMap<String, Vec<u64>> {
    let text = std::fs::read_to_string(table_path()).expect("targets/README.md");
    let rows =
        text.lines().skip_while(|l| !l.contains("counts begin")).take_while(|l| !l.contains("counts end"));
    let cells =
        |line: &str| -> Vec<String> { line.trim_matches('|').split('|').map(|c| c.trim().into()).collect() };
    rows.map(cells)
        .filter_map(|cells| {
            let numbers: Option<Vec<u64>> =
                cells[1..].iter().map(|c| c.replace(' ', "").parse().ok()).collect();
            Some((cells[0].clone(), numbers.filter(|n| !n.is_empty())?))
        })
        .collect()
}

fn write(rows: &BTreeMap<String, Vec<u64>>) {
    let text = std::fs::read_to_string(table_path()).expect("targets/README.md");
    let (head, rest) = text.split_once("<!-- counts begin -->").expect("the table's first mark");
    let (_, tail) = rest.split_once("<!-- counts end -->").expect("the table's last mark");
    let titles = WORK.into_iter().chain(SUMS).collect::<Vec<_>>().join(" | ");
    let grouped = |n: &u64| {
        let digits = n.to_string();
        let groups = digits.as_bytes().rchunks(3).rev().map(|g| String::from_utf8_lossy(g).into_owned());
        groups.collect::<Vec<_>>().join(" ")
    };
    let lines: Vec<String> = rows
        .iter()
        .map(|(machine, row)| {
            format!("| {machine} | {} |\n", row.iter().map(grouped).collect::<Vec<_>>().join(" | "))
        })
        .collect();
    let rule = "|---".repeat(1 + WORK.len() + SUMS.len());
    let table = format!("\n| machine | {titles} |\n{rule}|\n{}", lines.concat());
    let text = format!("{head}<!-- counts begin -->{table}<!-- counts end -->{tail}");
    std::fs::write(table_path(), text).expect("targets/README.md");
}

/// The rows of the machines of one family.
fn measured(cortex: bool) -> Vec<(String, Vec<u64>)> {
    let row_of = |(machine, triple): (&str, &str)| {
        let _one = alone(machine);
        let elf = build(machine, triple);
        assert_no_panic_path(machine, &elf);
        let run = run(machine, &elf);
        assert_golden(machine, "built-in", &run);
        let Some(sizes) = sizes(&elf) else {
            lacks(
                "TARGETS",
                &format!("size, which tells flash and RAM: {machine} is not compared with its row"),
            );
            return None;
        };
        Some((machine.to_string(), row(machine, &run, sizes)))
    };
    let family = MACHINES.into_iter().filter(|(machine, _)| is_cortex(machine) == cortex);
    family.filter(|(machine, triple)| missing(machine, triple).is_none()).filter_map(row_of).collect()
}

/// Two per cent more than what is written down is a failure; less than that, a reason to write it anew.
#[test]
fn every_machine_computes_the_golden_bits_in_the_instructions_written_down() {
    let known = written();
    // Families of processors have folders of built files of their own: builds of both go on at a time.
    let measured: BTreeMap<String, Vec<u64>> = std::thread::scope(|scope| {
        let families = [true, false].map(|cortex| scope.spawn(move || measured(cortex)));
        families.into_iter().flat_map(|family| family.join().unwrap_or_else(|e| resume_unwind(e))).collect()
    });
    if std::env::var_os("LACUNA_WRITE_COUNTS").is_some() {
        // Machines that are missing here keep their rows.
        let mut rows = known;
        rows.extend(measured);
        return write(&rows);
    }
    for (machine, row) in &measured {
        let Some(known) = known.get(machine) else {
            panic!("{machine} is not in the table of targets/README.md")
        };
        assert!(known.len() >= row.len(), "{machine}: {known:?} in the table, {row:?} measured");
        let names = WORK.into_iter().chain(SUMS);
        for ((name, found), known) in names.zip(row).zip(known) {
            // Toolchains differ by a few instructions in small stages; the sum must hold, and so must the bytes.
            let limit = match name {
                "all" => known + known / 50,
                "longest step" | "flash" | "static RAM" | "stack" => known + known / 20,
                _ => known + known / 5 + 1_000_000,
            };
            assert!(*found <= limit, "{machine}: {name} takes {found}, {known} are written down");
        }
    }
}

/// The link itself fails when a panic path is reachable; this looks for what else must not be there.
fn assert_no_panic_path(machine: &str, elf: &Path) {
    let output = match Command::new("nm").args(["-C", "--defined-only"]).arg(elf).output() {
        Ok(output) => output,
        Err(error) => return lacks("TARGETS", &format!("nm, which looks for panic paths: {error}")),
    };
    let symbols = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(symbols.contains("lacuna"), "{machine}: no symbols to look at");
    let bad: Vec<&str> = symbols
        .lines()
        .filter(|l| ["core::fmt", "panicking", "alloc::"].iter().any(|word| l.contains(word)))
        .collect();
    assert!(bad.is_empty(), "{machine} has {bad:?}");
}

/// The small case over the emulated serial line: as points, and as a depth image that the machine makes points of.
fn assert_serves(machine: &str, elf: &Path) {
    let board = if machine == "m7" { Machine::M7 } else { Machine::Riscv };
    let mut client = Client::new(Qemu::start(board, Some(elf)).expect("QEMU"), Timing::default());
    client.hello().expect("a device");
    for small in [small(), small_depth()] {
        let model = Model::from_bytes(&small.model).unwrap();
        let results = device::run(&mut client, &model, &small.scan, &mut |_| ()).unwrap();
        let digests = results.into_fit(&model, &small.scan.begin).unwrap().digests;
        assert_eq!(digests, small.digests, "{machine}");
    }
}

/// A fixture that the emulators leave out: "mirror" is the same class with more in it, and "small" has no mirror either.
const LEFT_OUT: &str = "side";

/// What a firmware with defmt's log sends of a fixture, whose pose is held: three stages and the outcome.
const FRAMES: usize = 4;

/// defmt's frames in what was sent: they end with a zero and have none within.
fn frames(run: &Run) -> usize {
    run.log.split(|&byte| byte == 0).filter(|frame| !frame.is_empty()).count()
}

/// The other fixtures have models of their own: each is built for one of two kinds of processor in turn, with defmt's log,
/// and the one that is served too for both, without.
#[test]
fn fixtures_with_other_models_compute_the_golden_bits_with_a_log_or_without() {
    let machines: Vec<_> =
        [MACHINES[1], MACHINES[3]].into_iter().filter(|(m, t)| missing(m, t).is_none()).collect();
    std::thread::scope(|scope| {
        for (turn, machine) in machines.iter().enumerate() {
            let turns = (turn, machines.len());
            scope.spawn(move || assert_fixtures(*machine, turns));
        }
    });
}

/// Every so many fixtures are a machine's turn.
fn assert_fixtures((machine, triple): (&str, &str), (turn, turns): (usize, usize)) {
    let folder = tempfile::tempdir().unwrap();
    let (model, cloud) = (folder.path().join("model.lacuna"), folder.path().join("scan.cloud"));
    let classes = CLASSES.iter().filter(|class| class.name != LEFT_OUT);
    for (number, class) in classes.enumerate() {
        let served = class.name == Class::SMALL.name;
        if number % turns != turn && !served {
            continue;
        }
        let case = Case::synthetic(class).unwrap();
        std::fs::write(&model, &case.model).unwrap();
        std::fs::write(&cloud, case.points.packed().to_bytes(&case.pose, Hint::Exact)).unwrap();
        let _one = alone(machine);
        let logs = !served;
        let elf = build_with(machine, triple, [&model, &cloud], logs);
        let run = run(machine, &elf);
        assert_golden(machine, class.name, &run);
        if served {
            assert_serves(machine, &elf);
        }
        assert_eq!(frames(&run), if logs { FRAMES } else { 0 }, "{machine}: {:x?}", run.log);
    }
}
