"""The product's own master and its failures: killed, a node that reboots, bus-off, an interface down or recreated, a
receive queue that overflows. In lock-step, so that nothing depends on how busy the host is."""
import errno
import functools
import os
import resource
import signal
import struct
import time

import drive
from can_socket import Bus
from checks import equal, test, that, within
from limb import RESET_NODE
from robot import MASTER, RIGHT_ARM, Robot, ip
from sdo import Sdo

OWN_PROCESSES = True
PERIOD_MS = 5
MEGABYTE = 1 << 20


def running(robot):
    robot.running(1500)  # frames of the arm's bus: by then the other limbs' drives are enabled too


def booting(robot):
    robot.watch(lambda: robot.syncs_since_beat > 3, 60, "the first SYNCs")


def with_robot(function, reached=running):
    @functools.wraps(function)
    def run(under_test):
        robot = Robot(under_test)
        try:
            robot.start_master()
            reached(robot)
            note = function(robot)
            robot.emulator.alive()
        finally:
            status = robot.stop()
        equal(status, 0, "exit status of the emulator")
        return note
    return run


with_booting_robot = functools.partial(with_robot, reached=booting)


def other_buses_go_on(robot, cycles=3):
    """Waits until the master has sent some more SYNCs on another bus, or has ended: it may be computing at first."""
    with Bus("vcan0", filters=[(0x080, 0x7FF)]) as torso:
        for _ in range(cycles):
            while torso.receive(0.2) is None and robot.master.process.poll() is None:
                pass


def falls_silent(robot):
    """Waits until the master has sent SYNC twice on another bus, or has ended; returns whether there was none on the
    arm's. It sends to the torso first: the arm's socket is opened before, and has received the counterpart of the first
    SYNC when the second comes."""
    sync = [(0x080, 0x7FF)]
    with Bus("vcan1", filters=sync) as arm, Bus("vcan0", filters=sync) as torso:
        seen = 0
        while seen < 2 and robot.master.process.poll() is None:
            seen += torso.receive(0.2) is not None
        return arm.receive(0) is None


@test(seconds=240)
@with_robot
def killed_master_and_the_drives_stop(robot):
    """kill -9: the arm's drives quick-stop by their heartbeat consumer, within its time and one cycle. After the kill
    the test sends SYNC: cycles of 5 ms."""
    robot.master.process.send_signal(signal.SIGKILL)
    robot.master.process.wait()
    robot.master = None
    while (frame := robot.arm.receive(0.3)) is not None:  # what it had already sent, in order
        robot.note(frame)
    since_beat = robot.syncs_since_beat
    that(robot.all_enabled(), f"states before the loss: {[drive.state(word) for word in robot.words.values()]}")
    buses = [Bus(f"vcan{at}", filters=[]) for at in range(5)]
    first_sign, lost, configured = {}, {}, 250
    for cycle in range(since_beat + 1, since_beat + 101):
        for bus in buses:
            bus.send(0x080)
        began = time.monotonic()
        while time.monotonic() - began < 0.5:
            frame = robot.arm.receive(0.03)
            if frame is None:
                break
            robot.note(frame)
            node = frame.id & 0x7F
            if frame.id & 0x780 == 0x180 and node in RIGHT_ARM and drive.state(robot.words[node]) != "operation enabled":
                first_sign.setdefault(node, (cycle, drive.state(robot.words[node])))
            if frame.id & 0x780 == 0x080 and node in RIGHT_ARM and struct.unpack_from("<H", frame.data)[0] == 0x8130:
                lost.setdefault(node, cycle)
        if len(lost) == len(RIGHT_ARM):
            break
    equal(sorted(lost), sorted(RIGHT_ARM), "drives that told EMCY 8130h")
    for node in RIGHT_ARM:
        within(lost[node] * PERIOD_MS, configured, configured + 2 * PERIOD_MS, f"ms of emulated time to EMCY 8130h of node {node}")
    for node in RIGHT_ARM:
        sdo = Sdo(robot.arm, node)
        equal(sdo.u32(0x1016, 1), MASTER << 16 | configured, f"1016h:1 of node {node}")
        state = drive.state(sdo.u16(0x6041))
        that(state in ("quick stop active", "switch on disabled"), f"node {node} is in state '{state}'")
    for bus in buses:
        bus.close()
    told = sorted({state for _, state in first_sign.values()}) or "none, the drives left NMT operational"
    return f"EMCY 8130h {min(lost.values())} to {max(lost.values())} cycles after the last heartbeat; by TPDO1: {told}"


@test(seconds=240)
@with_robot
def ctrl_c_stops_drives_and_nodes(robot):
    """Quick stop, then NMT stop, and one sentence; afterwards the nodes are in state stopped."""
    with Bus("vcan1", filters=[(0x000, 0x7FF), (0x200 + 13, 0x7FF)]) as spy:
        robot.master.process.send_signal(signal.SIGINT)
        result, status = robot.result(30)
        equal(status, 1, "exit status of the master")
        equal((result["done"], result["outcome"], result["reason"]), (False, "stopped", "interrupted"), "what it printed")
        sent = []
        while (frame := spy.receive(0.1)) is not None:
            sent.append(frame)
    equal((sent[-1].id, sent[-1].data), (0x000, b"\x02\0"), "last command on the bus, NMT stop to all")
    quick_stop = struct.unpack_from("<H", sent[-2].data)[0]
    equal((sent[-2].id, quick_stop & 0x86), (0x200 + 13, 0x02), "controlword before it, quick stop")
    states = robot.states_after()
    equal(states, dict.fromkeys((*RIGHT_ARM, 18), 0x04), "NMT states told by heartbeats")
    for node in RIGHT_ARM:
        that(drive.state(robot.words[node]) in ("operation enabled", "quick stop active", "switch on disabled"),
             f"node {node} in state {drive.state(robot.words[node])}")
    with Bus("vcan1") as bus:  # pre-operational again: the torque is off
        bus.send(0x000, b"\x80\0")
        robot.states_after(2)
        for node in RIGHT_ARM:
            equal(drive.state(Sdo(bus, node).u16(0x6041)), "switch on disabled", f"state of drive {node}")


def nodes_are_stopped(robot):
    states = robot.states_after()
    that(all(state == 0x04 for state in states.values()), f"NMT states told by heartbeats: {states}")


@test(seconds=240)
@with_booting_robot
def ctrl_c_while_the_robot_boots(robot):
    robot.master.process.send_signal(signal.SIGINT)
    result, status = robot.result(30)
    equal((status, result["reason"]), (1, "interrupted"), "how the master ended")
    nodes_are_stopped(robot)


@test(seconds=240)
@with_booting_robot
def what_nobody_stops_for_a_reason_is_a_defect(robot):
    """The master's memory is taken away before the first cloud arrives: not an outcome but an internal error; its
    drives are stopped all the same."""
    master = robot.master.process
    with open(f"/proc/{master.pid}/statm", encoding="ascii") as file:
        in_use = int(file.read().split()[0]) * resource.getpagesize()
    resource.prlimit(master.pid, resource.RLIMIT_AS, (in_use + MEGABYTE, in_use + MEGABYTE))
    equal(master.wait(120), 5, f"exit status of the master: {robot.master.output()[-300:]!r}")
    said = robot.master.output()
    that("internal error" in said and "bad_alloc" in said, f"what it said: {said[-300:]!r}")
    nodes_are_stopped(robot)


GOES_ON = 4000  # consecutive frames of the arm's bus with every drive in operation enabled: a few seconds of emulated time


def result_after(robot):
    """While nothing is held, the master recovers what a fault took away and goes on: then it is ended by SIGINT. What
    it cannot recover ends the run."""
    robot.words.clear()
    seen, began, deadline = 0, time.time(), time.monotonic() + 120
    while robot.master.process.poll() is None and seen < GOES_ON:
        that(time.monotonic() < deadline, f"the master neither goes on nor ends: {robot.master.output()[-300:]!r}")
        try:
            frame = robot.arm.receive(0.2)
        except OSError as error:  # the kernel reports once that the interface was down
            equal(error.errno, errno.ENETDOWN, "error of the test's own socket")
            continue
        if frame is not None and frame.time >= began:  # frames waiting in the socket from before are ignored
            robot.note(frame)
            seen = seen + 1 if robot.all_enabled() else 0
    if robot.master.process.poll() is None:
        robot.master.process.send_signal(signal.SIGINT)
    result, status = robot.result(60)
    equal(status, 1, "exit status of the master")
    return result


def judged(result, cause):
    if result["reason"] == "interrupted":
        that(result["recoveries"] >= 1, f"it went on, but has recovered from nothing: {result}")
        return f"recovered from {result['recoveries']} faults, and went on"
    that(cause in result["reason"], f"the reason does not tell of {cause}: {result}")
    return f"ended safe: {result['reason']}"


@test(seconds=240)
@with_robot
def a_node_reboots_in_the_middle(robot):
    with Bus("vcan1", filters=[]) as intruder:
        intruder.send(0x000, bytes([RESET_NODE, 13]))
    return judged(result_after(robot), "RShYaw")


@test(seconds=240)
@with_robot
def bus_off_and_back(robot):
    """Error frames as a controller sends them: bus-off, restarted some cycles later (can/error.h). During bus-off a
    controller receives nothing, but here the nodes' frames still arrive; one after the report contradicts it. So
    bus-off is reported at different moments of a cycle until the master has received it last."""
    with Bus("vcan1", filters=[]) as controller:
        for attempt in range(400):
            time.sleep(attempt % 20 * 0.5e-3)
            controller.send(0x040, bytes(8), error=True)
            if falls_silent(robot):
                break
        else:
            that(False, "the master never saw the report as the last frame of a cycle")
        other_buses_go_on(robot)
        controller.send(0x100, bytes(8), error=True)
    return judged(result_after(robot), "bus-off")


@test(seconds=240)
@with_robot
def another_masters_set_point_is_a_warning(robot):
    """A frame that only a master sends: one sentence when it arrives, and in the result."""
    with Bus("vcan1", filters=[]) as intruder:
        intruder.send(0x30B, bytes(8))
    ends = time.monotonic() + 60
    while "warning" not in robot.master.output():
        robot.master.alive()
        that(time.monotonic() < ends, "no warning within 60 s")
        robot.running(10)
    robot.master.process.send_signal(signal.SIGINT)
    result, _ = robot.result(60)
    equal(len(result["warnings"]), 1, f"warnings: {result['warnings']}")
    that("vcan1" in result["warnings"][0] and "30Bh" in result["warnings"][0], result["warnings"][0])
    return result["warnings"][0]


@test(seconds=240)
@with_robot
def a_flooded_bus_is_named(robot):
    """Frames of the highest priority, faster than the bus can carry them."""
    with Bus("vcan1", filters=[]) as intruder:
        ends = time.monotonic() + 120
        while robot.master.process.poll() is None:
            that(time.monotonic() < ends, f"the master goes on: {robot.master.output()[-300:]!r}")
            try:
                for _ in range(50):
                    intruder.send(0x001, bytes(8))
            except OSError as error:
                equal(error.errno, errno.ENOBUFS, "error of the test's own socket")
            time.sleep(1e-3)
    result, status = robot.result(60)
    equal((status, result["outcome"]), (1, "stopped"), "how the master ended")
    that("vcan1: flooded" in result["reason"], f"the reason does not tell of the flood: {result['reason']}")
    return result["reason"]


@test(seconds=240)
@with_robot
def another_robot_in_the_middle(robot):
    """The emulator is killed and restarted while the arm is away from a new robot's initial position: no jump to the
    old set-points."""
    robot.moving(by=0.3, seconds=150, silence=60)  # the master computes between two cycles
    robot.emulator.process.send_signal(signal.SIGKILL)
    robot.emulator.process.wait()
    robot.start_emulator()
    result, status = robot.result(120)
    equal((status, result["outcome"]), (1, "stopped"), "how the master ended")
    that("its last set-point" in result["reason"], f"the reason does not tell of another robot: {result['reason']}")
    return result["reason"]


@test(seconds=240)
@with_robot
def interface_down_and_up(robot):
    ip("link", "set", "vcan1", "down")
    other_buses_go_on(robot)
    ip("link", "set", "vcan1", "up")
    return judged(result_after(robot), "interface is down")


@test(seconds=240)
@with_robot
def interface_deleted_and_made_again(robot):
    ip("link", "delete", "vcan1")
    other_buses_go_on(robot)
    ip("link", "add", "dev", "vcan1", "type", "vcan")
    ip("link", "set", "vcan1", "mtu", "72")
    ip("link", "set", "vcan1", "up")
    robot.arm.close()
    robot.arm = Bus("vcan1")
    return judged(result_after(robot), "vcan1")


@test(seconds=240)
@with_robot
def receive_overflow_is_counted(robot):
    """The master is stopped, its socket gets more frames than it holds, and the master continues."""
    os.kill(robot.master.process.pid, signal.SIGSTOP)
    with Bus("vcan1", filters=[]) as flood:
        for at in range(20000):
            flood.send(0x181 + at % 8 + 10, bytes(8))
    os.kill(robot.master.process.pid, signal.SIGCONT)
    result = result_after(robot)
    that(result["receive_overflows"] > 0, f"no lost frame counted: {result}")
    return f"{result['receive_overflows']} lost; {result['reason']}"
