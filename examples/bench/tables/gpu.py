"""Tables of gpu.md."""
from tables.common import count, distinct, number, plain, precise, ratio, read, table, text


@table("gpu/detections")
def detections():
    def time(frames, backend, strategy, column):
        return next((number(row[column]) for row in read("gpu/detections.csv", scene=frames, backend=backend,
                                                          strategy=strategy) if row["mode"] in MODES), "")

    return ["frames", "device, lazy stealing", "device, one thread a query", "whole, GPU", "whole, CPU"], [
        [frames.removesuffix("0.ply"), time(frames, "cuda", "lazy_stealing", "ms_device"),
         time(frames, "cuda", "thread_per_query", "ms_device"), time(frames, "cuda", "lazy_stealing", "ms_total"),
         time(frames, "cpu", "lazy_stealing", "ms_total")]
        for frames in distinct(row["scene"] for row in read("gpu/detections.csv"))]


MODES = ("graph", "from the root")  # of the GPU, and of the CPU

STAGES = ["refit", "traverse", "leaf", "narrow", "sort"]


@table("gpu/stages")
def stages():
    return ["frames", "start", *(f"{name}, ms" for name in STAGES), "device memory, MB"], [
        [row["scene"].removesuffix("0.ply"), "root" if "root" in row["mode"] else "front of the last step",
         *(number(row[f"ms_{name}"]) for name in STAGES), count(float(row["peak_bytes"]) / 1e6)]
        for row in read("gpu/stages.csv", backend="cuda", strategy="lazy_stealing")
        if row["mode"].startswith("stages")]


plain("gpu/bounds", "gpu/bounds.csv", [
    ("frames", "scene", text), ("kernel", "kernel", text), ("us", "us", number), ("issue, %", "issue_percent", count),
    ("lanes", "lanes", number), ("L1 hits, %", "l1_hit_percent", count),
    ("L1 wavefronts, %", "l1_wavefront_percent", count), ("L2, MB", "l2_megabytes", number),
    ("registers", "registers", text), ("largest stalls, cycles", "largest_stalls", text)],
    keep=lambda row: row["scene"].replace("-", "") == "clothball" and float(row["us"]) >= 5)

plain("gpu/scaling", "gpu/scaling.csv", [
    ("scene", "scene", text), ("worlds", "worlds", count), ("faces", "faces", count), ("contacts", "contacts", count),
    ("whole", "whole_ms", precise), ("on the device", "resident_ms", precise), ("kernels", "device_ms", precise),
    ("rebuild", "rebuild_ms", precise), ("new topology", "new_topology_ms", precise),
    ("kernels, one thread a query", "thread_per_query_device_ms", precise), ("CPU, 16 threads", "cpu_ms", precise),
    ("bytes a face", "bytes_a_face", count)])

plain("gpu/hierarchy", "gpu/hierarchy.csv", [
    ("scene", "scene", text), ("faces", "faces", count), ("device, ms", "device ms", number),
    ("host and upload, ms", "host and upload ms", number),
    ("new topology and first detection, ms", "new topology and first detection ms", number)])

plain("gpu/exact", "gpu/exact.csv", [
    ("scene", "scene", text), ("exact queries", "exact", count), ("device, ms", "device", number),
    ("whole, ms", "whole", number)])

plain("gpu/choice", "gpu/choice.csv", [
    ("motion", "motion", text), ("faces", "faces", count), ("CPU, ms", "cpu_ms", number), ("GPU, ms", "cuda_ms", number),
    ("automatic, ms", "automatic_ms", number), ("over the faster", lambda row: float(row["automatic_over_best"]), ratio),
    ("in the last quarter", lambda row: float(row["late_automatic_over_best"]), ratio),
    ("on the GPU", lambda row: f"{100 * float(row['on_gpu']):.0f} %", text)])


plain("gpu/large_steps", "gpu/large_steps.csv", [
    ("scene", "scene", text), ("detection on", "backend", text), ("0ce9441: step, ms", "before ms", number),
    ("now", "ms", number), ("0ce9441: detection stage, ms", "before detection ms", number),
    ("now", "detection ms", number), ("0ce9441: response, ms", "before response ms", number),
    ("now", "response ms", number)])


@table("gpu/steps")
def steps():
    def span(times):
        return number(min(times)) if min(times) == max(times) else f"{number(min(times))} to {number(max(times))}"

    rows = read("gpu/steps.csv")
    methods = distinct(row["with"] for row in rows)
    lines = []
    for scene, size in distinct((row["scene"], row["size"]) for row in rows):
        own = [row for row in rows if (row["scene"], row["size"]) == (scene, size)]
        alone = next(row for row in own if row["with"] == "Bullet alone")
        lines.append([scene, size] + [span([float(row["ms"]) for row in own if row["with"] == method])
                                      for method in methods] + [count(alone["pass-throughs"])])
    return ["scene", "size", *(f"{method}, ms" for method in methods), "Bullet's pass-throughs"], lines
