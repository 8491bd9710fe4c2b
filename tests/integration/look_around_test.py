#!/usr/bin/env python3
"""Tests look: around, by whole runs: the visual centre of mass against the centroid of the object's volume.
Usage: look_around_test.py PROGRAM FOLDER [EXPERIMENT...] [--seeds N], FOLDER with parameters.yaml and look_around.yaml

Prints a table: the error of looking once and of looking around (mm), for each experiment and seed. Exit code 1 if any
error of looking around is more than half of the other, or if a run that looks around does not end with the object held."""

import argparse
import concurrent.futures
import json
import subprocess
import sys
import tempfile


def repetition(program, experiment, seed, parameters):
    with tempfile.TemporaryDirectory() as folder:
        command = [program, "experiment", str(experiment), "--seed", str(seed), "--out", folder, "--json",
                   "--parameters", parameters]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if not done.stdout:
            sys.exit(f"experiment {experiment}, seed {seed}: {done.stderr}")
        return json.loads(done.stdout)["repetitions"][0]


def main():
    asked = argparse.ArgumentParser()
    asked.add_argument("program")
    asked.add_argument("folder")
    asked.add_argument("experiments", nargs="*", type=int, default=[1, 6, 10, 11])
    asked.add_argument("--seeds", type=int, default=1)
    asked = asked.parse_args()
    cases = [(e, s) for e in asked.experiments for s in range(1, asked.seeds + 1)]
    good = True
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        # In both cases the head may turn to an object that is cut off by the image's border.
        once = [pool.submit(repetition, asked.program, e, s, f"{asked.folder}/parameters.yaml") for e, s in cases]
        around = [pool.submit(repetition, asked.program, e, s, f"{asked.folder}/look_around.yaml") for e, s in cases]
        print("experiment  seed    once  around  outcome of around")
        for (experiment, seed), a, b in zip(cases, once, around):
            a, b = a.result(), b.result()
            errors = [1e3 * r["visual_com_error"] for r in (a, b)]
            print(f"{experiment:10d} {seed:5d} {errors[0]:7.1f} {errors[1]:7.1f}  {b['outcome']}", flush=True)
            good = good and errors[1] <= 0.5 * errors[0] and b["outcome"].startswith("minimum ")
    sys.exit(not good)


main()
