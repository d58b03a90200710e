// Writes smoke.json: a small capture that needs no GPU to make, to check run.mjs itself.
//
//   node tests/browser/smoke.mjs > tests/browser/smoke.json
//
// One workgroup scales its part of an array, then every lane adds its right neighbour's value: an override, a uniform,
// workgroup memory and a barrier in one kernel. The expected values come from the same f32 steps done here.

const LANES = 8;
const GROUPS = 3;
const FACTOR = 2.5;

const wgsl = `override LANES: u32 = 4u;
struct Options { factor: f32, count: u32 }
@group(0) @binding(0) var<uniform> options: Options;
@group(0) @binding(1) var<storage, read> input: array<f32>;
@group(0) @binding(2) var<storage, read_write> output: array<f32>;
@group(0) @binding(3) var<storage, read_write> lanes: array<u32>;
var<workgroup> shared_row: array<f32, ${LANES}>;

@compute @workgroup_size(LANES)
fn scale(@builtin(global_invocation_id) id: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let live = id.x < options.count;
    var value = 0.0;
    if live { value = input[id.x] * options.factor; }
    shared_row[lane] = value;
    workgroupBarrier();
    if live {
        output[id.x] = value + shared_row[(lane + 1u) % LANES];
        lanes[id.x] = lane;
    }
}
`;

const count = LANES * GROUPS - 3; // the last workgroup has lanes without work
const base64 = (array) => Buffer.from(array.buffer, array.byteOffset, array.byteLength).toString('base64');
const round = Math.fround;
const input = Float32Array.from({ length: count }, (_, i) => Math.sin(i) * 10);
const scaled = Float32Array.from({ length: LANES * GROUPS }, (_, i) => (i < count ? round(input[i] * FACTOR) : 0));
const neighbour = (i) => i - (i % LANES) + ((i + 1) % LANES);
const output = Float32Array.from({ length: count }, (_, i) => round(scaled[i] + scaled[neighbour(i)]));
const lanes = Uint32Array.from({ length: count }, (_, i) => i % LANES);
const options = new DataView(new ArrayBuffer(8));
options.setFloat32(0, FACTOR, true);
options.setUint32(4, count, true);
// The outputs start as a pattern that no result has, so that "wrote zero" and "did not write" differ.
const sentinel = base64(new Uint32Array(count).fill(0xdeadbeef));

const capture = [{
  kernel: 'smoke/scale',
  wgsl,
  entry: 'scale',
  constants: { LANES },
  groups: [GROUPS, 1, 1],
  buffers: [
    { binding: 0, group: 0, kind: 'uniform', before: base64(options), after: null },
    { binding: 1, group: 0, kind: 'read', before: base64(input), after: null },
    { binding: 2, group: 0, kind: 'read_write', before: sentinel, after: base64(output), words: 'f32' },
    { binding: 3, group: 0, kind: 'read_write', before: sentinel, after: base64(lanes), words: 'u32' },
  ],
  tolerance: 1e-6,
}];
console.log(JSON.stringify(capture, null, 2));
