#!/usr/bin/env python3
"""What becomes of faults that drivers cannot see (camera, force/torque sensors, objects), and of those it recovers from, in whole
runs. Usage: PROGRAM SOURCE_TREE

A small campaign, whose checker has ground truth: without a fault the task is done and nothing is shown; with one it is shown
where and as docs/faults.md says, and the robot stands still with the object down, or the task is done and what is reported is
true. Never is it wrong, nor does anything pass a limit."""

import json
import re
import sys
import tempfile
from pathlib import Path

from checks import check, end, run

TREE = Path(sys.argv[2])

# A run that ends at its first weighing: the method takes whatever torque there is.
SCENE = "extends: %s\nparameters: parameters.yaml\n"
PARAMETERS = "stage_two:\n  torque_threshold: 50\n"
STOPPED, DONE = {"safe-stop"}, {"masked", "degraded", "recovered"}
RECOVERED = {"degraded", "recovered"}
CLOUD_WAIT, CYCLE = 5.0, 0.005  # s: how long the method waits for a cloud
# Fault as a plan has it, what may come of it, what is said, and by when: s from its beginning, or the phase in which a run ends.
CASES = (
    ("fault: cloud-missing, phases: [{phase: look}]", STOPPED, "no cloud from the camera for 5 s", CLOUD_WAIT + 2 * CYCLE),
    ("fault: cloud-stale, phases: [{phase: look}]", STOPPED, "no cloud from the camera for 5 s", CLOUD_WAIT + 2 * CYCLE),
    ("fault: cloud-occlusion, from: 0.5, to: 1, phases: [{phase: look}]", STOPPED, "outside of the object seen", "lower"),
    ("fault: cloud-dropout, share: 0.5, phases: [{phase: look}]", DONE, None, "watch"),
    ("fault: extrinsic-error, shift: 0.02, phases: [{phase: look}]", DONE, None, "watch"),
    ("fault: plane-misfit, tilt: 0.06, phases: [{phase: look}]", STOPPED, "meets something that was not seen", "grasp"),
    ("fault: phantom-points, phases: [{phase: look}]", DONE, None, "watch"),
    ("fault: payload, targets: [bar], mass: 8, phases: [{phase: grasp}]", STOPPED, "too heavy", "lower"),
    ("fault: ft-saturation, targets: [r_arm_ft], phases: [{phase: lift}]", STOPPED, "no weight hanging there could cause", "lower"),
    ("fault: ft-noise, targets: [r_arm_ft], phases: [{phase: lift}]", STOPPED,
     "differs by [0-9.]+ N from|is not steady", "lower"),
    ("fault: ft-swap, targets: [r_arm_ft], phases: [{phase: lift}]", STOPPED,
     "no weight hanging there could cause|that sensor is faulty", "lower"),
    ("fault: ft-sign, targets: [r_arm_ft], axis: 2, phases: [{phase: lift}]", STOPPED,
     "contradict|outside|not in the hand|that sensor is faulty", "lower"),
    ("fault: ft-bias-drift, targets: [r_arm_ft], torque: 0.05, phases: [{phase: lift}]", STOPPED, "is not steady", "lower"),
    ("fault: ft-sign, targets: [l_leg_ft], axis: 2, phases: [{phase: look}]", STOPPED, "the feet's .* sensors measure", 0.15),
    ("fault: ft-gain, targets: [r_leg_ft], gain: 0.7, phases: [{phase: lift}]", STOPPED, "the feet's .* sensors measure", 1.5),
    ("fault: weight-removed, targets: [left_weight], after_s: 3, phases: [{phase: lift}]", DONE, None, "watch"),
    ("fault: slip, targets: [bar], friction: 0.05, after_s: 3, phases: [{phase: lift}]", DONE | STOPPED, None, "watch"),
    ("fault: push, targets: [RSoftHand], y: 40, after_s: 2, lasts_s: 0.3, phases: [{phase: approach}]", DONE,
     "meets something that was not seen", "watch"),
    # At the end of the way, and in the arm's plane: one that meets the arm on its way leaves the waist swinging.
    ("fault: push, targets: [RForearm], y: 0, z: -100, after_s: 4.2, lasts_s: 1, phases: [{phase: approach}]", STOPPED,
     "something touches the arm", 0.5),
    ("fault: push, targets: [RForearm], z: 80, after_s: 4, lasts_s: 0.6, phases: [{phase: lift}]", STOPPED,
     "something touches the arm.*the object is being lowered", "lower"),
    ("fault: push, targets: [RForearm], y: 30, after_s: 3, lasts_s: 0.2, phases: [{phase: lift}]", DONE, None, "watch"),
    ("fault: computer-bus-off, targets: [rarm], after_s: 1, lasts_s: 0.2, phases: [{phase: approach}]", RECOVERED,
     "controller is bus-off", "watch"),
    ("fault: frame-drop, targets: [rarm], share: 1, after_s: 1, lasts_s: 0.4, phases: [{phase: approach}]", RECOVERED,
     "none of its .* devices has been heard", "watch"),
    ("fault: heartbeat-loss, targets: [RElbj], after_s: 1, lasts_s: 0.6, phases: [{phase: approach}]", RECOVERED,
     "no heartbeat for", "watch"),
    ("fault: nmt-preop-drop, targets: [RElbj], after_s: 1, phases: [{phase: approach}]", RECOVERED,
     "no TPDO|NMT state pre-operational", "watch"),
    ("fault: overcurrent-trip, targets: [RElbj], after_s: 1, lasts_s: 0.3, phases: [{phase: approach}]", RECOVERED,
     "emergency 2310h", "watch"),
)


def judge(case, record):
    plan, classes, said, by = case
    name = plan.split(",")[0]
    check(record["class"] in classes, f"{name}: {record['class']}: {record['reason']}")
    if said:
        check(re.search(said, record["reason"]) is not None, f"{name}: not said: {said}, but {record['reason']}")
    observed = record["observation"]
    check(observed["limits"] == [], f"{name}: limits passed: {observed['limits']}")
    if isinstance(by, float):
        check(record["detection"] <= by, f"{name}: shown after {record['detection']} s, expected {by}")
    elif record["class"] != "safe-stop" or by != "watch":
        check(observed["phases"][-1] == by, f"{name}: ended in {observed['phases'][-1]}, expected {by}")


def main():
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "short.yaml").write_text(SCENE % (TREE / "urdf/scenes/experiment_1.yaml"))
        (folder / "parameters.yaml").write_text(PARAMETERS)
        plan = folder / "plan.yaml"
        plan.write_text("experiments: [short.yaml]\nseeds: {first: 3}\nruns_per_chunk: 8\nfaults:\n" +
                        "".join(f"  - {{{case[0]}}}\n" for case in CASES))
        done = run("campaign", "run", str(plan), "--out", str(folder / "out"), "--jobs", "2")
        check(done.returncode == 0, f"{done.returncode} {done.stderr} {done.stdout}")
        records = [json.loads(file.read_text()) for file in sorted(folder.glob("out/runs/*/record.json"))]
        check(len(records) == len(CASES), f"{len(records)} records")
        # Runs are numbered in the order in which a run comes to their phases, those of one phase as the plan has them.
        order = sorted(CASES, key=lambda case: ["look", "approach", "grasp", "lift"].index(re.search(r"phase: (\w+)", case[0])[1]))
        for case, record in zip(order, records):
            check(f"fault: {record['fault']}," in case[0], f"{record['fault']} is the run of {case[0]}")
            judge(case, record)
        report = json.loads((folder / "out/report.json").read_text())
        check(report["golden"]["alarmed"]["k"] == 0, f"false alarms: {report['golden']['false_alarms']}")
    end()


main()
