#!/usr/bin/env python3
"""Tests walkman-hil fault and fault plans from outside. Usage: fault_command_test.py PROGRAM SOURCE_TREE"""

import json
import os
import stat
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from checks import PROGRAM, check, end, run

TREE = Path(sys.argv[2])


def refused(done, what):
    check(done.returncode == 2 and done.stderr.count("\n") == 1, f"{what}: {done.returncode} {done.stderr}")
    return done.stderr


# The 54 names that the emulator is to have, in a few words, and the kinds of fault that are theirs. H3 to H5 are the host's:
# they are listed with what to do instead, and refused.
TAXONOMY = {
    "B1": ("frames dropped by chance", "frame-drop"),
    "B2": ("frames in a row dropped", "frame-burst-loss"),
    "B3": ("frames late, with jitter", "frame-delay"),
    "B4": ("frames sent twice", "frame-duplicate"),
    "B5": ("neighbouring frames swapped", "frame-reorder"),
    "B6": ("bits of a payload flipped past the CRC", "payload-bitflip"),
    "B7": ("payload too short or too long", "wrong-length"),
    "B8": ("flood with a high priority", "babbling-idiot"),
    "B9": ("a node's controller bus-off", "bus-off"),
    "B10": ("controller error-passive or warning", "error-passive"),
    "B11": ("no acknowledgement", "no-acknowledge"),
    "B12": ("network interface down", "interface-down"),
    "B13": ("transmit queue full", "tx-queue-full"),
    "N1": ("heartbeats stop", "heartbeat-loss"),
    "N2": ("reboot during operation", "silent-reboot"),
    "N3": ("node falls to pre-operational", "nmt-preop-drop"),
    "N4": ("burst of emergencies", "emergency-storm"),
    "N5": ("object refused with an abort code", "sdo-abort"),
    "N6": ("no answer to a request, or a wrong toggle bit", "sdo-timeout", "sdo-toggle-error"),
    "N7": ("another identity", "wrong-identity"),
    "N8": ("second node with the same ID", "duplicate-node"),
    "N9": ("firmware hangs, PDOs repeat", "pdo-frozen"),
    "N10": ("node's clock drifts", "clock-drift"),
    "S1": ("encoder holds its value", "encoder-stuck"),
    "S2": ("encoder jumps in operation", "encoder-offset"),
    "S3": ("encoder off from the start", "encoder-offset"),
    "S4": ("force/torque zero drifts", "ft-bias-drift"),
    "S5": ("force/torque axes swapped or reversed", "ft-swap", "ft-sign"),
    "S6": ("force/torque readings clipped", "ft-saturation"),
    "S7": ("more noise in force/torque readings", "ft-noise"),
    "S8": ("torque reading lost", "torque-dropout"),
    "S9": ("temperature rises", "temperature-high"),
    "A1": ("less torque than asked for", "torque-loss"),
    "A2": ("joint does not move", "joint-locked"),
    "A3": ("brake released in part", "brake-drag"),
    "A4": ("drive trips with over-current", "overcurrent-trip"),
    "A5": ("supply too low for several drives", "undervoltage"),
    "A6": ("motor ignores its set-point", "runaway"),
    "A7": ("play, or another stiffness", "backlash", "compliance-change"),
    "P1": ("no cloud, or an old one", "cloud-missing", "cloud-stale"),
    "P2": ("thin or partly hidden cloud", "cloud-dropout", "cloud-occlusion"),
    "P3": ("camera not where it is thought to be", "extrinsic-error"),
    "P4": ("tilted table", "plane-misfit"),
    "P5": ("points of nothing", "phantom-points"),
    "X1": ("centre of mass moves in the lift", "weight-removed"),
    "X2": ("object slips", "slip"),
    "X3": ("object too heavy", "payload"),
    "X4": ("push from outside", "push"),
    "H1": ("control program not run for a while", "scheduler-stall"),
    "H2": ("control program killed", "driver-kill"),
    "H3": ("no space for the log", "log-disk-full"),
    "H4": ("wall clock jumps", "clock-step"),
    "H5": ("damaged file", "config-corrupt"),
    "H6": ("another master on the bus", "rogue-master"),
}
NAMES_OF_A_LETTER = {"B": 13, "N": 10, "S": 9, "A": 7, "P": 5, "X": 4, "H": 6}


def taxonomy(listed):
    for letter, count in NAMES_OF_A_LETTER.items():
        missing = [f"{letter}{i}" for i in range(1, count + 1) if f"{letter}{i}" not in TAXONOMY]
        check(not missing, f"without a kind: {missing}")
    check(len(TAXONOMY) == 54, f"{len(TAXONOMY)} names")
    known = {kind["fault"] for kind in listed}
    for name, (what, *of_it) in TAXONOMY.items():
        check(of_it and known.issuperset(of_it), f"{name}, {what}: {of_it} are listed")


def kinds():
    listed = json.loads(run("fault", "list", "--json").stdout)["faults"]
    taxonomy(listed)
    text = run("fault", "list").stdout
    for kind in listed:
        check(kind["fault"] in text, f"{kind['fault']} is in the text, too")
        check(kind["seen"] and kind["what"] and kind["target"], f"{kind['fault']} says what it is")
        for parameter in kind["parameters"]:
            check(parameter["least"] <= parameter["standard"] <= parameter["most"], f"{kind['fault']} {parameter}")
    return listed


def head(file):
    with open(file) as log:
        return log.readline()


def plans(folder):
    wrong = {
        "faults:\n  - fault: joint-loked\n    target: RElbj\n    at_s: 1\n": ":2: ",
        "faults:\n  - fault: joint-locked\n    target: RElb\n    at_s: 1\n": "did you mean \"RElbj\"",
        "faults:\n  - fault: joint-locked\n    target: r_arm_ft\n    at_s: 1\n": "is not a drive",
        "faults:\n  - fault: joint-locked\n    target: RElbj\n": "at_s, in_phase, on_frame, when given",
        "faults:\n  - {fault: joint-locked, target: RElbj, on_frame: {bus: rarn, id: 0x18E}}\n": "no bus \"rarn\"",
        "faults:\n  - {fault: joint-locked, target: RElbj, when: {device: RElb, above: 1}}\n": "\"RElb\"",
        "faults:\n  - {fault: joint-locked, target: RElbj, when: {device: RElbj}}\n": "either above or below",
        "faults:\n  - fault: joint-locked\n    target: RElbj\n    in_phase: {phase: lit}\n": "did you mean \"lift\"",
        "faults:\n  - fault: frame-drop\n    target: rarm\n    at_s: 1\n    share: 1.5\n": ":5: ",
        "faults:\n  - fault: babbling-idiot\n    target: rarm\n    at_s: 1\n    id: 1.7\n": "expected a whole number",
        "faults:\n  - fault: frame-drop\n    target: rarm\n    at_s: 1\n    torque: 1\n": "no such parameter",
        "faults:\n  - fault: frame-drop\n    target: rarm\n    at_s: 1\n    every_s: 1\n": "lasts_s",
        "faults:\n  - fault: cloud-missing\n    target: RElbj\n    at_s: 1\n": "no target",
        "faults: 3\n": "faults",
        "faults:\n  - {fault: cloud-missing, name: a, at_s: 0}\n  - {fault: cloud-missing, name: a, at_s: 1}\n": "\"a\"",
    }
    for text, expected in wrong.items():
        plan = folder / "plan.yaml"
        plan.write_text(text)
        message = refused(run("experiment", "1", "--faults", str(plan), "--out", str(folder / "out")), text)
        check("plan.yaml" in message and expected in message, f"{expected!r} in {message!r}")
    refused(run("experiment", "1", "--faults", str(folder / "none.yaml")), "a plan that is not there")
    check(not (folder / "out").exists(), "nothing was run or written")

    plan = folder / "phase.yaml"
    plan.write_text("faults:\n  - {fault: cloud-missing, in_phase: {phase: lift}}\n")
    refused(run("emulate", "--duration", "1", "--faults", str(plan)), "an emulator knows no phases")

    plan.write_text("faults:\n  - {fault: encoder-stuck, target: RShSag, at_s: 0}\n")
    message = refused(run("emulate", "--duration", "1", "--only", "RElbj,r_arm_ft", "--faults", str(plan)),
                      "a node that another program provides")
    check("RShSag is not emulated here" in message, message)

    plan.write_text("faults:\n  - {fault: frame-drop, target: RElbj, at_s: 0}\n")
    done = run("emulate", "--duration", "1.2", "--faults", str(plan), "--json")
    [fault] = json.loads(done.stdout)["faults"]
    check(fault["times"] == 1 and fault["target"] == "RElbj" and fault["fault"] == "frame-drop", f"{fault}")
    check("fault frame-drop of RElbj: began 1 time, first at 0.000 s" in run("emulate", "--duration", "1.2", "--faults",
                                                                            str(plan)).stdout, "the summary tells of it, too")

    mine = folder / "mine.yaml"
    mine.write_text("mine")
    done = run("emulate", "--duration", "1", "--fault-socket", str(mine))
    check(done.returncode == 3 and "is not a socket" in done.stderr and mine.read_text() == "mine",
          f"a file of the user's stays: {done.returncode} {done.stderr}")

    out = folder / "jammed"
    plan = TREE / "examples/faults/elbow_jams_in_the_lift.yaml"
    done = run("experiment", "1", "--faults", str(plan), "--json", "--out", str(out))
    check(done.returncode == 1, f"a jammed elbow fails the experiment: {done.returncode} {done.stderr}")
    result = json.loads(done.stdout)["repetitions"][0]
    check(result["outcome"] == "stopped" and "RElbj" in result["reason"] and "does not follow" in result["reason"],
          f"it stopped for the elbow: {result['outcome']} {result.get('reason')}")
    jam, drops = result["faults"]
    check(head(out / "can.log") == "# INJECTED FAULTS: joint-locked of RElbj, frame-drop of larm\n", "the log's head says so")
    check(jam["times"] == 1 and drops["frames"] > 100, f"both were there: {jam} {drops}")


def standing_offsets(folder):
    """An encoder with an offset from the start is detected before the robot reaches for anything, on either side of the
    spring."""
    for joint, side in (("RElbj", 0), ("RElbj", 1), ("NeckYawj", 0), ("RHipYaw", 0)):
        plan = folder / "offset.yaml"
        plan.write_text("faults:\n  - {fault: encoder-offset, target: %s, side: %d, offset: 0.05, at_s: 0}\n" % (joint, side))
        done = run("experiment", "1", "--faults", str(plan), "--json", "--out", str(folder / "offset"))
        result = json.loads(done.stdout)["repetitions"][0]
        check(done.returncode == 1 and result["outcome"] == "stopped" and
              f"joint {joint}: according to its encoders" in result["reason"],
              f"{joint}, side {side}: {done.returncode} {result['outcome']} {result.get('reason')}")


def live(folder):
    socket = folder / "faults.sock"
    log = folder / "live.log"
    emulator = subprocess.Popen([PROGRAM, "emulate", "--camera", "127.77.3.1", "--fault-socket", str(socket), "--log", str(log)],
                                stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    try:
        for _ in range(200):
            if socket.exists():
                break
            time.sleep(0.05)
        check(stat.S_IMODE(os.stat(socket).st_mode) == 0o600, "its owner alone may write to the socket")
        at = ("--socket", str(socket))
        done = run("fault", "inject", "RElbj", "encoder-stuck", "--for", "250ms", *at)
        check(done.stdout == "RElbj-encoder-stuck\n", f"a fault is told by its name: {done.stdout} {done.stderr}")
        check(run("fault", "inject", "frame-drop", "rarm", "share=0.5", *at).returncode == 0, "in either order")
        states = {}
        for _ in range(100):
            states = {one["name"]: one for one in json.loads(run("fault", "active", *at).stdout)["active"]}
            if states["RElbj-encoder-stuck"]["stage"] == "over":
                break
            time.sleep(0.05)
        check(states["RElbj-encoder-stuck"]["stage"] == "over", f"it is over after its time: {states}")
        check(states["rarm-frame-drop"]["stage"] == "active", f"and the other is not: {states}")
        done = run("fault", "inject", "RElbj", "encoder-stuck", "--for", "60s", *at)
        check(done.returncode == 0, f"one that is over may come again: {done.stderr}")
        check("already exists" in refused(run("fault", "inject", "RElbj", "encoder-stuck", *at), "one that is not over"),
              "and why is told")
        joints = ("ShSag", "ShLat", "ShYaw", "Elbj", "ForearmPlate", "Wrj1", "Wrj2")
        for joint in [side + name for side in "RL" for name in joints]:
            for kind in ("frame-drop", "frame-delay", "frame-duplicate", "frame-reorder", "payload-bitflip", "wrong-length"):
                done = run("fault", "inject", joint, kind, "share=0", *at)
                check(done.returncode == 0, f"{joint} {kind}: {done.stderr}")
        check(len(json.loads(run("fault", "active", *at).stdout)["active"]) == 86, "all that are active are listed")
        check(run("fault", "clear", "all", *at).stdout == "86 cleared\n", "all are cleared")
        refused(run("fault", "clear", "rarm-frame-drop", *at), "there is nothing to clear")
        refused(run("fault", "inject", "RElbj", "encoder-stuk", *at), "an unknown fault")
        refused(run("fault", "inject", "RElb", "encoder-stuck", *at), "an unknown device")
        refused(run("fault", "inject", "RElbj", "encoder-stuck", "--for", "soon", *at), "no time")
        check("ip link" in refused(run("fault", "inject", "rarm", "interface-down", *at), "what is the host's"),
              "and what to do instead is told")
        check(json.loads(run("fault", "active", *at).stdout) == {"active": []}, "nothing of that is there")
    finally:
        emulator.terminate()
        told = emulator.communicate(timeout=30)[1]
    check("faults are accepted" in told and "fault injected: RElbj encoder-stuck" in told, f"the emulator tells: {told}")
    check(head(log) == "# INJECTED FAULTS: any sent through the fault socket\n", "the log's head says that there may have been some")
    check(not socket.exists(), "the socket goes with the emulator")
    done = run("fault", "active", "--socket", str(socket))
    check(done.returncode == 3 and done.stderr.count("\n") == 1, "without an emulator one sentence says so")


def part_of_a_bus():
    """Nodes that are not emulated are silent; all others are present."""
    def booted(*options):
        done = run("emulate", "--camera", "127.77.3.2", "--duration", "0.5", "--json", *options)
        check(done.returncode == 0, f"{options}: {done.stderr}")
        buses = json.loads(done.stdout)["buses"]
        return {bus["name"]: bus["nodes"] for bus in buses}, done.stderr

    everything, _ = booted()
    some, told = booted("--only", "RElbj,r_arm_ft,larm")
    check(some == {**{name: 0 for name in everything}, "rarm": 2, "larm": everything["larm"]}, f"{some}")
    check(f"ready, {2 + everything['larm']} nodes" in told, f"those have booted: {told}")
    rest, _ = booted("--without", "RElbj,torso")
    check(rest == {**everything, "rarm": everything["rarm"] - 1, "torso": 0}, f"{rest}")
    check('did you mean "RElbj"' in refused(run("emulate", "--only", "RElb"), "an unknown device"), "its name is told")
    refused(run("emulate", "--only", "rarm,RElbj"), "a device that is there twice")
    refused(run("emulate", "--only", "rarm", "--without", "larm"), "both at once")


def main():
    listed = kinds()
    page = (TREE / "docs/faults.md").read_text()
    check(run("fault", "list", "--markdown").stdout in page, "docs/faults.md has the table of fault list --markdown")
    shown = page[page.index("## What the drivers show"):]
    rows = [line.split("|")[1] for line in shown.splitlines() if line.startswith("| `")]
    for kind in listed:
        check(any(f"`{kind['fault']}`" in row for row in rows), f"docs/faults.md has {kind['fault']}")
    with tempfile.TemporaryDirectory() as folder:
        plans(Path(folder))
        standing_offsets(Path(folder))
        live(Path(folder))
    part_of_a_bus()
    end()


main()
