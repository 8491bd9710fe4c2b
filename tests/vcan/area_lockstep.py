"""Two runs of the same commands: the emulator's logs are equal to the byte."""
import hashlib
import os
import struct
import time

import camera
from can_socket import Bus
from checks import equal, test, that
from limb import JOINTS, NODES, RESET_COMMUNICATION, SENSOR, START, Process
from robot import Robot

OWN_PROCESSES = True
INTERFACE = "vcan1"
CYCLES = 400


def digest(path):
    with open(path, "rb") as file:
        return hashlib.sha256(file.read()).hexdigest()


def a_master_of_ours(under_test, log, hurry):
    """Boots, configures and moves the limb by frames alone; the time between them differs from run to run."""
    program, scene = under_test
    bus = Bus(INTERFACE)
    emulator = Process([program, "emulate", "--scene", scene, "--can", f"rarm={INTERFACE}", "--lockstep", "--log", log,
                        "--camera", camera.ADDRESS], "lockstep")
    try:
        while not camera.answers():  # when it answers, the emulator is ready
            emulator.alive()
            time.sleep(0.05)
        bus.send(0x000, bytes([RESET_COMMUNICATION, 0]))
        missing = {0x700 + node for node in NODES}
        while missing:
            emulator.alive()
            frame = bus.receive(0.5)
            if frame is not None and frame.data == b"\0":
                missing.discard(frame.id)
        for node in NODES:
            bus.send(0x600 + node, bytes.fromhex("2B171000 64000000"))
            bus.expect(0x580 + node, 2.0, what="(SDO answer)")
            time.sleep(hurry)
        bus.send(0x000, bytes([START, 0]))
        for cycle in range(CYCLES):
            bus.send(0x080)
            last = 0x280 + SENSOR
            bus.expect(last, 2.0, what=f"(cycle {cycle})")
            time.sleep(hurry * (cycle % 3))
            for node in JOINTS:
                bus.send(0x200 + node, struct.pack("<Hbh", 6 if cycle < 20 else 15, 8, 0))
                if cycle > 10:
                    bus.send(0x300 + node, struct.pack("<ii", 100 * cycle, 0))
        bus.send(0x080)
        bus.expect(0x280 + SENSOR, 2.0)
    finally:
        bus.close()
        equal(emulator.stop(), 0, "exit status of the emulator")


def same(logs, least):
    """Checks that the two logs are equal to the byte; returns their size."""
    sizes = [os.path.getsize(log) for log in logs]
    that(sizes[0] > least, f"log of {sizes[0]} bytes")
    if digest(logs[0]) != digest(logs[1]):
        with open(logs[0], encoding="ascii") as one, open(logs[1], encoding="ascii") as two:
            for number, pair in enumerate(zip(one, two), start=1):
                if pair[0] != pair[1]:
                    raise AssertionError(f"line {number}: {pair[0].strip()} and {pair[1].strip()}")
        raise AssertionError(f"logs of {sizes[0]} and {sizes[1]} bytes, the shorter one the beginning of the longer")
    return f"{sizes[0]} bytes each"


@test(seconds=240)
def same_frames_same_log_whatever_the_pace(under_test):
    logs = []
    for hurry in (0.0, 0.002):
        logs.append(f"/run/lockstep-{hurry}.log")
        a_master_of_ours(under_test, logs[-1], hurry)
    return same(logs, 100000)


@test(seconds=400)
def emulate_and_grasp_twice(under_test):
    """The first seconds of an experiment: boot, power-up, the first motion, all five buses."""
    logs = []
    for name in ("one", "two"):
        logs.append(f"/run/grasp-{name}.log")
        robot = Robot(under_test, "--log", logs[-1], "--duration", "4")
        try:
            robot.start_master()
            that(robot.emulator.process.wait(180) == 0, f"exit status {robot.emulator.process.returncode} of the emulator")
        finally:
            robot.stop()
    return same(logs, 1000000)
