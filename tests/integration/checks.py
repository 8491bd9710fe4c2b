"""Common to the tests of the command line: PROGRAM is their first argument."""

import subprocess
import sys

PROGRAM = sys.argv[1]
_failed = []


def check(holds, what):
    if not holds:
        print("FAILED:", what)
        _failed.append(what)


def run(*arguments):
    return subprocess.run([PROGRAM, *arguments], capture_output=True, text=True, check=False)


def end():
    sys.exit(len(_failed) != 0)
