"""What a user's own master has to notice, shown with python-can on the right elbow (node 14).

    WALKMAN_HIL=./walkman-hil pytest examples/faults
"""
import threading
import time

import can
import pytest

ELBOW = 14
SYNC, TPDO4, EMERGENCY, HEARTBEAT, SDO_ANSWER = 0x080, 0x480 + ELBOW, 0x080 + ELBOW, 0x700 + ELBOW, 0x580 + ELBOW


class Master:
    """Sends SYNC every 5 ms and keeps what has been received, by identifier."""

    def __init__(self, bus):
        self.bus, self.stopped = bus, threading.Event()
        self.lock, self.frames = threading.Lock(), {}
        self.threads = [threading.Thread(target=job, daemon=True) for job in (self._listen, self._pace)]
        self.send(0x000, [0x01, 0x00])  # NMT start of all nodes
        self.send(0x600 + ELBOW, [0x2B, 0x17, 0x10, 0x00, 100, 0, 0, 0])  # 1017h: a heartbeat every 100 ms
        for thread in self.threads:
            thread.start()

    def send(self, identifier, data=()):
        self.bus.send(can.Message(arbitration_id=identifier, data=bytes(data), is_extended_id=False))

    def _pace(self):
        while not self.stopped.wait(0.005):
            self.send(SYNC)

    def _listen(self):
        while not self.stopped.is_set():
            message = self.bus.recv(0.1)
            if message is not None:
                with self.lock:
                    self.frames.setdefault(message.arbitration_id, []).append(bytes(message.data))

    def waited_for(self, identifier, start, limit=5.0):
        """Returns whether a payload that begins with these bytes has been received, or is within the limit."""
        end = time.monotonic() + limit
        while time.monotonic() < end:
            with self.lock:
                if any(payload.startswith(start) for payload in self.frames.get(identifier, [])):
                    return True
            time.sleep(0.01)
        return False

    def heard(self, identifier, seconds):
        """Returns the payloads of an identifier received from now on."""
        with self.lock:
            self.frames.pop(identifier, None)
        time.sleep(seconds)
        with self.lock:
            return list(self.frames.get(identifier, []))

    def close(self):
        self.stopped.set()
        for thread in self.threads:
            thread.join()
        self.bus.shutdown()


@pytest.fixture
def master(robot):
    one = Master(robot.bus("rarm"))
    yield one
    one.close()


def test_a_hanging_firmware_repeats_its_bytes_while_its_heart_beats(robot, master):
    assert len(set(master.heard(TPDO4, 1.0))) > 3  # its counter 2050h keeps counting
    name = robot.inject("RElbj", "pdo-frozen")
    frozen = master.heard(TPDO4, 1.0)
    assert len(frozen) > 3 and len(set(frozen)) == 1
    assert master.heard(HEARTBEAT, 0.5)
    robot.clear(name)
    assert len(set(master.heard(TPDO4, 1.0))) > 3


def test_a_lost_heartbeat_comes_back_by_itself(robot, master):
    assert master.heard(HEARTBEAT, 0.5)
    robot.inject("heartbeat-loss", "RElbj", lasts="600ms")
    assert not master.heard(HEARTBEAT, 0.4)
    assert len(master.heard(HEARTBEAT, 1.0)) > 3
    assert robot.active()[0]["stage"] == "over"


def test_a_trip_of_the_power_stage_is_told_by_an_emergency(robot, master):
    robot.inject("RElbj", "overcurrent-trip")
    assert master.waited_for(EMERGENCY, b"\x10\x23")  # 2310h


def test_what_cannot_break_is_refused(robot):
    with pytest.raises(ValueError, match="not a drive"):
        robot.inject("r_arm_ft", "joint-locked")
