#!/usr/bin/env python3
"""Runs the method on variations of Experiment 1's scene and judges each one by the plant's ground truth.

held: the object is weighed correctly (centre of mass within 5 mm) and hangs with at least 95 % less torque than at the
first grasp, or was near enough at once. short: the torque is reduced by less. Torque about the handle's own axis, which
no place along the handle changes, is listed separately. refused: the scene is known to be too demanding, and was refused
for that reason. stopped: any other end before the last weighing. wrong: a success that the ground truth contradicts.
The exit code is 0 if all are held or refused.
"""

import argparse
import concurrent.futures
import json
import math
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

import scenes

COM_ERROR = 0.005  # m
REDUCTION = 95  # per cent
NEAR_ENOUGH = 0.02  # m, the method's d_thres


def run(program, urdf, case, level, seed, folder):
    scene = scenes.write_scene(case, urdf, folder)
    done = subprocess.run([program, "experiment", "1", "--scene", scene, "--seed", str(seed), "--model-error", level,
                           "--json", "--out", folder / "out"],
                          capture_output=True, text=True, check=False)
    shutil.rmtree(folder)  # its CAN log takes hundreds of MB
    try:
        return json.loads(done.stdout)["repetitions"][0]
    except (json.JSONDecodeError, KeyError, IndexError):
        return {"outcome": "crash", "reason": done.stderr.strip()[-300:], "regrasps": 0}


def reduction(r):
    """Reduction of the true torque that depends on the place along the handle, per cent."""
    across = lambda suffix: math.sqrt(max(0, r[f"tau{suffix}_true"]**2 - r[f"tau_about_handle{suffix}_true"]**2))
    return 100 * (1 - across("_after") / across(""))


def weighing_error(r):
    """Error of the last weighing's centre of mass relative to the hand, m."""
    return r["d_after"] - r["d_after_true"]


def verdict(case, r):
    """Returns "held", "short", "refused", "stopped" or "wrong", and the reason."""
    if r["outcome"] == "stopped":
        for damage in r.get("touches", []) + r.get("limits", []):
            return "wrong", f"before it stopped: {damage}"
        return ("refused" if re.search(case.refusal or "$^", r["reason"]) else "stopped"), r["reason"]
    if r["outcome"] not in ("minimum torque", "minimum displacement"):
        return "wrong", f"{r['outcome']}: {r.get('reason', '')}"
    if abs(weighing_error(r)) > COM_ERROR:
        return "wrong", f"centre of mass {1e3 * weighing_error(r):+.1f} mm off"
    if r["regrasps"] == 0 and abs(r["d_true"]) <= NEAR_ENOUGH:
        given_up = sum("grasped nearer" in warning for warning in r.get("warnings", []))
        at = f"after {given_up} lift{'s' * (given_up > 1)} given up" if given_up else "at once"
        return "held", f"{at} {1e3 * abs(r['d_true']):.0f} mm from the centre of mass"
    if r["regrasps"] == 0:
        return "short", f"no regrasp {1e3 * abs(r['d_true']):.0f} mm from the centre of mass"
    if reduction(r) < REDUCTION:
        return "short", f"{reduction(r):.1f} % less torque"
    return "held", f"{reduction(r):.1f} % less torque"


def line(case, level, r):
    word, why = verdict(case, r)
    number = lambda key, scale, digits: f"{scale * r[key]:.{digits}f}" if isinstance(r.get(key), float) else ""
    error = f"{1e3 * weighing_error(r):.1f}" if isinstance(r.get("d_after"), float) else ""
    cells = [case.name, level, word, number("f_g", 1, 1), number("tau_true", 1, 3), number("tau_after_true", 1, 3),
             number("tau_about_handle_after_true", 1, 3), error, number("com_error", 1e3, 1),
             str(r.get("regrasps", "")), number("simulated_seconds", 1, 0), why]
    return "| " + " | ".join(cells) + " |"


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("program", type=pathlib.Path)
    parser.add_argument("urdf", type=pathlib.Path, help="folder with walkman.robot.yaml")
    parser.add_argument("--model-error", nargs="*", default=["none", "calibrated"])
    parser.add_argument("--drawn", type=int, default=0, help="number of additional scenes in which everything differs at once")
    parser.add_argument("--only", default="", help="regular expression of names")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=len(os.sched_getaffinity(0)))
    options = parser.parse_args()
    cases = [c for c in scenes.one_at_a_time() + scenes.beyond() + scenes.drawn(options.drawn, options.seed)
             if re.search(options.only, c.name)]
    runs = [(case, level) for case in cases for level in options.model_error]
    counts = {}
    print("| scene | model error | verdict | f, N | τ, N·m | τ′, N·m | about the handle | CoM error, mm | in the room | "
          "regrasps | s | |")
    print("|---|---|---|---|---|---|---|---|---|---|---|---|", flush=True)
    with tempfile.TemporaryDirectory() as scratch, concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        def one(numbered):
            i, (case, level) = numbered
            return run(options.program.resolve(), options.urdf.resolve(), case, level, options.seed,
                       pathlib.Path(scratch) / str(i))
        for (case, level), r in zip(runs, pool.map(one, enumerate(runs))):
            counts[verdict(case, r)[0]] = counts.get(verdict(case, r)[0], 0) + 1
            print(line(case, level, r), flush=True)
    print("\n" + ", ".join(f"{n} {word}" for word, n in sorted(counts.items())) + f" of {len(runs)}")
    return 0 if set(counts) <= {"held", "refused"} else 1


if __name__ == "__main__":
    sys.exit(main())
