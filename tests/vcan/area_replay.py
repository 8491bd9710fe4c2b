"""`walkman-hil replay LOG --can ...`: the frames of a log on the kernel's interfaces, at their times."""
import json
import os
import signal
import struct
import time

from can_socket import Bus, show
from checks import equal, test, that, within
from limb import Process

OWN_PROCESSES = True
LOG = "/run/frames.log"
LINES = """(1700000000.000000) can_rarm 000#8200
(1700000000.100000) can_rarm 70B#00
(1700000000.200000) can_torso 601#4000100000000000
(1700000000.200500) can_rarm 60B#4000100000000000
(1700000000.300000) can_rarm 70B#R1
(1700000000.300100) can_rarm 123##1AABBCCDDEEFF001122334455
(1700000000.400000) can_rarm 20000004#0000000000006000
(1700000000.600000) can_rarm 080#
(1700000000.600000) can_rarm 77F#05
"""
MAPPED = ["000#8200", "70B#00", "60B#4000100000000000", "70B#R", "123##AABBCCDDEEFF001122334455", "080#", "77F#05"]


def replay(under_test, *options, log=LINES):
    with open(LOG, "w", encoding="ascii") as file:
        file.write(log)
    return Process([under_test[0], "replay", LOG, "--can", "can_rarm=vcan1", "--json", *options], "replay")


def ended(process, status=0):
    equal(process.process.wait(30), status, f"exit status, with {process.output()!r}")
    return printed(process)


def printed(process):
    """Returns the JSON, after anything printed on stderr."""
    text = process.output()
    return json.loads(text[text.index("{"):])


def heard(bus):
    frames = []
    while (frame := bus.receive(0.3)) is not None:
        frames.append(frame)
    return frames


@test(attempts=3)
def every_frame_at_its_time(under_test):
    with Bus("vcan1", fd=True) as bus, Bus("vcan0") as other:
        result = ended(replay(under_test))
        frames = heard(bus)
        that(other.receive(0) is None, "a frame on an interface that was not named")
    equal([show(frame) for frame in frames], MAPPED, "frames")
    equal((result["sent"], result["skipped"], result["refused"], result["interrupted"]), (7, 2, 0, False), "counts")
    offsets = [frame.time - frames[0].time for frame in frames]
    for got, logged in zip(offsets, (0, 0.1, 0.2005, 0.3, 0.3001, 0.6, 0.6)):
        within(got, logged - 0.05, logged + 0.05, "s from the first frame")


@test
def a_gap_is_told_where_it_is_waited_through(under_test):
    log = "(1700000000.000000) can_rarm 080#\n(1700000003.000000) can_rarm 080#\n"
    told = {}
    for speed in (1, 10):
        process = replay(under_test, "--speed", str(speed), log=log)
        equal(process.process.wait(30), 0, f"exit status, with {process.output()!r}")
        told[speed] = process.output().count("no frame in the log for")
    equal(told, {1: 1, 10: 0}, "sentences about the gap of 3 s, by speed")


@test
def as_fast_as_possible_and_a_computers_only(under_test):
    with Bus("vcan1", fd=True) as bus:
        result = ended(replay(under_test, "--speed", "0", "--master-only"))
        text = [show(frame) for frame in heard(bus)]
    equal(text, ["000#8200", "60B#4000100000000000", "70B#R", "080#", "77F#05"], "frames")
    equal((result["sent"], result["skipped"]), (5, 4), "counts")
    within(result["seconds"], 0, 0.3, "s")


@test(seconds=60)
def many_frames_in_order_through_a_short_queue(under_test):
    """At 128 kbit/s as counted by tbf, the kernel's queue is full nearly all the time."""
    count = 500
    log = "".join(f"(1700000000.000000) can_rarm 201#{at:04X}\n" for at in range(count))
    os.system("tc qdisc add dev vcan1 root tbf rate 128kbit burst 160 limit 320")
    try:
        with Bus("vcan1") as bus:
            result = ended(replay(under_test, log=log))
            numbers = [struct.unpack(">H", frame.data)[0] for frame in heard(bus)]
    finally:
        os.system("tc qdisc del dev vcan1 root")
    equal(numbers, list(range(count)), "frames")
    equal((result["sent"], result["refused"]), (count, 0), "counts")


@test
def ctrl_c_ends_it(under_test):
    log = "(1700000000.000000) can_rarm 201#00\n(1700000100.000000) can_rarm 201#01\n"
    with Bus("vcan1") as bus:
        process = replay(under_test, log=log)
        bus.expect(0x201)
        began = time.monotonic()
        equal(process.stop(signal.SIGINT), 1, "exit status")
        within(time.monotonic() - began, 0, 1.5, "s to the end")
        equal(len(heard(bus)), 0, "frames after the interruption")
    result = printed(process)
    equal((result["sent"], result["interrupted"]), (1, True), "what it printed")


@test
def a_refused_frame_is_a_failure(under_test):
    os.system("ip link set vcan1 down")
    try:
        result = ended(replay(under_test, "--speed", "0"), 1)
    finally:
        os.system("ip link set vcan1 up")
    equal((result["sent"], result["refused"]), (0, 7), "counts")
