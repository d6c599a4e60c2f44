"""Counts the errors of a valgrind XML file that have LazyCCD's libraries in their stack: memory_report.py FILE."""

import collections
import sys
import xml.etree.ElementTree as tree

OURS = ("liblazyccd_pybullet", "lazyccd/_native")
# server_world.cpp compares all words of the server's data before and after a call, also those that were never set.
MEANT = ("lazyccd::pybullet::find_world(",)
# Python 3.13 keeps the names of functions and arguments, once each, to the end of the process.
NAMES = "PyUnicode_InternFromString"


def main():
    ours, others, meant = collections.Counter(), 0, 0
    for error in tree.parse(sys.argv[1]).getroot().iter("error"):
        frames = error.findall("stack")[0].findall("frame")
        places = [frame.findtext("obj") or "" for frame in frames]
        if not any(name in place for place in places[:12] for name in OURS):
            others += 1
            continue
        functions = [frame.findtext("fn") or "" for frame in frames]
        if functions[0].startswith(MEANT) or NAMES in functions:
            meant += 1
            continue
        stack = [f"{frame.findtext('fn')} ({frame.findtext('file')}:{frame.findtext('line')})" for frame in frames[:8]]
        ours[error.findtext("kind") + "\n    " + "\n    ".join(stack)] += 1
    for text, count in ours.most_common():
        print(f"{count} x {text}")
    print(f"{sum(ours.values())} errors in LazyCCD's libraries, {meant} that are meant, {others} elsewhere")
    sys.exit(bool(ours))


main()
