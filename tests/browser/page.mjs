// What runs inside the page. Both functions are sent there as text, so each must stand alone.

// Name and subgroup sizes of the adapter, or null where WebGPU has none.
export async function adapterInfo() {
  const adapter = await navigator.gpu?.requestAdapter();
  if (!adapter) return null;
  const info = adapter.info;
  const words = [info.vendor, info.architecture, info.device, info.description].filter((word) => word);
  return {
    name: words.join(', ') || 'unnamed',
    subgroups: adapter.features.has('subgroups'),
    subgroupMinSize: info.subgroupMinSize ?? 0,
    subgroupMaxSize: info.subgroupMaxSize ?? 0,
  };
}

// Compiles and runs one dispatch. Returns { compiled, messages, error, after }: `after` holds one base64 text for every
// buffer with an expected content, null for the others.
export async function runDispatch({ dispatch, subgroups, compileOnly }) {
  const decode = (text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const encode = (bytes) => {
    let text = '';
    for (let i = 0; i < bytes.length; i += 0x8000) text += String.fromCharCode(...bytes.subarray(i, i + 0x8000));
    return btoa(text);
  };
  const messages = [];
  const result = (rest) => ({ compiled: false, messages, error: null, after: null, ...rest });

  const adapter = await navigator.gpu.requestAdapter();
  if (subgroups && !adapter.features.has('subgroups')) return result({}); // nothing to compile it with
  // No limit is raised: what passes here keeps to the limits that every WebGPU implementation promises.
  const device = await adapter.requestDevice({ requiredFeatures: subgroups ? ['subgroups'] : [] });
  const uncaptured = [];
  device.addEventListener('uncapturederror', (event) => uncaptured.push(event.error.message));
  const scopes = ['validation', 'out-of-memory', 'internal'];
  scopes.forEach((scope) => device.pushErrorScope(scope));
  const scopeErrors = async () => {
    const errors = await Promise.all(scopes.map(() => device.popErrorScope()));
    return errors.filter((error) => error).map((error) => error.message);
  };

  try {
    // naga knows the subgroup builtins without the directive and refuses it; browsers demand it.
    const directive = subgroups && !/^\s*enable\s+subgroups\s*;/m.test(dispatch.wgsl) ? 'enable subgroups; ' : '';
    const module = device.createShaderModule({ label: dispatch.kernel, code: directive + dispatch.wgsl });
    let refused = 0;
    for (const { type, lineNum, linePos, message } of (await module.getCompilationInfo()).messages) {
      messages.push(`${type}, line ${lineNum}:${linePos}: ${message}`);
      refused += type === 'error';
    }
    if (refused) return result({ error: `the compiler reports ${refused} error${refused > 1 ? 's' : ''}` });

    const groupCount = 1 + Math.max(0, ...dispatch.buffers.map((buffer) => buffer.group ?? 0));
    const types = { uniform: 'uniform', read: 'read-only-storage', read_write: 'storage' };
    const bindGroupLayouts = Array.from({ length: groupCount }, (_, group) => device.createBindGroupLayout({
      entries: dispatch.buffers.filter((buffer) => (buffer.group ?? 0) === group).map((buffer) => (
        { binding: buffer.binding, visibility: GPUShaderStage.COMPUTE, buffer: { type: types[buffer.kind] } })),
    }));
    const pipeline = await device.createComputePipelineAsync({
      layout: device.createPipelineLayout({ bindGroupLayouts }),
      compute: { module, entryPoint: dispatch.entry, constants: dispatch.constants ?? {} },
    });
    if (compileOnly) return result({ compiled: true, error: (await scopeErrors()).join('; ') || null });

    const buffers = dispatch.buffers.map((buffer) => {
      const bytes = decode(buffer.before);
      const usage = (buffer.kind === 'uniform' ? GPUBufferUsage.UNIFORM : GPUBufferUsage.STORAGE) | GPUBufferUsage.COPY_SRC;
      const whole = buffer.kind === 'uniform' ? 16 : 4;
      const size = Math.max(whole, Math.ceil(bytes.length / whole) * whole);
      const gpu = device.createBuffer({ size, usage, mappedAtCreation: true });
      new Uint8Array(gpu.getMappedRange()).set(bytes);
      gpu.unmap();
      return { ...buffer, gpu, size, length: bytes.length };
    });
    const encoder = device.createCommandEncoder();
    const pass = encoder.beginComputePass();
    pass.setPipeline(pipeline);
    bindGroupLayouts.forEach((layout, group) => pass.setBindGroup(group, device.createBindGroup({
      layout,
      entries: buffers.filter((buffer) => (buffer.group ?? 0) === group).map((buffer) => (
        { binding: buffer.binding, resource: { buffer: buffer.gpu } })),
    })));
    pass.dispatchWorkgroups(...dispatch.groups);
    pass.end();
    const compared = buffers.map((buffer) => {
      if (buffer.after == null) return null;
      const copy = device.createBuffer({ size: buffer.size, usage: GPUBufferUsage.MAP_READ | GPUBufferUsage.COPY_DST });
      encoder.copyBufferToBuffer(buffer.gpu, 0, copy, 0, buffer.size);
      return { copy, length: buffer.length };
    });
    device.queue.submit([encoder.finish()]);
    const errors = await scopeErrors();
    if (errors.length) return result({ compiled: true, error: errors.join('; ') });

    const after = [];
    for (const entry of compared) {
      if (!entry) {
        after.push(null);
        continue;
      }
      await entry.copy.mapAsync(GPUMapMode.READ);
      after.push(encode(new Uint8Array(entry.copy.getMappedRange()).subarray(0, entry.length)));
    }
    return result({ compiled: true, after, error: uncaptured.join('; ') || null });
  } catch (error) {
    return result({ error: String(error.message ?? error) });
  } finally {
    device.destroy();
  }
}
