#!/usr/bin/env python3
"""Tests walkman-hil campaign from outside, on every engine. Usage: campaign_test.py PROGRAM SOURCE_TREE

One campaign runs without interruption; each of its runs must then equal, field for field, `experiment --faults` from power-on.
On every engine the same campaign is killed and continued: the result must be the same to the byte. Its golden twins are taken
from the first campaign, because they take most of the time; once it is killed while a golden twin runs.
"""

import json
import os
import random
import re
import shlex
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from checks import PROGRAM, check, end, run

TREE = Path(sys.argv[2])
RUNS = 7
LONG_RUNS = (4, 6)  # the over-current, from which the drivers recover, and the jam in the look

# A run that ends at its first weighing: the method accepts any torque.
SCENE = "extends: %s\nparameters: parameters.yaml\n"
PARAMETERS = "stage_two:\n  torque_threshold: 50\n"
PLAN = """experiments: [short.yaml]
seeds: {first: 3, count: 1}
golden: {seeds: 1}
runs_per_chunk: 3
faults:
  - fault: bus-off
    targets: [r_arm_ft]
    phases: [{phase: boot}]
  - fault: sdo-timeout
    targets: [RElbj, l_arm_ft]
    phases: [{phase: boot}]
  - fault: overcurrent-trip
    targets: [LElbj]
    phases: [{phase: settle}]
  - fault: payload-bitflip
    targets: [rarm]
    share: [0.02]
    phases: [{phase: settle}]
  - fault: undervoltage
    targets: [RElbj]
    phases: [{phase: lift, occurrence: 9}]
  - fault: joint-locked
    targets: [RElbj]
    after_s: 0.5
    phases: [{phase: look}]
"""

SLURM = """ClusterName=hil
SlurmctldHost={host}(127.0.0.1)
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket={folder}/munge.socket
CryptoType=crypto/munge
SlurmctldPort={port}
SlurmdPort={other_port}
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SchedulerType=sched/backfill
SchedulerParameters=batch_sched_delay=0,sched_min_interval=0,sched_interval=1,bf_interval=1
MpiDefault=none
ReturnToService=2
SlurmdTimeout=30
KillWait=2
NodeName={host} NodeAddr=127.0.0.1 CPUs={cores} RealMemory=500 State=UNKNOWN
PartitionName=fi Nodes=ALL Default=YES MaxTime=INFINITE State=UP
"""


def campaign(plan, out, *options):
    return run("campaign", "run", str(plan), "--out", str(out), *options)


def contents(folder):
    """Returns every file of the campaign's results, as bytes."""
    files = [p for p in sorted(folder.rglob("*")) if p.is_file() and (p.parent.name == "golden" or "runs" in p.parts)
             and p.suffix != ".partial"]  # partly written when its writer was killed
    return {str(p.relative_to(folder)): p.read_bytes() for p in files + [folder / "campaign.json", folder / "plan.yaml"]}


def others(out, whole):
    """Returns the names of the files that are not the same."""
    ours, theirs = contents(out), contents(whole)
    return [name for name in set(ours) | set(theirs) if ours.get(name) != theirs.get(name)]


def report_without_place(folder):
    return (folder / "report.json").read_text().replace(str(folder), "FOLDER")


def from_the_start(folder):
    """Checks that each run, started again at power-on by the command that the report gives for it, equals its fork."""
    replays = {one["run"]: one["replay"] for one in json.loads((folder / "report.json").read_text())["runs"]}
    for number in range(1, RUNS + 1):
        record = json.loads((folder / f"runs/{number:06}/record.json").read_text())
        if record["observation"] is None:
            check(record["class"] == "not-activated" and record["phase"] == "lift 9", f"run {number}: {record['class']}")
            continue
        words = shlex.split(replays[number])
        check(words[0] == "walkman-hil", replays[number])
        fresh = run(*words[1:], "--json", "--out", str(folder.parent / "fresh"))
        result = json.loads(fresh.stdout)["repetitions"][0]
        check(record["observation"]["result"] == result, f"run {number} from the start: {record['observation']['result']} {result}")


def classes(folder):
    records = [json.loads((folder / f"runs/{n:06}/record.json").read_text()) for n in range(1, RUNS + 1)]
    by = {(r["fault"], r["target"]): r for r in records}
    for fault, target, expected in (("sdo-timeout", "RElbj", "safe-stop"), ("overcurrent-trip", "LElbj", "recovered"),
                                    ("joint-locked", "RElbj", "safe-stop")):
        record = by[fault, target]
        check(record["class"] == expected, f"{fault}: {record['class']}, {record['reason']}")
        check(target in record["reason"], f"{fault}: {record['reason']}")
        check(record["blames_target"], f"{fault} is blamed on {record['shown']}")
    check(by["overcurrent-trip", "LElbj"]["detection"] <= 0.01, "an over-current is shown within two cycles")
    check("2310" in by["overcurrent-trip", "LElbj"]["reason"], by["overcurrent-trip", "LElbj"]["reason"])
    jam = by["joint-locked", "RElbj"]
    check(jam["shown"]["time"] - jam["observation"]["off"] <= 0.25, "a jam in motion is shown within 250 ms")
    report = json.loads((folder / "report.json").read_text())
    check(report["all"]["runs"] == RUNS and report["golden"]["done"] == 1, "the report has all of it")
    check(report["golden"]["alarmed"]["k"] == 0, f"false alarms: {report['golden']['false_alarms']}")
    check(sum(group["runs"] for group in report["cells"]) == RUNS, "every run is in a cell")
    tables = run("campaign", "report", str(folder), "--markdown").stdout.splitlines()
    check(any(line.startswith(f"| all | {RUNS} |") for line in tables), f"{tables}")
    columns = [cell.strip() for cell in tables[0].split("|")]
    for fault, expected in (("overcurrent-trip", "recovered"), ("joint-locked", "safe-stop")):
        cells = [[cell.strip() for cell in line.split("|")] for line in tables if line.startswith(f"| `{fault}` |")]
        check(len(cells) == 1 and cells[0][2] == "1" and cells[0][columns.index(f"`{expected}`")] == "1", f"{fault}: {cells}")
    heat = re.search(r"<table class='heat'>.*?</table>", (folder / "report.html").read_text(), re.S)[0]
    filled = [cell for cell in re.findall(r"<td[^>]*>[^<]+", heat.replace("\n", "")) if ">" in cell]
    faults = {group["fault"] for group in report["cells"]}
    check(len(filled) == len(report["cells"]) + len(faults), f"a heat map of {len(report['cells'])} cells: {heat}")


def begun(whole, out):
    """Prepares a campaign that already has its golden twin and the long runs."""
    out.mkdir()
    for name in ["golden"] + [f"runs/{number:06}" for number in LONG_RUNS]:
        shutil.copytree(whole / name, out / name)
    for name in ("campaign.json", "plan.yaml"):
        shutil.copy(whole / name, out)


def killed_in_the_golden_run(plan, whole, out, draw):
    begun(whole, out)
    shutil.rmtree(out / "golden")
    options = [PROGRAM, "campaign", "run", str(plan), "--out", str(out), "--jobs", "1"]
    process = subprocess.Popen(options, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    limit = time.monotonic() + 120
    while not (out / "engine.log").exists() and time.monotonic() < limit and process.poll() is None:
        time.sleep(0.02)
    time.sleep(draw.uniform(0.5, 3))
    process.send_signal(signal.SIGKILL)
    process.communicate()
    check(not list(out.glob("golden/*.json")), "the golden run had not ended when it was killed")
    nothing_left_of(out)
    done = subprocess.run(options, capture_output=True, text=True, check=False)
    check(done.returncode == 0, f"{done.returncode} {done.stderr}")
    check(not others(out, whole), f"killed in the golden run: {others(out, whole)} are others")


def killed_and_gone_on_with(engine, plan, whole, out, draw, environment=None):
    begun(whole, out)
    enough, moment = len(LONG_RUNS) + draw.randint(1, 2), draw.uniform(0, 0.1)
    options = [PROGRAM, "campaign", "run", str(plan), "--out", str(out), "--engine", engine, "--jobs", "2"]
    process = subprocess.Popen(options, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment)
    limit = time.monotonic() + 120
    while len(list(out.glob("runs/*/record.json"))) < enough and time.monotonic() < limit and process.poll() is None:
        time.sleep(0.02)
    time.sleep(moment)
    process.send_signal(signal.SIGKILL)
    process.communicate()
    before = len(list(out.glob("runs/*/record.json")))
    done = subprocess.run(options, capture_output=True, text=True, check=False, env=environment)
    log = (out / "engine.log").read_text() if (out / "engine.log").exists() else ""
    check(done.returncode == 0, f"{engine}: {done.returncode} {done.stderr} {log}")
    check(enough <= before < RUNS, f"{engine}: {before} runs were done when it was killed")
    check(not others(out, whole), f"{engine}, killed {moment:.3f} s after run {enough}, {before} done: {others(out, whole)} are others")
    nothing_left_of(out)
    check(report_without_place(out) == report_without_place(whole), f"{engine}: the report is another")


def limited(folder, whole):
    """A golden run that does not end within its limit is the program's failure; a run with a fault is of the class crash/hang."""
    plan, out = folder / "limited.yaml", folder / "limited"
    plan.write_text("experiments: [short.yaml]\nseeds: {first: 3}\ntime_limit_s: 1\nfaults:\n"
                    "  - {fault: overcurrent-trip, targets: [LElbj], phases: [{phase: settle}]}\n")
    done = campaign(plan, out)
    check(done.returncode == 5 and "no end within 1 s of CPU time" in done.stderr, f"{done.returncode} {done.stderr}")
    shutil.copytree(whole / "golden", out / "golden", dirs_exist_ok=True)
    done = campaign(plan, out)
    check(done.returncode == 0, f"{done.returncode} {done.stderr}")
    record = json.loads((out / "runs/000001/record.json").read_text())
    check(record["class"] == "crash/hang" and record["reason"] == "no end within 1 s of CPU time", f"{record}")


def unwritable(plan, whole, folder):
    """What a run cannot write is the machine's lack, said with the file's name, and no crash of the run."""
    for engine in ("local", "parallel"):
        out = folder / f"unwritable_{engine}"
        begun(whole, out)
        shutil.rmtree(out / "runs")
        (out / "runs").write_text("")
        done = campaign(plan, out, "--engine", engine)
        check(done.returncode == 3 and f"{out}/runs/0" in done.stderr, f"{engine}: {done.returncode} {done.stderr}")


def killed_at_the_start(plan, whole, out):
    """A folder that holds no more than the beginning of a campaign is its own; one with anything else is not."""
    begun(whole, out)
    (out / "campaign.json").unlink()
    for name in ("golden", "runs"):
        (out.parent / f"{out.name}_{name}").mkdir()
        shutil.move(out / name, out.parent / f"{out.name}_{name}")
    (out / "campaign.json.host-1.partial").write_text("{")
    (out / "mine.txt").write_text("")
    done = campaign(plan, out)
    check(done.returncode == 2 and "holds something else" in done.stderr, f"{done.returncode} {done.stderr}")
    (out / "mine.txt").unlink()
    other = out.parent / "other.yaml"
    other.write_text(plan.read_text().replace("after_s: 0.5", "after_s: 0.6"))
    done = campaign(other, out)
    check(done.returncode == 2 and "holds something else" in done.stderr, f"{done.returncode} {done.stderr}")
    process = subprocess.Popen([PROGRAM, "campaign", "run", str(plan), "--out", str(out)], stderr=subprocess.PIPE, text=True)
    limit = time.monotonic() + 60
    while not (out / "engine.log").exists() and time.monotonic() < limit and process.poll() is None:
        time.sleep(0.02)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=60)
    check((out / "campaign.json").exists(), f"a campaign that was killed at its start goes on: {errors}")
    nothing_left_of(out)


def nothing_left_of(out):
    for _ in range(100):
        left = subprocess.run(["pgrep", "-f", f"campaign exec {out}"], capture_output=True, text=True, check=False)
        if left.returncode == 1:
            return
        time.sleep(0.1)
    check(False, f"processes are left: {left.stdout}")


def interrupted(plan, whole, out):
    """At Ctrl-C everything ends, and a report of the results so far is written."""
    begun(whole, out)
    process = subprocess.Popen([PROGRAM, "campaign", "run", str(plan), "--out", str(out), "--jobs", "1"],
                               stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    limit = time.monotonic() + 120
    while not (out / "engine.log").exists() and time.monotonic() < limit:
        time.sleep(0.02)
    time.sleep(0.5)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=60)
    check(process.returncode == 1 and "interrupted: the same command resumes" in errors, f"{process.returncode} {errors}")
    nothing_left_of(out)
    check((out / "report.html").exists(), "a report of what there is")


def refusals(folder, plan, whole):
    broken = folder / "broken.yaml"
    broken.write_text("experiments: [1]\nfaults:\n  - {fault: joint-loked, targets: [RElbj], phases: [{phase: lift}]}\n")
    done = campaign(broken, folder / "refused")
    check(done.returncode == 2 and ":3: faults[0].fault" in done.stderr and done.stderr.count("\n") == 1, done.stderr)
    done = campaign(folder / "none.yaml", folder / "refused")
    check(done.returncode == 2 and done.stderr.count("\n") == 1, done.stderr)
    changed = folder / "changed.yaml"
    changed.write_text(PLAN.replace("share: [0.02]", "share: [0.03]"))
    done = campaign(changed, whole)
    check(done.returncode == 2 and "another plan" in done.stderr, done.stderr)
    done = run("campaign", "exec", str(whole), "--chunk", "99")
    check(done.returncode == 2 and "expected 0 to" in done.stderr, done.stderr)
    done = run("campaign", "report", str(folder))
    check(done.returncode == 2 and "campaign.json" in done.stderr, done.stderr)


def free_port():
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]


class Cluster:
    """This test's own munged, slurmctld and slurmd, in a folder, as root."""

    def __init__(self, folder):
        self.folder, self.started = folder, []
        self.environment = dict(os.environ, SLURM_CONF=str(folder / "slurm.conf"))
        for name in ("state", "spool"):
            (folder / name).mkdir()
        host = socket.gethostname().split(".")[0]
        (folder / "slurm.conf").write_text(SLURM.format(host=host, folder=folder, port=free_port(), other_port=free_port(),
                                                        cores=os.cpu_count()))
        # Named, since slurmd cannot detect one where none is mounted; it is not used by the plugins above.
        (folder / "cgroup.conf").write_text("CgroupPlugin=cgroup/v1\n")
        (folder / "munge.key").write_bytes(os.urandom(128))
        (folder / "munge.key").chmod(0o400)
        folder.chmod(0o755)
        # As root, munged may use files owned by root, and any folder with --force.
        self.start("munged", "--foreground", "--force", "--key-file", folder / "munge.key", "--socket",
                   folder / "munge.socket", "--pid-file", folder / "munged.pid", "--log-file", folder / "munged.log",
                   "--seed-file", folder / "munged.seed")
        self.wait(lambda: (folder / "munge.socket").exists(), "munged")
        self.start("slurmctld", "-D")
        self.start("slurmd", "-D")
        self.wait(lambda: "idle" in self.ask("sinfo", "-h", "-o", "%t"), "slurmd")

    def start(self, *words):
        log = open(self.folder / f"{words[0]}.out", "w", encoding="utf-8")
        self.started.append(subprocess.Popen([str(w) for w in words], stdout=log, stderr=log, env=self.environment))

    def ask(self, *words):
        return subprocess.run(words, capture_output=True, text=True, check=False, env=self.environment).stdout

    def wait(self, holds, what):
        limit = time.monotonic() + 60
        while time.monotonic() < limit:
            if holds():
                return
            time.sleep(0.1)
        logs = "".join(f"{p.name}: {p.read_text(errors='replace')[-600:]}\n" for p in self.folder.glob("*.[lo][ou][gt]"))
        raise RuntimeError(f"{what} does not come up\n{logs}")

    def stop(self):
        for process in reversed(self.started):
            process.terminate()
            try:
                process.wait(timeout=20)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()


def main():
    seed = int.from_bytes(os.urandom(4), "big")
    print("moments are drawn with", seed)
    draw = random.Random(seed)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "short.yaml").write_text(SCENE % (TREE / "urdf/scenes/experiment_1.yaml"))
        (folder / "parameters.yaml").write_text(PARAMETERS)
        plan = folder / "plan.yaml"
        plan.write_text(PLAN)
        whole = folder / "whole"
        done = campaign(plan, whole, "--jobs", "2")
        check(done.returncode == 0, f"{done.returncode} {done.stderr} {done.stdout}")
        if done.returncode != 0:
            end()
        classes(whole)
        from_the_start(whole)
        refusals(folder, plan, whole)
        limited(folder, whole)
        interrupted(plan, whole, folder / "interrupted")
        unwritable(plan, whole, folder)
        killed_at_the_start(plan, whole, folder / "started")
        killed_in_the_golden_run(plan, whole, folder / "begun", draw)
        for engine in ("local", "parallel"):
            killed_and_gone_on_with(engine, plan, whole, folder / engine, draw)
        (folder / "cluster").mkdir()
        cluster = Cluster(folder / "cluster")
        try:
            killed_and_gone_on_with("slurm", plan, whole, folder / "slurm", draw, cluster.environment)
            queue = cluster.ask("squeue", "-h")
            check(not queue.strip(), f"jobs are left: {queue}")
        finally:
            cluster.stop()
    end()


main()
