//! Firmware that logs with defmt: it links under the same proofs, computes the same bits, and sends frames.

use lacuna_fixtures::golden;
use lacuna_tests::firmware::{MACHINES, build_logging, missing, run};

fn assert_logs((machine, triple): (&str, &str)) {
    if missing(machine, triple).is_some() {
        return;
    }
    let run = run(machine, &build_logging(machine, triple));
    for (stage, digest) in golden("built-in").expect("a golden case").stages() {
        assert_eq!(run.digests.get(stage), Some(&digest), "{stage} on {machine}");
    }
    // Four stages and the outcome; frames end with a zero and have none within.
    let frames = run.log.split(|&byte| byte == 0).filter(|frame| !frame.is_empty()).count();
    assert_eq!(frames, 5, "{:x?}", run.log);
}

#[test]
fn a_cortex_m_firmware_that_logs_computes_the_golden_bits_and_sends_a_frame_a_stage() {
    assert_logs(MACHINES[1]);
}

#[test]
fn a_risc_v_firmware_that_logs_computes_the_golden_bits_and_sends_a_frame_a_stage() {
    assert_logs(MACHINES[3]);
}
