"""The doors as python-can's users find them: one server on socketcand and one adapter on slcan.

Usage: python_can_test.py DOOR_HARNESS [unittest arguments]

Identifiers and bytes are written out from CiA 301; nothing here shares code with the emulator.
"""

import logging
import os
import struct
import subprocess
import sys
import tempfile
import time
import unittest
import warnings

import can
import serial

HARNESS = None
NODES = range(11, 18)


class Recorder(logging.Handler):
    """Keeps what python-can complains of, but for reads that end between two messages or within one."""

    HARMLESS = ("Got incomplete message", "Bad data: No opening < found => discarding entire buffer '\n'")

    def __init__(self):
        super().__init__(logging.WARNING)
        self.lines = []

    def emit(self, record):
        if not record.getMessage().startswith(self.HARMLESS):
            self.lines.append(record.getMessage())


class DoorTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.tty = os.path.join(cls.folder.name, "ttyRARM")
        cls.harness = subprocess.Popen(
            [HARNESS, cls.tty], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        word, port = cls.harness.stdout.readline().split()
        assert word == "ready", word
        cls.port = int(port)

    @classmethod
    def tearDownClass(cls):
        cls.harness.stdin.close()
        cls.last_words = cls.harness.stdout.read()
        cls.harness.stdout.close()
        code = cls.harness.wait(timeout=10)
        cls.folder.cleanup()
        assert code == 0, code
        assert " dropped 0 " in cls.last_words, cls.last_words

    def setUp(self):
        self.complaints = Recorder()
        logging.getLogger("can").addHandler(self.complaints)
        logging.getLogger("can").propagate = False

    def tearDown(self):
        logging.getLogger("can").removeHandler(self.complaints)
        self.assertEqual(self.complaints.lines, [])

    def socketcand(self, channel="can_rarm"):
        bus = can.Bus(
            interface="socketcand", host="127.0.0.1", port=self.port, channel=channel
        )
        self.addCleanup(bus.shutdown)
        return bus

    def slcan(self, **arguments):
        bus = can.Bus(
            interface="slcan", channel=self.tty, sleep_after_open=0, **arguments
        )
        self.addCleanup(bus.shutdown)
        return bus

    def open(self):
        raise NotImplementedError

    def send(self, bus, identifier, data=b""):
        bus.send(
            can.Message(arbitration_id=identifier, data=data, is_extended_id=False)
        )

    def wait_for(self, bus, identifier, seconds=5.0):
        """The next frame with this identifier."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            message = bus.recv(0.2)
            if message is not None and message.arbitration_id == identifier:
                return message
        self.fail(f"no frame {identifier:03X} within {seconds} s")

    def collect(self, bus, seconds=0.3):
        """Every frame that comes within this time."""
        messages = []
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0:
            message = bus.recv(left)
            if message is not None:
                messages.append(message)
        return messages

    def upload(self, bus, node, index, sub=0):
        self.send(bus, 0x600 + node, struct.pack("<BHB4x", 0x40, index, sub))
        answer = bytes(self.wait_for(bus, 0x580 + node).data)
        self.assertEqual(answer[1:4], struct.pack("<HB", index, sub))
        return answer

    def download_u16(self, bus, node, index, value, sub=0):
        self.send(bus, 0x600 + node, struct.pack("<BHBH2x", 0x2B, index, sub, value))
        answer = bytes(self.wait_for(bus, 0x580 + node).data)
        self.assertEqual(answer, struct.pack("<BHB4x", 0x60, index, sub))


class Tool:
    """What a user does first, whatever the door."""

    def test_device_type_by_sdo(self):
        bus = self.open()
        for node in NODES:
            answer = self.upload(bus, node, 0x1000)
            self.assertEqual(answer[0], 0x43)
            # CiA 402, servo drive.
            self.assertEqual(struct.unpack("<I", answer[4:])[0] & 0xFFFFFF, 0x020192)

    def test_an_object_that_is_not_there(self):
        answer = self.upload(self.open(), 11, 0x5FFF)
        self.assertEqual(answer, bytes.fromhex("80FF5F0000000206"))

    def test_reset_start_sync(self):
        bus = self.open()
        self.send(bus, 0x000, bytes([0x81, 0]))
        booted = {
            m.arbitration_id for m in self.collect(bus) if bytes(m.data) == b"\x00"
        }
        self.assertEqual(booted, {0x700 + node for node in NODES})
        self.send(bus, 0x000, bytes([0x01, 0]))
        self.collect(bus)
        for _ in range(5):
            self.send(bus, 0x080)
            answers = [
                m.arbitration_id
                for m in self.collect(bus, 0.1)
                if 0x180 <= m.arbitration_id < 0x300
            ]
            expected = [base + node for base in (0x180, 0x280) for node in NODES]
            self.assertEqual(answers, expected)
        self.send(bus, 0x000, bytes([0x80, 0]))

    def test_heartbeat(self):
        bus = self.open()
        self.download_u16(bus, 13, 0x1017, 50)
        self.wait_for(bus, 0x70D)
        start = time.monotonic()
        for _ in range(20):
            self.assertEqual(bytes(self.wait_for(bus, 0x70D, 1.0).data), b"\x7f")
        self.assertAlmostEqual(time.monotonic() - start, 1.0, delta=0.5)
        self.download_u16(bus, 13, 0x1017, 0)


class Socketcand(Tool, DoorTest):
    def open(self):
        return self.socketcand()

    def test_bus_by_limb_name(self):
        self.assertEqual(self.upload(self.socketcand("larm"), 20, 0x1000)[0], 0x43)

    def test_a_bus_that_is_not_there(self):
        with warnings.catch_warnings():
            # python-can leaves its socket open.
            warnings.simplefilter("ignore", ResourceWarning)
            with self.assertRaises(can.CanError):
                self.socketcand("vcan0")

    def test_clients_see_each_other_but_not_themselves(self):
        one, two, elsewhere = self.open(), self.open(), self.socketcand("can_larm")
        self.send(one, 0x123, b"\x01\x02")
        message = self.wait_for(two, 0x123)
        self.assertEqual(bytes(message.data), b"\x01\x02")
        self.send(two, 0x124)
        self.assertEqual(self.wait_for(one, 0x124).dlc, 0)
        for bus in (one, two, elsewhere):
            identifiers = {m.arbitration_id for m in self.collect(bus, 0.1)}
            self.assertFalse(identifiers & {0x123, 0x124})

    def test_extended_identifier(self):
        one, two = self.open(), self.open()
        one.send(can.Message(arbitration_id=0x18FF1234, data=[0xAB]))
        self.assertEqual(bytes(self.wait_for(two, 0x18FF1234).data), b"\xab")

    def test_time_is_the_bus_s(self):
        bus = self.open()
        self.download_u16(bus, 12, 0x1017, 20)
        times = [self.wait_for(bus, 0x70C).timestamp for _ in range(10)]
        self.download_u16(bus, 12, 0x1017, 0)
        for before, after in zip(times, times[1:]):
            self.assertAlmostEqual(after - before, 0.020, delta=0.001)

    def test_attaching_while_the_bus_is_busy(self):
        busy = self.open()
        for node in NODES:
            self.download_u16(busy, node, 0x1017, 1)
        try:
            for _ in range(20):
                bus = self.open()
                self.wait_for(bus, 0x70B)
        finally:
            for node in NODES:
                self.download_u16(busy, node, 0x1017, 0)

    def test_syncs_answered_while_nobody_reads(self):
        one, two = self.open(), self.open()
        self.send(one, 0x000, bytes([0x01, 0]))
        for _ in range(40):
            self.send(one, 0x080)
            time.sleep(0.03)
        self.send(one, 0x000, bytes([0x80, 0]))
        for bus, syncs in ((one, 0), (two, 40)):
            identifiers = [m.arbitration_id for m in self.collect(bus)]
            self.assertEqual(identifiers.count(0x080), syncs)
            for node in NODES:
                self.assertEqual(identifiers.count(0x180 + node), 40)

    def test_a_burst_longer_than_a_read(self):
        one, two = self.open(), self.open()
        sent = list(range(300))
        for n in sent:
            self.send(one, 0x7F0, struct.pack("<Q", n))
        time.sleep(0.3)  # everything waits in the reader's socket
        received = [
            struct.unpack("<Q", m.data)[0]
            for m in self.collect(two)
            if m.arbitration_id == 0x7F0
        ]
        self.assertEqual(received, sent)


class Slcan(Tool, DoorTest):
    def open(self):
        return self.slcan(bitrate=1000000)

    def test_without_a_bit_rate(self):
        self.assertEqual(self.upload(self.slcan(), 11, 0x1000)[0], 0x43)

    def test_version_and_serial_number(self):
        bus = self.open()
        self.assertEqual(bus.get_version(2), (1, 1))
        self.assertEqual(bus.get_serial_number(2), "RARM")

    def test_frames_cross_to_socketcand(self):
        one, two = self.open(), self.socketcand()
        self.send(one, 0x123, b"\x01\x02")
        self.assertEqual(bytes(self.wait_for(two, 0x123).data), b"\x01\x02")
        two.send(can.Message(arbitration_id=0x18FF1234, data=[0xAB]))
        message = self.wait_for(one, 0x18FF1234)
        self.assertTrue(message.is_extended_id)
        self.assertEqual(bytes(message.data), b"\xab")

    def test_remote_frame(self):
        one = self.open()
        one.send(
            can.Message(
                arbitration_id=0x123, is_remote_frame=True, dlc=1, is_extended_id=False
            )
        )
        self.assertEqual(self.upload(one, 11, 0x1000)[0], 0x43)

    def test_raw_characters(self):
        port = serial.Serial(self.tty, timeout=2)
        self.addCleanup(port.close)

        def say(command, size):
            port.write(command)
            return port.read(size)

        # As the adapters' manual advises: clear what is left of an earlier session.
        port.write(b"\rC\r")
        time.sleep(0.1)
        port.reset_input_buffer()
        self.assertEqual(say(b"S6\r", 1), b"\a")
        self.assertEqual(say(b"S8\r", 1), b"\r")
        self.assertEqual(say(b"Z1\r", 1), b"\r")
        self.assertEqual(say(b"O\r", 1), b"\r")
        self.assertEqual(say(b"nonsense\r", 1), b"\a")
        answer = say(b"t60B84000100000000000\r", 2 + 26)
        self.assertEqual(answer[:2], b"z\r")
        self.assertEqual(answer[2:15], b"t58B843001000")
        self.assertLess(int(answer[23:27], 16), 60000)
        self.assertEqual(answer[27:], b"\r")
        self.assertEqual(say(b"C\r", 1), b"\r")

    def test_closed_and_opened_again(self):
        for _ in range(5):
            bus = can.Bus(
                interface="slcan", channel=self.tty, sleep_after_open=0, bitrate=1000000
            )
            self.assertEqual(self.upload(bus, 11, 0x1000)[0], 0x43)
            bus.shutdown()


if __name__ == "__main__":
    HARNESS = sys.argv.pop(1)
    unittest.main(verbosity=2)
