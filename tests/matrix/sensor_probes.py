#!/usr/bin/env python3
"""Runs Experiment 1 with wrong wrist sensors of various kinds, with a weight that comes off in the lift, with a bar that becomes
slippery, and on a table that is not level, and judges each run by the plant's ground truth.

A probe is right if the run still reaches a correct result, or stops with a fitting reason. It fails if the run ends as a
success that the ground truth contradicts, falls, touches what it should not, or stops for another reason. The exit code is
0 if all are right.
"""

import argparse
import concurrent.futures
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

import scenes

SENSOR = "r_arm_ft"
FROM_BOOT = "at_s: 0.5"
COM_ERROR = 0.02  # m, the method's d_thres
DRIFTS = "drift|is not steady|contradict"
EMPTY_HAND = "empty hand contradict"  # before anything is lifted
LIES = "contradict|are off|weighs|is not steady|drift|beside|to one side|holds nothing|object turns|outside of the object|off the vertical"


def event(text):
    return lambda urdf, folder: ["--scene", written(folder / "scene.yaml", f"extends: {urdf / 'scenes/experiment_1.yaml'}\n"
                                                    f"events:\n  - {text}\n")]


def fault(text):
    return lambda urdf, folder: ["--faults", written(folder / "faults.yaml", f"faults:\n  - {text}\n")]


def table(**angles):
    return lambda urdf, folder: ["--scene", scenes.write_scene(scenes.Case("", **angles), urdf, folder)]


def written(file, text):
    file.write_text(text)
    return file


def lie(name, when, what, reasons):
    return name, event(f"{when}\n    sensor_fault: {{sensor: {SENSOR}, {what}}}"), reasons


GRASP = "in_phase: {phase: grasp}"
LIFT = "in_phase: {phase: lift}"
LAST_GRASP = "in_phase: {phase: grasp, occurrence: 2}"
LAST_LIFT = "in_phase: {phase: lift, occurrence: 2}"
# Name, arguments of `experiment`, and what a stop may report.
PROBES = [
    lie("drift 0.02 N·m/s, all torques", GRASP, "drift_per_s: [0, 0, 0, 0.02, 0.02, 0.02]", DRIFTS),
    lie("drift 0.05 N·m/s, all torques", GRASP, "drift_per_s: [0, 0, 0, 0.05, 0.05, 0.05]", DRIFTS),
    lie("drift 0.02 N·m/s, Tx", GRASP, "drift_per_s: [0, 0, 0, 0.02, 0, 0]", DRIFTS),
    lie("drift 0.02 N·m/s, Ty", GRASP, "drift_per_s: [0, 0, 0, 0, 0.02, 0]", DRIFTS),
    lie("drift 0.05 N·m/s, Tx", GRASP, "drift_per_s: [0, 0, 0, 0.05, 0, 0]", DRIFTS),
    lie("drift 0.05 N·m/s, Ty", GRASP, "drift_per_s: [0, 0, 0, 0, 0.05, 0]", DRIFTS),
    lie("gain 1.3", FROM_BOOT, "gain: [1.3, 1.3, 1.3, 1.3, 1.3, 1.3]", EMPTY_HAND),
    lie("gain 1.3 of the torques", FROM_BOOT, "gain: [1, 1, 1, 1.3, 1.3, 1.3]", EMPTY_HAND),
    lie("sign of Fz", FROM_BOOT, "gain: [1, 1, -1, 1, 1, 1]", EMPTY_HAND),
    lie("sign of Tx", FROM_BOOT, "gain: [1, 1, 1, -1, 1, 1]", EMPTY_HAND),
    lie("sign of Ty", FROM_BOOT, "gain: [1, 1, 1, 1, -1, 1]", EMPTY_HAND),
    lie("Tx and Ty swapped", FROM_BOOT, "swap: [Tx, Ty]", EMPTY_HAND),
    lie("Fx and Fz swapped", FROM_BOOT, "swap: [Fx, Fz]", EMPTY_HAND),
    lie("bit 6 of Ty flips in 5 %", FROM_BOOT, "bit: {channel: Ty, number: 6, flipped_share: 0.05}", LIES),
    lie("bit 7 of Tx sticks in the lift", LIFT, "bit: {channel: Tx, number: 7, stuck_at: 1}", LIES),
    lie("bit 7 of Ty sticks in the lift", LIFT, "bit: {channel: Ty, number: 7, stuck_at: 1}", LIES),
    # After the last lift nothing is released any more, which would show a drift or an offset.
    *[lie(f"drift {rate} N·m/s in the last lift, {axes}", LAST_GRASP, f"drift_per_s: [0, 0, 0, {torques.format(rate)}]", DRIFTS)
      for rate in (0.003, 0.008) for axes, torques in (("Tx", "{0}, 0, 0"), ("Ty", "0, {0}, 0"), ("all", "{0}, {0}, {0}"))],
    *[lie(f"bit {bit} of {axis} sticks in the last lift", LAST_LIFT, f"bit: {{channel: {axis}, number: {bit}, stuck_at: 1}}", LIES)
      for bit in (4, 5, 6, 7) for axis in ("Tx", "Ty")],
]
PROBES += [(f"{side} weight off {after} s into the lift",  # while the hand takes up the load, and while it rises
            event(f"in_phase: {{phase: lift, after_s: {after}}}\n    remove_weight: {{object: bar, weight: {side}_weight}}"),
            "turns|is not steady|contradict|weighs") for side in ("left", "right") for after in (1, 4)]
PROBES += [(f"{100 * share:g} % of the friction in the {phase}",
            fault(f"{{fault: slip, target: bar, friction: {share}, in_phase: {{phase: {phase}, after_s: 1}}}}"), "slip|turns")
           for share in (0.05, 0.3) for phase in ("lift", "weigh")]
PROBES += [("table's far edge 0.06 rad up", table(tilt=0.06), "table"),
           ("table's near edge 0.06 rad up", table(tilt=-0.06), "table"),
           ("table's left side 0.06 rad up", table(slope=0.06), "table"),
           ("table's right side 0.06 rad up", table(slope=-0.06), "table")]


def run(program, urdf, probe, seed, folder):
    folder.mkdir(parents=True)
    done = subprocess.run([program, "experiment", "1", *probe[1](urdf, folder), "--seed", str(seed), "--model-error", "calibrated",
                           "--json", "--out", folder / "out"], capture_output=True, text=True, check=False)
    shutil.rmtree(folder)
    try:
        return json.loads(done.stdout)["repetitions"][0]
    except (json.JSONDecodeError, KeyError, IndexError):
        return {"outcome": "crash", "reason": done.stderr.strip()[-300:]}


def verdict(probe, r):
    for damage in r.get("touches", []) + r.get("limits", []):
        return "WRONG", damage
    if r["outcome"] == "stopped":
        return ("stopped" if re.search(probe[2], r["reason"]) else "OTHER"), r["reason"]
    if r["outcome"] in ("minimum torque", "minimum displacement") and abs(r["d_after_true"]) <= COM_ERROR:
        return "right", f"held {1e3 * abs(r['d_after_true']):.1f} mm from the centre of mass"
    return "WRONG", f"{r['outcome']}: {r.get('reason', '')}"


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("program", type=pathlib.Path)
    parser.add_argument("urdf", type=pathlib.Path, help="folder with walkman.robot.yaml")
    parser.add_argument("--only", default="", help="regular expression of names")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=len(os.sched_getaffinity(0)))
    options = parser.parse_args()
    probes = [p for p in PROBES if re.search(options.only, p[0])]
    failed = 0
    print("| wrist sensor | verdict | |\n|---|---|---|", flush=True)
    with tempfile.TemporaryDirectory() as scratch, concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        def one(numbered):
            i, probe = numbered
            return run(options.program.resolve(), options.urdf.resolve(), probe, options.seed, pathlib.Path(scratch) / str(i))
        for probe, r in zip(probes, pool.map(one, enumerate(probes))):
            word, why = verdict(probe, r)
            failed += word in ("WRONG", "OTHER")
            print(f"| {probe[0]} | {word} | {why} |", flush=True)
    return 0 if failed == 0 else 1


if __name__ == "__main__":
    sys.exit(main())
