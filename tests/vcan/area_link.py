"""The emulator with a failing interface: no room to send, down, deleted and recreated, a burst, an intruder."""
import errno
import os
import signal
import subprocess
import time

from can_socket import Bus
from checks import equal, test, that, within
from limb import JOINTS, NODES, RESET_NODE, START, Limb

OWN_PROCESSES = True
# Every test restarts the emulator.
A = JOINTS[0]


def ip(*words):
    subprocess.run(["ip", *words], check=True)


def new_interface():
    ip("link", "add", "dev", "vcan1", "type", "vcan")
    ip("link", "set", "vcan1", "mtu", "72")
    ip("link", "set", "vcan1", "up")


def answers_again(limb, timeout=5.0):
    """Waits until the nodes answer; returns how long it took."""
    began = time.monotonic()
    while True:
        try:
            equal(limb.sdo(A, 0.2).u32(0x1000), 0x00020192, "1000h")
            return time.monotonic() - began
        except (AssertionError, OSError):
            limb.emulator.alive()
            if time.monotonic() - began > timeout:
                raise


def with_limb(function):
    def run(under_test):
        limb = Limb(*under_test)
        try:
            note = function(limb)
            limb.emulator.alive()
        finally:
            if limb.emulator.process.poll() is None:
                status = limb.stop()
        equal(status, 0, "exit status of the emulator at SIGINT")
        return note
    run.__name__ = function.__name__
    return run


@test(seconds=60)
@with_limb
def no_room_to_send(limb):
    """A qdisc with a small buffer makes send() fail with ENOBUFS; no frame may be lost or reordered."""
    limb.fresh()
    limb.nmt(START)
    time.sleep(0.1)
    limb.bus.drain()
    subprocess.run(["tc", "qdisc", "add", "dev", "vcan1", "root", "tbf", "rate", "128kbit", "burst", "64", "limit", "96"],
                   check=True)
    try:
        while True:  # a heartbeat may have taken the space before
            try:
                limb.sync()
                break
            except OSError as error:
                equal(error.errno, errno.ENOBUFS, "errno of a send without room")
                time.sleep(0.01)
        frames = limb.frames(1.0)
    finally:
        subprocess.run(["tc", "qdisc", "del", "dev", "vcan1", "root"], check=True)
    for node in NODES:
        for base in (0x180, 0x280):
            equal(sum(one.id == base + node for one in frames), 1, f"TPDOs {base + node:03X} after a SYNC without room to send")
    answers_again(limb)


@test(seconds=60)
@with_limb
def interface_down_and_up(limb):
    limb.fresh()
    for _ in range(3):
        ip("link", "set", "vcan1", "down")
        time.sleep(0.4)
        limb.emulator.alive()
        ip("link", "set", "vcan1", "up")
        took = answers_again(limb)
        that(took < 2, f"answers {took:.1f} s after the interface came up")


@test(seconds=60)
@with_limb
def interface_deleted_and_made_again(limb):
    limb.fresh()
    for _ in range(2):
        limb.bus.close()
        ip("link", "delete", "vcan1")
        time.sleep(0.5)
        limb.emulator.alive()
        new_interface()
        limb.bus = Bus("vcan1")
        took = answers_again(limb)
        that(took < 3, f"answers {took:.1f} s after the interface was made again")


@test(seconds=60)
@with_limb
def a_burst_longer_than_a_socket_keeps(limb):
    """2000 frames at once: those that the emulator's socket loses may be lost, but it must go on, and in the right
    state."""
    limb.fresh()
    for at in range(2000):
        limb.bus.send(0x600 + 99, bytes(8))
        if at % 500 == 0:
            limb.bus.send(0x000, b"\x01\x00")
    answers_again(limb)
    limb.bus.send(0x000, b"\x01\x00")
    for node in NODES:
        equal(limb.state(node), 5, f"NMT state of node {node}")


@test(seconds=60)
@with_limb
def stopped_process_goes_on(limb):
    """The emulator is stopped for a second (a debugger, a busy host) and continued."""
    limb.fresh()
    os.kill(limb.emulator.process.pid, signal.SIGSTOP)
    time.sleep(1.0)
    os.kill(limb.emulator.process.pid, signal.SIGCONT)
    took = answers_again(limb)
    that(took < 2, f"answers {took:.1f} s after it was let go")


@test(seconds=60)
def ends_clean_at_sigterm_and_sigint(under_test):
    for number in (signal.SIGTERM, signal.SIGINT):
        limb = Limb(*under_test)
        limb.bus.close()
        equal(limb.emulator.stop(number, 5), 0, f"exit status at {signal.Signals(number).name}")


@test(seconds=60)
@with_limb
def one_reset_by_an_intruder(limb):
    limb.fresh()
    limb.nmt(START)
    with Bus("vcan1") as intruder:
        intruder.send(0x000, bytes([RESET_NODE, A]))
    limb.await_boot([A])
    equal(limb.state(A), 0x7F, "NMT state of the node that was reset")
    equal(limb.state(JOINTS[1]), 0x05, "NMT state of another")


@test(seconds=60)
def missing_interface_is_one_sentence(under_test):
    program, scene = under_test
    ran = subprocess.run([program, "emulate", "--scene", scene, "--can", "rarm=nocan9"], capture_output=True, text=True,
                         timeout=30, check=False)
    within(ran.returncode, 2, 3, "exit status")
    that("nocan9" in ran.stderr and ran.stderr.count("\n") == 1, f"message {ran.stderr!r}")
