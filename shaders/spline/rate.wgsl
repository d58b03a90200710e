// What measures a device: the rates of its arithmetic and of its memory.
// No twin: `doctor` measures the device alone.

struct RateParams {
    // Threads.
    count: u32,
    turns: u32,
}

@group(0) @binding(0) var<uniform> params: RateParams;
@group(0) @binding(1) var<storage, read_write> results: array<real>;

// Multiplications with additions, as many as can be under way at once.
//:include entry.wgsl ENTRY=rate TASKS=params.count
    let factor = real(0.999);
    var x = vec4<real>(real(task), real(1), real(2), real(3));
    for (var turn = 0u; turn < params.turns; turn++) {
        x = fma(x, vec4<real>(factor), vec4<real>(factor));
    }
    results[task] = x.x + x.y + x.z + x.w;
}

// Reads a number and writes it.
//:include entry.wgsl ENTRY=stream TASKS=params.count
    results[task] = results[task] + real(params.turns);
}
