#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| faircurve_fuzz::tracts(data));
