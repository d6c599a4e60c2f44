#!/usr/bin/env python3
"""Shows that the assertions that no input can make fail do fail: each by a mutant.

  bash tests/run.sh                           # builds build/quick, with assertions
  python3 tests/assertions/mutants.py [NAME...]

A mutant is one line of code that is put behind a line of a source. All mutants are compiled at once
and linked in front of the libraries; the environment variable LAZYCCD_MUTANT chooses one. Each must end
its test with the text of its assertion. The last result is in README.md.
"""
import json
import os
import pathlib
import shlex
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = ROOT / "build/quick"
WORK = BUILD / "mutants"
MOTION = "reader_.motion()"
RESTS = "cloth comes to rest at its thickness above a mesh and above other cloth"
STRATEGIES = "every strategy finds the same contacts on any number of threads from root and front"
RECHECK = "pairs that touch in a similar motion were near in the first motion"
OPTIONS = "nothing passes through with any solver options"
ZONES = "impact zones are enough without impulses"
NEAR_SWAP = "std::swap(const_cast<Contact&>(near[0]), const_cast<Contact&>(near[1]))"

# Source, the line behind which the mutant stands, its condition beside the name, its code, program, test, what
# must be believed. Names are the keys.
MUTANTS = {
    # The detector.
    "unsorted": ("cuda/cpu/narrow/contact_sort.cpp", "  return hash", "out.size() > 1",
                 "std::swap(out[0], out[1])", "core", STRATEGIES,
                 "a detection returns contacts sorted, none twice"),
    "vertex": ("cuda/cpu/narrow/contact_sort.cpp", "  return hash", "!out.empty()", "out[0].vertices[0] = -1",
               "core", STRATEGIES, "contacts name bodies and primitives of the mesh"),
    "time": ("cuda/cpu/narrow/contact_sort.cpp", "  return hash", "!out.empty()", "out[0].toi = 2", "core",
             STRATEGIES, "times of contacts are within the step"),
    "rechecked": ("cuda/cpu/recheck.cpp", "  stats.ms_total =", "rechecked_.size() > 1",
                  "std::swap(rechecked_[0], rechecked_[1])", "core", RECHECK,
                  "re-checked contacts are sorted, none twice"),
    "last_motion": ("cuda/cpu/recheck.cpp", "  LAZYCCD_ASSERT(last_motion_.size() ==", "true",
                    "last_motion_.pop_back()", "core", RECHECK,
                    "the motion of the last detection is of the same vertices"),
    "counts": ("cuda/cpu/cpu_detector.cpp", "  stats.hash = sort_contacts(out);", "true", "++stats.contacts_vf",
               "core", STRATEGIES, "the workers count the contacts that they return"),
    "distance": ("cuda/cpu/cpu_detector.cpp", "  nearest_ = options_.separation;", "!near_distances_.empty()",
                 "near_distances_[0] = -1", "core", RECHECK,
                 "distances of near pairs are within the separation"),
    "positions": ("cuda/host/scene/positions.cpp", "  double size = 0;", "true", "records.pop_back()", "core",
                  STRATEGIES, "each vertex has a position"),
    "queue": ("cuda/cpu/pending_candidates.cpp", "  std::size_t rest = 0;", "true",
              "workers_[0]->queues[0].count = CandidateQueue::capacity + 1", "core", STRATEGIES,
              "queues of candidates hold what fits"),
    "owner": ("cuda/host/bvh/groups.cpp", "  boxes_.resize(groups_.size());", "true", "++groups_[0].count[kEdges]",
              "core", STRATEGIES, "each face and edge is in one group"),
    "leaf": ("cuda/host/bvh/tree.cpp", "  worlds_ = {};", "nodes_.size() > 2",
             "nodes_.back() = nodes_[nodes_.size() - 2]", "core", STRATEGIES, "each group is one leaf of the tree"),
    "left_over": ("cuda/cpu/strategies/balanced_run.h", "    member.items = items;", "true", "stack.push(Item{})",
                  "core", STRATEGIES, "no item is left when a run ends"),
    # Near contacts.
    "near_order": ("plugin/detection/step_detector.cpp", "    any_near = true;\n  }", "near.size() > 1", NEAR_SWAP,
                   "bullet", RESTS, "near contacts of all sources are sorted, none twice"),
    "near_vertex": ("plugin/detection/step_detector.cpp", "    any_near = true;\n  }", "!near.empty()",
                    "const_cast<Contact&>(near[0]).vertices[0] = -1", "bullet", RESTS,
                    "near contacts are of bodies and vertices of the motion"),
    "select_order": ("plugin/detection/step_detector.cpp",
                     "  counts_.near_pairs += static_cast<std::int64_t>(near.size());", "near.size() > 1", NEAR_SWAP,
                     "bullet", RESTS, "contacts to select from are sorted, none twice"),
    "selected": ("plugin/detection/near_contact_selector.cpp", "  selected_.resize(count);", "count > 1",
                 "std::swap(selected_[0], selected_[1])", "bullet", RESTS,
                 "pairs that were selected in the last step are sorted"),
    "closed_form": ("plugin/obstacles/simple_contacts.cpp", "  std::inplace_merge(", "contacts.size() > 1",
                    "std::swap(contacts[0], contacts[1])", "bullet",
                    "an obstacle that a node starts in is given up, and no other",
                    "contacts in closed form are sorted, none twice"),
    "give_up": ("plugin/obstacles/simple_contacts.cpp", "  soft_bounds_.begin(false);", "true", "give_up(-1)",
                "bullet", "an obstacle that a node starts in is given up, and no other",
                "an obstacle that is given up was handled in closed form"),
    # Rows and islands.
    "merged": ("plugin/response/contact_constraints.cpp", "  while (old < rows_.size()) keep();",
               "merged_.size() > 1", "std::swap(merged_.front(), merged_.back())", "bullet", OPTIONS,
               "merged rows are in the order of their contacts"),
    "active": ("plugin/response/contact_constraints.cpp",
               "  for (const auto& part : parts) found.insert(found.end(), part.begin(), part.end());",
               "found.size() > 1", "std::swap(found.front(), found.back())", "bullet", RESTS,
               "rows that acted are in the order of their contacts"),
    "island": ("plugin/solver/row_islands.cpp", "  selected_.assign(counts.size(), 1);", "rows_.size() > 1",
               "rows_[0] = rows_[1]", "bullet", RESTS, "islands share no row and nothing that rows move"),
    "batch": ("plugin/solver/row_batches.cpp", "  batches_.push_back(open.rows);", "true", "batches_.pop_back()",
              "bullet", RESTS, "each row is in one batch"),
    "pull": ("plugin/solver/contact_solver.cpp", "          unit * static_cast<double>(solved[3]);", "true",
             "row.normal_impulse = -1", "bullet", RESTS, "contacts push"),
    "infinite": ("plugin/solver/contact_solver.cpp", "    for_each_vertex(item, [&](std::int32_t v) {\n      LAZYCCD",
                 "true", "motion.solved[v][0] = std::numeric_limits<double>::infinity()", "bullet", RESTS,
                 "the solver moves nodes to finite positions"),
    "momentum": ("plugin/response/islands.cpp",
                 "  for (const auto& island : islands) result.push_back(island.second);", "!result.empty()",
                 "result.push_back(result[0])", "bullet", RESTS, "islands whose momentum is kept share no body"),
    "member": ("plugin/response/impact_zones.cpp", "  const bool noted = zone_motion_.note_vertices(contact, motion);",
               "true", "join(motion.soft_count(), -1)", "bullet", ZONES,
               "members of zones are nodes and rigid bodies of the motion"),
    "zone": ("plugin/response/impact_zones.cpp", "  std::vector<ImpactZone> zones;", "true",
             "std::reverse(members_.begin(), members_.end())", "bullet", ZONES,
             "a zone begins with its representative"),
    # The scene and the step.
    "unknown": ("plugin/bodies/equation_islands.cpp",
                "  if (!others.bodies.empty()) islands.push_back(std::move(others));", "!islands.empty()",
                "islands.pop_back()", "bullet",
                "bodies that contacts or multipliers connect are one island of the momentum equation",
                "each unknown of the equation is in one island"),
    "new_body": ("plugin/step/scene_numbers.cpp", "    renumber(last[i], now, numbers);", "true",
                 "numbers.bodies[i] = 0", "bullet", "a body added between steps collides, and one removed does not",
                 "no two bodies get one new index"),
    "new_vertex": ("plugin/step/scene_numbers.cpp", "    renumber(last[i], now, numbers);", "true",
                   "numbers.vertices[0] = numbers.vertices[1]", "bullet",
                   "a body added between steps collides, and one removed does not",
                   "no two vertices get one new index"),
    "fits": ("plugin/step/pipeline.cpp", "    StepReader::Changes changes = reader_.read(bodies, dt, fill);", "true",
             MOTION + ".first_vertex.pop_back()", "bullet", RESTS,
             "the motion has all bodies and vertices of the topology"),
    "finite": ("plugin/step/pipeline.cpp", "    StepReader::Changes changes = reader_.read(bodies, dt, fill);", "true",
               MOTION + ".end[0] = std::numeric_limits<btScalar>::infinity()", "bullet", RESTS,
               "what is read of the nodes is finite"),
    "seen": ("plugin/step/pipeline.cpp", "void Pipeline::finish_step() {", "true", MOTION + ".end[1] += 1", "bullet",
             RESTS, "the end of the step is the one that the last detection saw"),
}
# Which sources see a mutant in a header.
UNITS = {"cuda/cpu/strategies/balanced_run.h": "cuda/cpu/cpu_detector.cpp"}
PROGRAMS = {"core": "lazyccd_tests", "bullet": "lazyccd_tests_bullet"}
CHOOSER = """#pragma once
#include <cstdlib>
#include <cstring>
inline bool is_mutant(const char* name) {
  const char* const chosen = std::getenv("LAZYCCD_MUTANT");
  return chosen && std::strcmp(chosen, name) == 0;
}
"""


def write_mutants():
    """Writes the sources with all mutants. A mutant stands behind the whole statement of its line, or before a
    line that returns or asserts."""
    texts = {}
    for name, (path, anchor, condition, code, *_) in MUTANTS.items():
        text = texts.get(path) or (ROOT / path).read_text()
        if text.count(anchor) != 1:
            sys.exit(f"{name}: {path} has {text.count(anchor)} times: {anchor}")
        mutant = f'if (is_mutant("{name}") && {condition}) {code};\n'
        at = text.index(anchor)
        if "\n" in anchor and "LAZYCCD" in anchor:
            at = text.index("\n", at) + 1
        elif not anchor.lstrip().startswith(("return", "LAZYCCD", "stats.ms_total")):
            end = at + len(anchor)
            if anchor.endswith("("):
                end = text.index(";", end) + 1
            at = text.index("\n", end - 1) + 1
        texts[path] = text[:at] + mutant + text[at:]
    for path, text in texts.items():
        (WORK / path).parent.mkdir(parents=True, exist_ok=True)
        (WORK / path).write_text(text)
    (WORK / "chooser.h").write_text(CHOOSER)
    return list(texts)


def compile_units(paths):
    """Compiles the sources as the build does. Returns the objects by folder: cuda or plugin."""
    commands = {entry["file"]: shlex.split(entry["command"])
                for entry in json.loads((BUILD / "compile_commands.json").read_text())}
    objects = {"cuda": [], "plugin": []}
    for unit in dict.fromkeys(UNITS.get(path, path) for path in paths):
        source = WORK / unit
        if not source.exists():
            source.parent.mkdir(parents=True, exist_ok=True)
            source.write_text((ROOT / unit).read_text())
        command = commands[str(ROOT / unit)]
        target = source.with_suffix(".o")
        command[command.index("-o") + 1] = str(target)
        command[command.index("-c") + 1] = str(source)
        command[1:1] = [f"-I{WORK / 'cuda'}", f"-I{WORK / 'plugin'}"]
        subprocess.run(command + ["-include", str(WORK / "chooser.h"), "-Wno-error"], cwd=BUILD, check=True)
        objects[unit.split("/")[0]].append(str(target))
    return objects


def link(program, objects):
    """Links a test program with the mutants in front of the libraries."""
    commands = subprocess.run(["ninja", "-t", "commands", program], cwd=BUILD, check=True, text=True,
                              stdout=subprocess.PIPE).stdout.splitlines()
    command = commands[-1]
    old = f"-o tests/{program} "
    assert command.count(old) == 1, command
    subprocess.run(command.replace(old, f"-o {WORK / program} {' '.join(objects)} "), cwd=BUILD, check=True,
                   shell=True)


def main():
    names = sys.argv[1:] or list(MUTANTS)
    objects = compile_units(write_mutants())
    link("lazyccd_tests", objects["cuda"])
    link("lazyccd_tests_bullet", objects["cuda"] + objects["plugin"])
    failures = 0
    for name in names:
        program, test, belief = MUTANTS[name][-3:]
        run = subprocess.run([WORK / PROGRAMS[program], test.replace(",", "\\,")], cwd=BUILD / "tests", text=True, timeout=600,
                             env={**os.environ, "LAZYCCD_MUTANT": name, "LAZYCCD_QUICK_TESTS": "1"},
                             stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        is_seen = f"LazyCCD: it does not hold that {belief}:" in run.stdout
        failures += not is_seen
        print(f"{'failed as it must' if is_seen else 'NOT SEEN'}: {name}: {belief}", flush=True)
        if not is_seen:
            print(run.stdout[-600:])
    print(f"{len(names) - failures} of {len(names)} mutants are seen")
    sys.exit(failures > 0)


main()
