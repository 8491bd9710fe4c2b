#!/usr/bin/python3
"""Moves one joint in cyclic synchronous position mode with python-can alone.

    walkman-hil emulate --realtime --socketcand
    examples/python_can/move_joint.py                      # the right elbow, 0.1 rad up and back

Written object by object following CiA 301 and CiA 402, so that it can be copied into any tool. Exit code 0 if the
joint went there and came back, 1 if the drive refused something or did not arrive.
"""
import argparse
import math
import struct
import sys
import time

import can

CYCLE = 0.005  # s; the drive's 60C2h is 5 ms
MODE_CSP = 8
DONE = 2000  # urad from the target


class Drive:
    """The SDO client, the PDOs and the state machine of one drive, in the drive's factory layout."""

    def __init__(self, bus, node):
        self.bus, self.node = bus, node
        self.status, self.position, self.emergency = 0, 0, None

    def send(self, identifier, data=b""):
        self.bus.send(can.Message(arbitration_id=identifier, data=data, is_extended_id=False))

    def take(self, message):
        """Processes what the drive sends on its own: TPDO1 6041h 6061h 6077h, TPDO2 6064h 606Ch, EMCY."""
        data = bytes(message.data)
        if message.arbitration_id == 0x180 + self.node and len(data) == 5:
            self.status = struct.unpack_from("<H", data)[0]
        elif message.arbitration_id == 0x280 + self.node and len(data) == 8:
            self.position = struct.unpack_from("<i", data)[0]
        elif message.arbitration_id == 0x080 + self.node and len(data) == 8:
            code = struct.unpack_from("<H", data)[0]
            self.emergency = code or None

    def wait(self, seconds, done):
        """Receives frames until `done` is true for one; returns None if the time runs out first."""
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0:
            message = self.bus.recv(left)
            if message is None:
                continue
            self.take(message)
            if done(message):
                return bytes(message.data)
        return None

    def sdo(self, request, index, sub):
        self.send(0x600 + self.node, request)
        answer = self.wait(2.0, lambda m: m.arbitration_id == 0x580 + self.node
                           and struct.unpack_from("<HB", bytes(m.data), 1) == (index, sub))
        if answer is None:
            raise RuntimeError("node %d does not answer for object %04Xh:%d" % (self.node, index, sub))
        if answer[0] == 0x80:
            raise RuntimeError("node %d refuses object %04Xh:%d with %08Xh"
                               % (self.node, index, sub, struct.unpack_from("<I", answer, 4)[0]))
        return answer

    def read(self, kind, index, sub=0):
        answer = self.sdo(struct.pack("<BHB4x", 0x40, index, sub), index, sub)
        return struct.unpack_from("<" + kind, answer, 4)[0]

    def write(self, kind, index, value, sub=0):
        size = struct.calcsize(kind)
        data = struct.pack("<" + kind, value).ljust(4, b"\0")
        self.sdo(struct.pack("<BHB", 0x23 | (4 - size) << 2, index, sub) + data, index, sub)

    def cycle(self, controlword, target):
        """Sends one SYNC and the set-points after it, and waits until the next is due."""
        end = time.monotonic() + CYCLE
        self.send(0x080)
        self.send(0x200 + self.node, struct.pack("<Hbh", controlword, MODE_CSP, 0))
        self.send(0x300 + self.node, struct.pack("<ii", target, 0))
        while (left := end - time.monotonic()) > 0:
            message = self.bus.recv(left)
            if message is not None:
                self.take(message)
        if self.emergency is not None:
            raise RuntimeError("node %d reports error %04Xh" % (self.node, self.emergency))

    def enable(self, target):
        """Shutdown, switch on, enable operation, each until the statusword confirms it (CiA 402)."""
        for controlword, mask, wanted in ((0x06, 0x6F, 0x21), (0x07, 0x6F, 0x23), (0x0F, 0x6F, 0x27)):
            for _ in range(400):
                self.cycle(controlword, target)
                if self.status & mask == wanted:
                    break
            else:
                raise RuntimeError("node %d stays at statusword %04Xh" % (self.node, self.status))


def move(drive, distance, seconds):
    drive.send(0x000, bytes([0x82, drive.node]))  # reset communication: factory PDOs
    if drive.wait(5.0, lambda m: m.arbitration_id == 0x700 + drive.node and bytes(m.data) == b"\0") is None:
        raise RuntimeError("node %d does not boot" % drive.node)
    if drive.read("I", 0x1000) & 0xFFFF != 402:
        raise RuntimeError("node %d is no drive" % drive.node)
    if drive.read("H", 0x603F) != 0:
        drive.write("H", 0x6040, 0)
        drive.write("H", 0x6040, 0x80)  # fault reset by a rising edge
    drive.write("b", 0x6060, MODE_CSP)
    # A joint does not start at 0: the first target is its present position, set before operation is enabled.
    start = drive.read("i", 0x6064)
    drive.write("i", 0x607A, start)
    drive.send(0x000, bytes([0x01, drive.node]))  # start
    drive.enable(start)
    print("node %d stands at %.4f rad" % (drive.node, start * 1e-6))
    goal = int(round(distance * 1e6))
    cycles = int(seconds / CYCLE)
    farthest = 0
    for leg in ((0, goal), (goal, 0)):
        for i in range(1, cycles + 1):
            share = 0.5 - 0.5 * math.cos(math.pi * i / cycles)
            drive.cycle(0x0F, start + int(leg[0] + (leg[1] - leg[0]) * share))
        for _ in range(400):
            drive.cycle(0x0F, start + leg[1])
            if abs(drive.position - start - leg[1]) < DONE:
                break
        else:
            raise RuntimeError("node %d is %.4f rad off" % (drive.node, (drive.position - start - leg[1]) * 1e-6))
        farthest = max(farthest, abs(drive.position - start))
        print("node %d is at %.4f rad" % (drive.node, drive.position * 1e-6))
    if farthest < abs(goal) - DONE:
        raise RuntimeError("node %d has not moved" % drive.node)
    drive.cycle(0x06, start)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--interface", default="socketcand")
    parser.add_argument("--channel", default="can_rarm")
    parser.add_argument("--host", default="127.0.0.1")
    parser.add_argument("--port", type=int, default=29536)
    parser.add_argument("--node", type=int, default=14)
    parser.add_argument("--distance", type=float, default=0.1, help="rad")
    parser.add_argument("--seconds", type=float, default=1.0, help="for the way there, and for the way back")
    options = parser.parse_args()
    remote = {"host": options.host, "port": options.port} if options.interface == "socketcand" else {}
    bus = can.Bus(interface=options.interface, channel=options.channel, **remote)
    try:
        move(Drive(bus, options.node), options.distance, options.seconds)
    except RuntimeError as error:
        print(error, file=sys.stderr)
        return 1
    finally:
        bus.shutdown()
    return 0


if __name__ == "__main__":
    sys.exit(main())
