#![no_main]

use lacuna_tests::fuzz::{fit, tiny::tiny};

// The tiny model is trained first: no input is to be blamed for the time that takes.
libfuzzer_sys::fuzz_target!(
    init: {
        tiny();
    },
    |bytes: &[u8]| fit::run(bytes)
);
