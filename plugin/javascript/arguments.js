// Checks of arguments. Each returns the value as it is used, or throws with the argument's name: a
// TypeError for a wrong type, a RangeError for a wrong value.

const quoted = (value) => typeof value === "string" ? JSON.stringify(value) : String(value);

export function object(value, name, members) {
  if (value === null || typeof value !== "object") throw new TypeError(`${name} is not an object`);
  for (const member of Object.keys(value))
    if (!members.includes(member))
      throw new TypeError(`${name} has no member ${member}; there are ${members.join(", ")}`);
  return value;
}

export function number(value, name, least = -Infinity, most = Infinity) {
  if (typeof value !== "number") throw new TypeError(`${name} is not a number`);
  // Bullet computes in single precision.
  if (!Number.isFinite(Math.fround(value))) throw new RangeError(`${name} is ${value}`);
  if (value < least || value > most)
    throw new RangeError(`${name} is ${value}; it goes from ${least} to ${most}`);
  return value;
}

export function positive(value, name) {
  if (number(value, name) <= 0) throw new RangeError(`${name} is ${value}; it must be above 0`);
  return value;
}

export function whole(value, name, least, most) {
  number(value, name, least, most);
  if (!Number.isInteger(value)) throw new RangeError(`${name} is ${value}, which is not whole`);
  return value;
}

export function truth(value, name) {
  if (typeof value !== "boolean") throw new TypeError(`${name} is neither true nor false`);
  return value;
}

export function choice(value, name, choices) {
  const index = choices.indexOf(value);
  if (index < 0) throw new RangeError(`${name} is ${quoted(value)}; there are ${choices.join(", ")}`);
  return index;
}

function arrayLike(value, name) {
  const isArray = Array.isArray(value) || (ArrayBuffer.isView(value) && !(value instanceof DataView));
  if (!isArray) throw new TypeError(`${name} is not an array`);
  return value;
}

// An array of numbers in groups of `group`, as floats.
export function floats(value, name, group, least = 1) {
  arrayLike(value, name);
  if (value.length % group !== 0)
    throw new RangeError(`${name} has ${value.length} numbers, not a multiple of ${group}`);
  if (value.length < group * least)
    throw new RangeError(`${name} has ${value.length} numbers; ${group * least} are needed`);
  for (let i = 0; i < value.length; ++i) number(value[i], `${name}[${i}]`);
  return Float32Array.from(value);
}

// An array of indices below `count`, in groups of `group` that differ.
export function indices(value, name, group, count, least = 0) {
  arrayLike(value, name);
  if (value.length % group !== 0)
    throw new RangeError(`${name} has ${value.length} indices, not a multiple of ${group}`);
  if (value.length < group * least)
    throw new RangeError(`${name} has ${value.length} indices; ${group * least} are needed`);
  for (let i = 0; i < value.length; ++i) {
    if (typeof value[i] !== "number") throw new TypeError(`${name}[${i}] is not a number`);
    if (!Number.isInteger(value[i]) || value[i] < 0 || value[i] >= count)
      throw new RangeError(`${name}[${i}] is ${value[i]}, but there are ${count} nodes`);
    for (let k = i - i % group; k < i; ++k)
      if (value[k] === value[i]) throw new RangeError(`${name}[${k}] and ${name}[${i}] are both ${value[i]}`);
  }
  return Int32Array.from(value);
}

export function vector(value, name) {
  floats(value, name, 3);
  if (value.length !== 3) throw new RangeError(`${name} has ${value.length} numbers instead of 3`);
  return value;
}

export function direction(value, name) {
  vector(value, name);
  if (Math.hypot(...value) < 1e-6) throw new RangeError(`${name} has no direction`);
  return value;
}

export function rotation(value, name) {
  floats(value, name, 4);
  if (value.length !== 4) throw new RangeError(`${name} has ${value.length} numbers instead of 4`);
  if (Math.abs(Math.hypot(...value) - 1) > 1e-3) throw new RangeError(`${name} is not a unit quaternion`);
  return value;
}
