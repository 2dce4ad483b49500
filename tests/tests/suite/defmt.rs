//! Firmware that logs with defmt: it links under the same proofs, computes the same bits, and sends frames.

use lacuna_fixtures::GOLDEN;
use lacuna_tests::firmware::{MACHINES, build_logging, folder, missing};
use std::process::Command;

fn assert_logs((machine, triple): (&str, &str)) {
    if missing(machine, triple).is_some() {
        return;
    }
    let elf = build_logging(machine, triple);
    let output = Command::new(folder().join("qemu.sh")).arg(machine).arg(elf).output().expect("qemu.sh");
    assert!(output.status.success(), "{output:?}");
    let text = String::from_utf8_lossy(&output.stdout);
    let golden = GOLDEN.iter().find(|golden| golden.name == "built-in").expect("a golden case");
    assert!(text.contains(&format!("digest local {:08x}", golden.local)), "{text}");
    // Four stages and the outcome; frames end with a zero and have none within.
    let frames = output.stderr.split(|&byte| byte == 0).filter(|frame| !frame.is_empty()).count();
    assert_eq!(frames, 5, "{:x?}", output.stderr);
}

#[test]
fn a_cortex_m_firmware_that_logs_computes_the_golden_bits_and_sends_a_frame_a_stage() {
    assert_logs(MACHINES[1]);
}

#[test]
fn a_risc_v_firmware_that_logs_computes_the_golden_bits_and_sends_a_frame_a_stage() {
    assert_logs(MACHINES[3]);
}
