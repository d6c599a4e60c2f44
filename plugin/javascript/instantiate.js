// Starts a module of WebAssembly, in browsers, workers and node.

// True if this engine has the SIMD and the exceptions of WebAssembly that the modules use: Chrome 95,
// Firefox 100, Safari 16.4, node 17 and later.
export function isSupported() {
  const simd = [0, 97, 115, 109, 1, 0, 0, 0, 1, 5, 1, 96, 0, 1, 123, 3, 2, 1, 0, 10, 10, 1, 8, 0, 65, 0,
    253, 15, 253, 98, 11];
  const exceptions = [0, 97, 115, 109, 1, 0, 0, 0, 1, 4, 1, 96, 0, 0, 3, 2, 1, 0, 10, 8, 1, 6, 0, 6, 64,
    25, 11, 11];
  return typeof WebAssembly === "object" &&
    [simd, exceptions].every((code) => WebAssembly.validate(new Uint8Array(code)));
}

// Reads the module: bytes, a Response or a promise of it, or an address that is fetched. node reads
// files itself.
async function compile(source) {
  source = await source;
  if (ArrayBuffer.isView(source) || source instanceof ArrayBuffer) return WebAssembly.compile(source);
  if (source instanceof WebAssembly.Module) return source;
  const url = new URL(source.url ?? source, import.meta.url);
  if (url.protocol === "file:") {
    const { readFile } = await import("node:fs/promises");
    return WebAssembly.compile(await readFile(url));
  }
  const response = source.url ? source : await fetch(url);
  if (!response.ok) throw new Error(`${url} could not be loaded: ${response.status} ${response.statusText}`);
  return WebAssembly.compile(await response.arrayBuffer());
}

// Returns the exports of the module at `source`. What it prints goes to print(line).
export async function instantiate(source, print = console.warn) {
  if (!isSupported()) throw new Error("this engine lacks SIMD or exceptions of WebAssembly");
  let exports, line = "";
  const words = () => new DataView(exports.memory.buffer);
  const system = {
    clock_time_get(clock, precision, address) {
      words().setBigUint64(address, BigInt(Math.round(1e6 * performance.now())), true);
      return 0;
    },
    fd_write(file, buffers, count, written) {
      let bytes = 0;
      for (let i = 0; i < count; ++i) {
        const address = words().getUint32(buffers + 8 * i, true);
        const length = words().getUint32(buffers + 8 * i + 4, true);
        line += new TextDecoder().decode(new Uint8Array(exports.memory.buffer, address, length));
        bytes += length;
      }
      words().setUint32(written, bytes, true);
      const lines = line.split("\n");
      line = lines.pop();
      lines.forEach((text) => print(text));
      return 0;
    },
    environ_sizes_get(count, bytes) {
      words().setUint32(count, 0, true);
      words().setUint32(bytes, 0, true);
      return 0;
    },
    environ_get: () => 0,
    proc_exit(status) {
      throw new Error(`the module ended with status ${status}`);
    },
  };
  // It has no files.
  const badFile = 8;
  for (const name of ["fd_close", "fd_seek", "fd_read"]) system[name] = () => badFile;
  const instance = await WebAssembly.instantiate(await compile(source), {
    wasi_snapshot_preview1: system,
    env: { emscripten_notify_memory_growth() {} },
  });
  exports = instance.exports;
  exports._initialize();
  return exports;
}
