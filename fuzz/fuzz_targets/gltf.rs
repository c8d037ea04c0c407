#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| fuzz::guard::run(fuzz::bodies::gltf, input));

libfuzzer_sys::fuzz_mutator!(|data: &mut [u8], size: usize, max_size: usize, seed: u32| {
    fuzz::mutate::glb(data, size, max_size, seed)
});
