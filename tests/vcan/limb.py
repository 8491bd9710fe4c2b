"""The emulated right arm on vcan1: its process, its nodes, and what tests need to bring it into a known state."""
import os
import signal
import struct
import subprocess
import time

from can_socket import Bus
from sdo import Sdo

JOINTS = (11, 12, 13, 14, 15, 16, 17)
SENSOR, HAND = 18, 19
NODES = JOINTS + (SENSOR, HAND)
RULER, TICK = JOINTS[6], 0.005
START, STOP, PREOPERATIONAL, RESET_NODE, RESET_COMMUNICATION = 0x01, 0x02, 0x80, 0x81, 0x82


class Process:
    """A program under test, with its output in a file."""

    def __init__(self, line, name, environment=None):
        self.log = f"/run/{name}.log"
        self.line = line
        with open(self.log, "wb") as log:
            self.process = subprocess.Popen(line, stdin=subprocess.DEVNULL, stdout=log, stderr=log,
                                            env={**os.environ, **(environment or {})})

    def output(self):
        with open(self.log, encoding="utf-8", errors="replace") as log:
            return log.read()

    def alive(self):
        if self.process.poll() is not None:
            raise AssertionError(f"{' '.join(self.line)} ended with {self.process.returncode}: {self.output()[-2000:]}")

    def stop(self, number=signal.SIGINT, timeout=10):
        """Ends it by a signal; returns its exit status."""
        if self.process.poll() is None:
            self.process.send_signal(number)
        try:
            return self.process.wait(timeout)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
            raise AssertionError(f"{self.line[1]} did not end within {timeout} s of {signal.Signals(number).name}") from None


class Limb:
    """The right arm of `walkman-hil emulate`, and one socket on its bus.

    Time is measured by the heartbeats of one node, every 5 ms of the emulated clock, so that it does not matter how
    busy the host is or how far the emulator has fallen behind. `now`, `collect` and `wait` use that time."""

    def __init__(self, program, scene, options=("--realtime", "--timing", "none"), interface="vcan1"):
        self.bus = Bus(interface)
        self.program, self.scene = program, scene
        self.emulator = Process([program, "emulate", "--scene", scene, "--can", f"rarm={interface}", *options], "emulate")
        self.await_boot(NODES, 60)
        self.lay_ruler()

    def lay_ruler(self):
        self.bus.ruler = 0x700 + RULER
        self.sdo(RULER).put("<H", 0x1017, 0, round(TICK * 1000))

    @property
    def now(self):
        """Returns emulated seconds since an arbitrary instant."""
        return self.bus.ticks * TICK

    def mark(self):
        """Waits until everything sent so far has reached the nodes and been answered; returns the emulated time then."""
        self.sdo(RULER).u32(0x1000)
        ticks = self.bus.ticks
        return ticks * TICK

    def collect(self, duration, *can_ids):
        """Returns every frame (with these identifiers) of the next `duration` seconds, each as (emulated time, frame).
        The time starts when everything sent before has arrived. If the ruler is silent, as after a reset of all nodes,
        the host's clock is used."""
        found, ends, quiet_since = [], None, time.monotonic()
        self.sdo(RULER).send(bytes.fromhex("4000100000000000"))
        ticks, began = self.bus.ticks, time.monotonic()
        while ends is None or self.now < ends:
            frame = self.bus.receive(0.1)
            if self.bus.ticks != ticks:
                ticks, quiet_since = self.bus.ticks, time.monotonic()
            if time.monotonic() - quiet_since > 1.0 and time.monotonic() - began > duration:
                break
            if frame is None:
                continue
            if frame.id == 0x580 + RULER and ends is None:
                ends = self.now + duration
            elif frame.id in can_ids or (not can_ids and frame.id != self.bus.ruler):
                found.append((self.now, frame))
        return found

    def frames(self, duration, *can_ids):
        """Like `collect`, without the times."""
        return [frame for _, frame in self.collect(duration, *can_ids)]

    def wait(self, duration):
        """Lets emulated time pass; frames received meanwhile are kept in `bus.passed`."""
        self.bus.passed += self.frames(duration)

    def await_boot(self, nodes, timeout=5.0):
        """Waits for the boot-up message of each of these nodes; returns their times."""
        missing, times = {0x700 + node for node in nodes}, {}
        ends = time.monotonic() + timeout
        while missing:
            self.emulator.alive()
            left = ends - time.monotonic()
            if left <= 0:
                raise AssertionError("no boot-up message of node " + ", ".join(str(one - 0x700) for one in sorted(missing)))
            frame = self.bus.receive(min(left, 0.5))
            if frame is not None and frame.id in missing and frame.data == b"\0":
                missing.discard(frame.id)
                times[frame.id - 0x700] = frame.time
        return times

    def nmt(self, command, node=0):
        self.bus.send(0x000, bytes([command, node]))

    def sdo(self, node, timeout=1.0):
        return Sdo(self.bus, node, timeout)

    def sync(self, counter=None):
        self.bus.send(0x080, b"" if counter is None else bytes([counter]))

    def fresh(self, *nodes):
        """Puts these nodes (all, if none is named) in their state after power-on, pre-operational; returns an SDO
        client for the first."""
        self.bus.drain()
        if nodes:
            for node in nodes:
                self.nmt(RESET_NODE, node)
        else:
            self.nmt(RESET_NODE)
        self.await_boot(nodes or NODES)
        if not nodes or RULER in nodes:
            self.lay_ruler()
        self.wait(0.005)  # a drive is "not ready to switch on", and ignores controlwords, until one step after its boot-up
        self.bus.drain()
        return self.sdo((nodes or NODES)[0])

    def start(self, *nodes):
        """Makes the nodes operational and checks it (by guarding: an answer comes after the command was obeyed)."""
        for node in nodes:
            self.nmt(START, node)
            equal_state(self, node, 0x05)

    def state(self, node):
        """Returns the NMT state, by guarding if no heartbeat gives it."""
        if node == RULER:
            self.mark()
            return self.bus.expect(0x700 + node).data[0]
        self.bus.send(0x700 + node, dlc=1, rtr=True)
        return self.bus.expect(0x700 + node, what="(guarding)").data[0] & 0x7F

    def stop(self):
        self.bus.close()
        return self.emulator.stop()


def equal_state(limb, node, expected):
    found = limb.state(node)
    if found != expected:
        raise AssertionError(f"node {node} is in NMT state {found:02X}, expected {expected:02X}")


def emergency(code):
    """Returns a filter for EMCY frames with this error code."""
    return lambda frame: len(frame.data) == 8 and struct.unpack_from("<H", frame.data)[0] == code
