"""Compares two outputs of lazyccd_frame_hashes. Frames whose positions are the same must have the same contacts."""
import sys

native, wasm = (sorted(line.split() for line in open(path)) for path in sys.argv[1:3])
assert native and [line[0] for line in native] == [line[0] for line in wasm], "other frames"
same = [(a, b) for a, b in zip(native, wasm) if a[1] == b[1]]
wrong = [a[0] for a, b in same if a != b]
contacts = sum(int(a[2]) for a, _ in same)
print(f"{len(same)} of {len(native)} frames have the same positions; {len(same) - len(wrong)} of them the same contacts, "
      f"{contacts} in all")
if wrong or len(same) < 0.8 * len(native):
    sys.exit(f"other contacts: {wrong}")
