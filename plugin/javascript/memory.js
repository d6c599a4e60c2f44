// The memory of a module: arrays for its functions, and views of what it returns.

export class Memory {
  constructor(module) {
    this.module = module;
  }

  // Calls use(address) with the address of a copy of a typed array; 0 if it is empty.
  with(array, use) {
    if (array.length === 0) return use(0);
    const address = this.module.reserve(array.byteLength);
    if (address === 0) throw new RangeError("the memory is full");
    try {
      new array.constructor(this.module.memory.buffer, address, array.length).set(array);
      return use(address);
    } finally {
      this.module.release(address);
    }
  }

  // The same for several arrays.
  withAll(arrays, use, addresses = []) {
    if (addresses.length === arrays.length) return use(...addresses);
    return this.with(arrays[addresses.length], (address) => this.withAll(arrays, use, [...addresses, address]));
  }

  withText(text, use) {
    return this.with(new TextEncoder().encode(text + "\0"), use);
  }

  floats(address, count) {
    return new Float32Array(this.module.memory.buffer, count ? address : 0, count);
  }

  integers(address, count) {
    return new Int32Array(this.module.memory.buffer, count ? address : 0, count);
  }

  text(address) {
    const bytes = new Uint8Array(this.module.memory.buffer, address);
    return new TextDecoder().decode(bytes.subarray(0, bytes.indexOf(0)));
  }
}
