//! What a compiler of hardware says of kernels: registers, spills, scratch memory, waves, bytes of its code and of the
//! SPIR-V, milliseconds it takes; a line a form.
//!
//! `cargo run --example kernels [WORD …]` compiles those forms whose names have all the words. On Linux with Mesa's
//! driver of AMD's cards no card is needed: `VK_DRIVER_FILES=/usr/share/vulkan/icd.d/radeon_icd.x86_64.json
//! RADV_FORCE_FAMILY=vega20` compile for one that is not there.

#[path = "../../tests/gpu/compilers/compiler.rs"]
mod compiler;

use faircurve::kernels;

fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let Some(compiler) = compiler::Compiler::open() else {
        eprintln!("no Vulkan device tells what becomes of its pipelines: set VK_DRIVER_FILES and RADV_FORCE_FAMILY");
        std::process::exit(1);
    };
    println!("registers, spilled, scratch bytes a wave, waves; code, SPIR-V, ms: kernel");
    for key in kernels().iter().filter(|key| words.iter().all(|word| key.name().contains(word))) {
        match compiler.compile(key) {
            Ok(found) => {
                let of = |name| found.of(name);
                let (registers, spilled) = (of("VGPRs"), of("Spilled VGPRs"));
                let (scratch, waves) = (of("Scratch size"), of("Subgroups per SIMD"));
                let (code, spirv, ms) = (of("Code size"), of("SPIR-V size"), of("Compilation"));
                println!("{registers} {spilled} {scratch} {waves}; {code} {spirv} {ms}: {}", key.name());
            }
            Err(why) => println!("refused: {}: {why}", key.name()),
        }
    }
}
