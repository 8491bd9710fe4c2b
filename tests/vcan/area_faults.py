"""Faults on purpose over the kernel's bus: what is lost, the controller's error frames, what the product's own master says,
and that an interface with a wire behind it is refused."""
import os
import pty
import signal
import subprocess
import time

from can_socket import Bus
from checks import equal, test, that
from faulty import SOCKET, fault, with_limb
from limb import JOINTS, START, Limb, Process
from robot import RIGHT_ARM, Robot, ip

OWN_PROCESSES = True
ELBOW = JOINTS[3]  # RElbj
BUS_OFF, RESTARTED = 0x040, 0x100  # CAN_ERR_BUSOFF, CAN_ERR_RESTARTED of linux/can/error.h


def answering(limb):
    """Nodes whose first TPDO answers a SYNC."""
    limb.mark()
    limb.bus.passed.clear()
    limb.sync()
    return sorted(frame.id - 0x180 for frame in limb.frames(0.1) if 0x180 <= frame.id < 0x200)


@test(seconds=60)
@with_limb
def frames_of_one_device_are_lost_until_they_are_not(limb):
    limb.fresh()
    limb.nmt(START)
    everybody = answering(limb)
    that(set(JOINTS) <= set(everybody), f"without a fault these answer: {everybody}")
    fault(limb.program, "inject", "RElbj", "frame-drop", "share=1", "direction=from")
    equal(answering(limb), [node for node in everybody if node != ELBOW], "nodes that answer with RElbj's frames lost")
    fault(limb.program, "clear", "all")
    equal(answering(limb), everybody, "nodes that answer with the fault cleared")


@test(seconds=60)
@with_limb
def a_controller_that_is_bus_off_says_so_in_an_error_frame(limb):
    limb.fresh()
    limb.nmt(START)
    everybody = answering(limb)

    def error_frames(seen, ends):
        while not seen() and time.monotonic() < ends:
            frame = errors.receive(0.2)
            if frame is not None and frame.error:
                told.append(frame.id)

    with Bus("vcan1", errors=True, filters=[]) as errors:
        told = []
        error_frames(lambda: told, time.monotonic() + 0.3)
        equal(told, [], "error frames without a fault")
        fault(limb.program, "inject", "rarm", "computer-bus-off")
        limb.sync()  # the first frame that it sends is its last
        error_frames(lambda: any(one & BUS_OFF for one in told), time.monotonic() + 5)
        that(any(one & BUS_OFF for one in told), f"no error frame with CAN_ERR_BUSOFF, but {[hex(one) for one in told]}")
        fault(limb.program, "clear", "all")
        error_frames(lambda: told[-1] & RESTARTED, time.monotonic() + 10)
        that(told[-1] & RESTARTED, f"no error frame with CAN_ERR_RESTARTED, but {[hex(one) for one in told]}")
    ends = time.monotonic() + 20  # a restart from before it was cleared ends in bus-off once more, and loses frames
    back = []
    while back != everybody and time.monotonic() < ends:
        try:
            back = answering(limb)
        except AssertionError:
            pass
    equal(back, everybody, "nodes that answer when the controller is back")


@test(seconds=120)
def a_node_of_another_program_is_one_of_the_bus(under_test):
    """The elbow is one emulator's, all other nodes are another's."""
    program, scene = under_test
    here = ("--realtime", "--timing", "none")
    elbow = Process([program, "emulate", "--scene", scene, "--can", "rarm=vcan1", "--only", "RElbj", "--camera", "127.77.8.1",
                     *here], "elbow")
    limb = None
    try:
        limb = Limb(program, scene, options=(*here, "--without", "RElbj"))
        limb.fresh()
        limb.nmt(START)
        everybody = answering(limb)
        equal([node for node in everybody if node in JOINTS], list(JOINTS), "drives that answer, each once")
        equal(elbow.stop(), 0, "exit status of the elbow's program at SIGINT")
        equal(answering(limb), [node for node in everybody if node != ELBOW], "nodes that answer without it")
    finally:
        elbow.stop()
        status = limb.stop() if limb else 0
    equal(status, 0, "exit status of the emulator")


@test(seconds=240)
def the_master_names_the_device_whose_pdos_are_frozen_and_stops(under_test):
    """In lock-step: the drives keep their last set-point, then their brakes."""
    robot = Robot(under_test, "--fault-socket", SOCKET)
    try:
        robot.start_master()
        robot.running(1500)
        that(robot.all_enabled(), "every drive is enabled before the fault")
        fault(robot.program, "inject", "RElbj", "pdo-frozen")
        while robot.master.process.poll() is None:
            frame = robot.arm.receive(0.2)
            if frame is not None:
                robot.note(frame)
        result, status = robot.result(1)
        equal(status, 1, "exit status of the master")
        that("RElbj" in result["reason"], f"the reason names the elbow: {result}")
        told = robot.states_after()
        equal({node: told.get(node) for node in RIGHT_ARM}, dict.fromkeys(RIGHT_ARM, 4), "NMT states of the arm's nodes (4: stopped)")
        robot.emulator.alive()
    finally:
        status = robot.stop()
    equal(status, 0, "exit status of the emulator")
    return result["reason"]


def serial_adapter():
    """slcan0 over a pseudo-terminal, and what ends it."""
    if not any(line.startswith("slcan ") for line in open("/proc/tty/ldiscs", encoding="ascii")):
        release = os.uname().release
        found = subprocess.run(["find", "/lib/modules", "/usr/lib/uml/modules", "-path", f"*/{release}/*", "-name", "slcan.ko"],
                               capture_output=True, text=True, check=False).stdout.split()
        subprocess.run(["insmod", found[0]], check=True)
    adapter, line = pty.openpty()
    attached = subprocess.Popen(["slcand", "-o", "-c", "-s8", "-F", os.ttyname(line), "slcan0"])
    for _ in range(100):
        if os.path.exists("/sys/class/net/slcan0"):
            break
        time.sleep(0.05)
    ip("link", "set", "slcan0", "up")
    return adapter, attached


@test(seconds=60)
def an_interface_with_a_wire_behind_it_is_refused(under_test):
    """A serial adapter's, which has no device of its own in /sys either."""
    program, scene = under_test
    plan = "/run/plan.yaml"
    with open(plan, "w", encoding="ascii") as file:
        file.write("faults:\n  - {fault: pdo-frozen, target: RElbj, at_s: 0.1}\n")
    adapter, attached = serial_adapter()

    def emulate(interface, *options):
        return subprocess.run([program, "emulate", "--scene", scene, "--can", f"rarm={interface}", "--realtime", "--camera",
                               "127.9.9.5", "--duration", "0.3", *options], capture_output=True, text=True, timeout=30,
                              check=False)
    try:
        for options in (("--faults", plan), ("--fault-socket", SOCKET)):
            refused = emulate("slcan0", *options)
            equal(refused.returncode, 2, f"exit status with {options}: {refused.stderr}")
            that("slcan0" in refused.stderr and "--faults-on-hardware" in refused.stderr and refused.stderr.count("\n") == 1,
                 f"message {refused.stderr!r}")
            for interface, more in (("slcan0", ["--faults-on-hardware"]), ("vcan1", [])):
                equal(emulate(interface, *options, *more).returncode, 0, f"exit status on {interface} with {options} {more}")
    finally:
        attached.send_signal(signal.SIGTERM)
        attached.wait(10)
        os.close(adapter)
