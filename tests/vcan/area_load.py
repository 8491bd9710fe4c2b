"""The bus model's load compared with that of canbusload -e: the same frames, bit for bit."""
import json
import random
import re
import struct
import subprocess
import time

from can_socket import Bus
from checks import equal, test, that, within
from limb import HAND, JOINTS, NODES, START, Limb

OWN_PROCESSES = True
INTERFACE = "vcan4"  # used by nobody else
BIT_RATE = 1000000


def frames_of(log, name):
    with open(log, encoding="ascii") as file:
        return [line.split() for line in file if line.split()[1] == name]


def record(under_test, log, cycles):
    """An arm bus at 200 Hz with random set-points, its log written by the emulator."""
    limb = Limb(*under_test, options=("--realtime", "--timing", "bus", "--json", "--log", log))
    rng = random.Random(7)
    try:
        limb.fresh()
        for node in NODES:
            if 0x700 + node != limb.bus.ruler:
                limb.sdo(node).put("<H", 0x1017, 0, 100)
        limb.nmt(START)
        for _ in range(cycles):
            tick = limb.bus.ticks
            limb.sync()
            for node in JOINTS + (HAND,):
                limb.bus.send(0x200 + node, struct.pack("<Hbh", 0, 8, rng.randrange(-300, 300)))
                limb.bus.send(0x300 + node, struct.pack("<ii", rng.randrange(-1 << 31, 1 << 31), 0))
            while limb.bus.ticks == tick:
                that(limb.bus.receive(3.0), "time stands still")
        limb.wait(0.2)
    finally:
        equal(limb.stop(), 0, "exit status of the emulator")
    return limb.emulator.output()


def replay(frames):
    """Puts the log's frames on the interface, in order, and never more at a time than a socket holds."""
    with Bus(INTERFACE, filters=[]) as bus:
        for at, (_, _, frame) in enumerate(frames):
            can_id, data = frame.split("#")
            if data.startswith("R"):
                bus.send(int(can_id, 16), rtr=True, dlc=int(data[1:] or "0"))
            else:
                bus.send(int(can_id, 16), bytes.fromhex(data))
            if at % 50 == 49:
                time.sleep(0.02)


def canbusload_of(frames):
    """Returns frames and bits as counted by canbusload on an interface that carries these frames."""
    meter = subprocess.Popen(["stdbuf", "-oL", "canbusload", "-e", f"{INTERFACE}@{BIT_RATE}"], stdout=subprocess.PIPE, text=True)
    time.sleep(0.5)
    replay(frames)
    time.sleep(2.2)  # two of its seconds, so that the last frames are reported
    meter.terminate()
    lines = re.findall(rf"{INTERFACE}@{BIT_RATE}\s+(\d+)\s+(\d+)", meter.communicate()[0])
    return sum(int(frames) for frames, _ in lines), sum(int(bits) for _, bits in lines)


def model_of(output, name):
    """Returns frames and bits of a bus from the emulator's own counters, in the summary that it prints at its end."""
    summary = json.loads(output[output.index("{"):])
    bus = next(one for one in summary["buses"] if one["name"] == name)
    return bus["frames"], bus["mean_load"] * summary["emulated_seconds"] * BIT_RATE


@test(seconds=150)
def bits_equal_those_of_canbusload(under_test):
    log = "/run/load.log"
    output = record(under_test, log, 400)
    frames = frames_of(log, "can_rarm")
    that(len(frames) > 10000, f"{len(frames)} frames in the log")
    seconds = float(frames[-1][0].strip("()")) - float(frames[0][0].strip("()"))
    model_frames, model_bits = model_of(output, "rarm")
    equal(model_frames, len(frames), "frames that the model counted and that are in its log")
    counted, bits = canbusload_of(frames)
    equal(counted, len(frames), "frames that canbusload saw")
    within(model_bits / bits, 0.999, 1.001, f"model's bits ({model_bits:.0f}) over canbusload's ({bits})")
    return f"{counted} frames, {bits} bits in {seconds:.3f} s: {bits / BIT_RATE / seconds * 100:.2f} %, model {model_bits:.0f} bits"
