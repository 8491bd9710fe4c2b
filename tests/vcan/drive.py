"""A CiA 402 drive by its control and status words: stepping through its states over PDOs with SYNC, or over SDO."""
import struct
import time

from limb import START

MASKS = {
    "not ready to switch on": (0x4F, 0x00), "switch on disabled": (0x4F, 0x40), "ready to switch on": (0x6F, 0x21),
    "switched on": (0x6F, 0x23), "operation enabled": (0x6F, 0x27), "quick stop active": (0x6F, 0x07),
    "fault reaction active": (0x4F, 0x0F), "fault": (0x4F, 0x08),
}


def state(statusword):
    return next((name for name, (mask, value) in MASKS.items() if statusword & mask == value), f"{statusword:04X}")


def reach(sdo, word, expected, timeout=1.0):
    """Writes the controlword over SDO and waits for the state."""
    sdo.put("<H", 0x6040, 0, word)
    await_state(sdo, expected, timeout)


def await_state(sdo, expected, timeout=1.0):
    ends = time.monotonic() + timeout
    while (found := state(sdo.u16(0x6041))) != expected:
        if time.monotonic() > ends:
            raise AssertionError(f"state '{found}', expected '{expected}' within {timeout:g} s")


class Cycle:
    """Sends SYNC every 5 ms of emulated time and this drive's RPDO1 and RPDO2 after it; keeps the newest TPDO1 and
    TPDO2."""

    def __init__(self, limb, node, mode):
        self.limb, self.node, self.mode = limb, node, mode
        self.controlword, self.torque, self.position, self.velocity = 0, 0, None, 0
        self.statusword = self.mode_shown = self.torque_actual = self.position_actual = self.velocity_actual = None
        self.history = []  # emulated time, statusword, position actual, torque actual
        self.others = []

    def prepare(self):
        sdo = self.limb.sdo(self.node)
        sdo.put("<B", 0x60C2, 1, 5)
        sdo.put("<b", 0x60C2, 2, -3)
        sdo.put("<b", 0x6060, 0, self.mode)
        self.limb.nmt(START, self.node)
        return sdo

    def step(self, count=1):
        bus = self.limb.bus
        for _ in range(count):
            bus.send(0x080)
            position = self.position if self.position is not None else self.position_actual
            bus.send(0x200 + self.node, struct.pack("<Hbh", self.controlword, self.mode, self.torque))
            if position is not None:
                bus.send(0x300 + self.node, struct.pack("<ii", position, self.velocity))
            tick = bus.ticks
            while bus.ticks == tick:
                frame = bus.receive(3.0)
                if frame is None:
                    raise AssertionError("time stands still")
                self.take(frame)

    def take(self, frame):
        if frame.id == 0x180 + self.node:
            self.statusword, self.mode_shown, self.torque_actual = struct.unpack("<Hbh", frame.data)
            self.history.append((self.limb.now, self.statusword, self.position_actual, self.torque_actual))
        elif frame.id == 0x280 + self.node:
            self.position_actual, self.velocity_actual = struct.unpack("<ii", frame.data)
        elif frame.id != self.limb.bus.ruler:
            self.others.append(frame)

    def until(self, expected, cycles=200):
        for _ in range(cycles):
            self.step()
            if self.statusword is not None and state(self.statusword) == expected:
                return
        found = "no TPDO1" if self.statusword is None else f"state '{state(self.statusword)}'"
        raise AssertionError(f"{found} after {cycles} cycles, expected '{expected}'")

    def enable(self):
        self.step(4)
        for word, expected in ((6, "ready to switch on"), (7, "switched on"), (15, "operation enabled")):
            self.controlword = word
            if word == 15 and self.position is None:
                self.position = self.position_actual
            self.until(expected)
