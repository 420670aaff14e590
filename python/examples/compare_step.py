"""Times a training step of fit_image in C++ and in Python, by turns, so that a busy machine slows both.

    python3 compare_step.py FIT_IMAGE [TURNS]     # the program of examples/fit_image.cpp; default: 9 turns
"""

import statistics
import subprocess
import sys
from pathlib import Path

if len(sys.argv) < 2:
    sys.exit("usage: compare_step.py FIT_IMAGE [TURNS]   # FIT_IMAGE: the program of examples/fit_image.cpp")
COMMANDS = {"C++": [sys.argv[1]], "Python": [sys.executable, str(Path(__file__).with_name("fit_image.py"))]}
TURNS = int(sys.argv[2]) if len(sys.argv) > 2 else 9


def step_time(command):
    """The milliseconds of a step, from the last line "PSNR 40.0 dB, 1.000 ms a step"."""
    printed = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    return float(printed.split()[-4])


times = {name: [] for name in COMMANDS}
for turn in range(TURNS):
    for name in sorted(COMMANDS, reverse=turn % 2 == 1):  # who is first changes
        times[name].append(step_time(COMMANDS[name]))
    print(f"turn {turn + 1}: " + ", ".join(f"{name} {times[name][-1]:.3f} ms" for name in COMMANDS))
for name in COMMANDS:
    print(f"{name}: median {statistics.median(times[name]):.3f} ms a step")
ratios = [p / c for p, c in zip(times["Python"], times["C++"])]
print(f"Python to C++: median {statistics.median(ratios):.3f} of {TURNS} turns, {min(ratios):.3f} to {max(ratios):.3f}")
