"""The name of this machine, as results name it."""
import os
import re
import subprocess
from pathlib import Path


def machine():
    """GPUs, the processor and the number of its cores."""
    lines = Path("/proc/cpuinfo").read_text().splitlines()
    cpu = next(line.split(":")[1].strip() for line in lines if line.startswith("model name"))
    cpu = re.sub(r"\((R|TM)\)| Processor.*| CPU.*| @.*", "", cpu)
    try:
        names = subprocess.run(["nvidia-smi", "--query-gpu=name", "--format=csv,noheader"], capture_output=True,
                               text=True).stdout.splitlines()
    except FileNotFoundError:
        names = []
    return ", ".join([*dict.fromkeys(names), f"{cpu}, {os.cpu_count()} cores"])
