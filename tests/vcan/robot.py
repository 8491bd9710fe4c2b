"""The whole robot: the emulator on five vcan buses, and the product's own master as a separate process."""
import json
import pathlib
import struct
import subprocess
import time

import camera
import drive
from can_socket import Bus
from checks import that
from limb import JOINTS, Process

BUSES = ("torso", "rarm", "larm", "rleg", "lleg")
CAN = ",".join(f"{name}=vcan{at}" for at, name in enumerate(BUSES))
RIGHT_ARM = (11, 12, 13, 14, 15, 16, 17, 19)
MASTER = 127
HEAD_AT_HOME = pathlib.Path(__file__).parents[2] / "adaptation/head_at_home.yaml"  # as in the paper's experiments
# What a test observes on an arm's bus: SYNC and EMCY, TPDO1, boot-up and heartbeats. The rest would cost too much time
# on this single processor.
FILTERS = ((0x080, 0x780), (0x180, 0x780), (0x700, 0x780), (0x580, 0x780))


class Robot:
    """`walkman-hil emulate` with all buses and `walkman-hil grasp`, in lock-step."""

    PACING = "--lockstep"

    def __init__(self, under_test, *options):
        program, scene = under_test
        self.program, self.scene = program, scene
        self.options = options
        self.arm = Bus("vcan1", filters=FILTERS)
        self.master = None
        self.words = {}  # node: newest statusword
        self.syncs_since_beat = 0  # heartbeat of the master on the arm's bus
        self.last_beat = None  # its time stamp
        self.start_emulator()

    def start_emulator(self):
        self.emulator = Process([self.program, "emulate", "--scene", self.scene, "--can", CAN, self.PACING,
                                 "--camera", camera.ADDRESS, *self.options], "emulate")
        self.await_camera()

    def await_camera(self):
        ends = time.monotonic() + 60
        while not camera.answers():
            self.emulator.alive()
            that(time.monotonic() < ends, "the emulator does not serve the camera")
            time.sleep(0.05)

    def start_master(self):
        self.master = Process([self.program, "grasp", "--can", CAN, self.PACING, "--camera", camera.ADDRESS,
                               "--parameters", str(HEAD_AT_HOME), "--json"], "grasp")

    def note(self, frame):
        if frame.id == 0x700 + MASTER:
            self.syncs_since_beat = 0
            self.last_beat = frame.time
        elif frame.id == 0x080:
            self.syncs_since_beat += 1
        if frame.id & 0x780 == 0x700 and frame.data == b"\0":  # rebooted: its earlier messages no longer apply
            self.words.pop(frame.id & 0x7F, None)
        if frame.id & 0x780 == 0x180 and len(frame.data) == 5:
            self.words[frame.id - 0x180] = struct.unpack_from("<H", frame.data)[0]

    def watch(self, done, timeout, what):
        """Receives frames of the arm's bus until `done` is true."""
        ends = time.monotonic() + timeout
        while not done():
            self.emulator.alive()
            if self.master is not None:
                self.master.alive()
            that(time.monotonic() < ends, f"{what} not within {timeout:g} s; master: {self.master and self.master.output()[-300:]!r}")
            frame = self.arm.receive(0.2)
            if frame is not None:
                self.note(frame)

    def all_enabled(self):
        return all(drive.state(self.words.get(node, 0)) == "operation enabled" for node in RIGHT_ARM)

    def running(self, cycles=100):
        """Waits until the master's drives are in operation enabled, and for some cycles more."""
        self.watch(self.all_enabled, 120, "the arm's drives in operation enabled")
        left = [cycles]

        def passed():
            left[0] -= 1
            return left[0] < 0
        self.watch(passed, 60, f"{cycles} frames")

    def moving(self, by=0.02, seconds=30, silence=1.0):
        """Returns when the arm is moving, with a joint `by` rad from its start: the drives follow their set-points."""
        self.running()
        first = self.positions(silence)
        ends = time.monotonic() + seconds
        while max(abs(angle - began) for angle, began in zip(self.positions(silence), first)) < by:
            self.master.alive()
            that(time.monotonic() < ends, f"the arm does not move within {seconds} s")

    @staticmethod
    def positions(silence=1.0):
        """Returns the position actual values (rad) of the arm's joints, each from the next TPDO2 of its drive."""
        found = {}
        with Bus("vcan1", filters=[(0x280 + node, 0x7FF) for node in JOINTS]) as bus:
            while len(found) < len(JOINTS):
                frame = bus.receive(silence)
                that(frame is not None, "the arm's bus is silent")
                found[frame.id & 0x7F] = struct.unpack_from("<i", frame.data)[0] * 1e-6
        return [found[node] for node in JOINTS]

    def result(self, timeout=240):
        """Returns what the master printed at its end."""
        while self.master.process.poll() is None:
            self.emulator.alive()
            that(timeout > 0, f"the master does not end: {self.master.output()[-500:]!r}")
            time.sleep(0.2)
            timeout -= 0.2
        text = self.master.output()
        that("{" in text, f"the master ended with {self.master.process.returncode} and no result: {text[-500:]!r}")
        return json.loads(text[text.index("{"):]), self.master.process.returncode

    def states_after(self, cycles=40):
        """Returns the NMT states in the heartbeats of the arm's nodes, while the test's SYNCs advance the time."""
        buses = [Bus(f"vcan{at}", filters=[]) for at in range(len(BUSES))]
        told = {}
        for _ in range(cycles):
            for bus in buses:
                bus.send(0x080)
            while (frame := self.arm.receive(0.05)) is not None:
                self.note(frame)
                if frame.id & 0x780 == 0x700 and frame.id != 0x700 + MASTER and frame.data != b"\0":
                    told[frame.id & 0x7F] = frame.data[0]
        for bus in buses:
            bus.close()
        return told

    def stop(self):
        if self.master is not None and self.master.process.poll() is None:
            self.master.process.kill()
            self.master.process.wait()
        self.arm.close()
        if self.emulator.process.poll() is None:
            return self.emulator.stop()
        return self.emulator.process.returncode


def ip(*words):
    subprocess.run(["ip", *words], check=True)
