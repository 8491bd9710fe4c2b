"""The emulated right arm on vcan1: its process, its nodes, and what tests need to bring it to a known state."""
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
START, STOP, PREOPERATIONAL, RESET_NODE, RESET_COMMUNICATION = 0x01, 0x02, 0x80, 0x81, 0x82


class Process:
    """A program under test, its output in a file."""

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
        """Asks it to end; its exit status."""
        if self.process.poll() is None:
            self.process.send_signal(number)
        try:
            return self.process.wait(timeout)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
            raise AssertionError(f"{self.line[1]} did not end within {timeout} s of {signal.Signals(number).name}") from None


class Limb:
    """The right arm behind `walkman-hil emulate`, and one socket on its bus."""

    def __init__(self, program, scene, options=("--realtime", "--timing", "none"), interface="vcan1"):
        self.bus = Bus(interface)
        self.program, self.scene = program, scene
        self.emulator = Process([program, "emulate", "--scene", scene, "--can", f"rarm={interface}", *options], "emulate")
        self.await_boot(NODES, 60)

    def await_boot(self, nodes, timeout=2.0):
        """Waits for the boot-up message of each of these nodes; the times they came."""
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
        """These nodes (all, if none is named) as after power-on, pre-operational; an SDO client for the first."""
        self.bus.drain()
        if nodes:
            for node in nodes:
                self.nmt(RESET_NODE, node)
        else:
            self.nmt(RESET_NODE)
        self.await_boot(nodes or NODES)
        self.bus.drain()
        return self.sdo((nodes or NODES)[0])

    def start(self, *nodes):
        """Operational, and seen to be so (by guarding: an answer comes after the command was obeyed)."""
        for node in nodes:
            self.nmt(START, node)
            equal_state(self, node, 0x05)

    def state(self, node):
        """NMT state by guarding (needs 1017h = 0)."""
        self.bus.send(0x700 + node, dlc=1, rtr=True)
        return self.bus.expect(0x700 + node, 1.0, what="(guarding)").data[0] & 0x7F

    def stop(self):
        self.bus.close()
        return self.emulator.stop()


def equal_state(limb, node, expected):
    found = limb.state(node)
    if found != expected:
        raise AssertionError(f"node {node} is in NMT state {found:02X}, expected {expected:02X}")


def emergency(code):
    """A filter for EMCY frames of this error code."""
    return lambda frame: len(frame.data) == 8 and struct.unpack_from("<H", frame.data)[0] == code
