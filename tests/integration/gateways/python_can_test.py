"""The gateways as seen by python-can's users: one server for socketcand and one adapter for slcan.

Usage: python_can_test.py GATEWAY_HARNESS [unittest arguments]

Identifiers and bytes are written out from CiA 301; nothing here shares code with the emulator.
"""

import http.client
import logging
import os
import socket
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
    """Keeps python-can's complaints, except about reads that end between two messages or within one."""

    HARMLESS = ("Got incomplete message", "Bad data: No opening < found => discarding entire buffer '\n'")

    def __init__(self):
        super().__init__(logging.WARNING)
        self.lines = []

    def emit(self, record):
        if not record.getMessage().startswith(self.HARMLESS):
            self.lines.append(record.getMessage())


class GatewayTest(unittest.TestCase):
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
        self.began = time.monotonic()
        self.complaints = Recorder()
        logging.getLogger("can").addHandler(self.complaints)
        logging.getLogger("can").propagate = False

    def tearDown(self):
        print(f"{time.monotonic() - self.began:.1f} s", end=" ", file=sys.stderr)
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

    def frames(self, bus, seconds=20.0):
        """Yields frames as they arrive, for this long: a limit that a loaded machine meets."""
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0:
            message = bus.recv(left)
            if message is not None:
                yield message

    def wait_for(self, bus, identifier):
        """Returns the next frame with this identifier."""
        for message in self.frames(bus):
            if message.arbitration_id == identifier:
                return message
        self.fail(f"no frame {identifier:03X}")

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
    """What a user tries first, with any gateway."""

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
        booted = set()
        for message in self.frames(bus):
            if 0x700 < message.arbitration_id and bytes(message.data) == b"\x00":
                booted.add(message.arbitration_id - 0x700)
            if len(booted) == len(NODES):
                break
        self.assertEqual(booted, set(NODES))
        self.send(bus, 0x000, bytes([0x01, 0]))
        expected = [base + node for base in (0x180, 0x280) for node in NODES]
        for _ in range(5):
            self.send(bus, 0x080)
            answers = []
            for message in self.frames(bus):
                if 0x180 <= message.arbitration_id < 0x300:
                    answers.append(message.arbitration_id)
                if len(answers) == len(expected):
                    break
            self.assertEqual(answers, expected)
        self.send(bus, 0x000, bytes([0x80, 0]))

    def test_heartbeat(self):
        bus = self.open()
        self.download_u16(bus, 13, 0x1017, 50)
        self.wait_for(bus, 0x70D)
        # On a loaded machine the emulator catches up in bursts: the time is measured on the bus, below.
        for _ in range(20):
            self.assertEqual(bytes(self.wait_for(bus, 0x70D).data), b"\x7f")
        self.download_u16(bus, 13, 0x1017, 0)


class Socketcand(Tool, GatewayTest):
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
        # The other bus's answer to this comes after anything that could have crossed over.
        self.send(elsewhere, 0x600 + 20, bytes.fromhex("4000100000000000"))
        for bus, last in ((one, 0x125), (two, 0x126), (elsewhere, 0x580 + 20)):
            self.send(two, 0x125)
            self.send(one, 0x126)
            seen = []
            for message in self.frames(bus):
                seen.append(message.arbitration_id)
                if message.arbitration_id == last:
                    break
            self.assertEqual(seen[-1:], [last])
            self.assertFalse(set(seen) & {0x123, 0x124})

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
        def set_heartbeats(ms):
            bus = self.open()
            for node in NODES:
                self.download_u16(bus, node, 0x1017, ms)
            bus.shutdown()

        set_heartbeats(5)
        try:
            for _ in range(10):
                bus = self.open()
                self.wait_for(bus, 0x70B)
                bus.shutdown()
        finally:
            set_heartbeats(0)

    def test_syncs_answered_while_nobody_reads(self):
        one, two = self.open(), self.open()
        self.send(one, 0x000, bytes([0x01, 0]))
        for _ in range(40):
            self.send(one, 0x080)
            self.wait_for(one, 0x280 + NODES[-1])
        self.send(one, 0x000, bytes([0x80, 0]))
        self.send(one, 0x7F1)
        identifiers = []
        for message in self.frames(two):
            identifiers.append(message.arbitration_id)
            if message.arbitration_id == 0x7F1:
                break
        for identifier in [0x080] + [0x180 + node for node in NODES]:
            self.assertEqual(identifiers.count(identifier), 40)

    def test_a_burst_longer_than_a_read(self):
        one, two = self.open(), self.open()
        sent = list(range(300))
        for n in sent:
            self.send(one, 0x7F0, struct.pack("<Q", n))
        time.sleep(0.3)  # all frames are waiting in the reader's socket
        received = [
            struct.unpack("<Q", self.wait_for(two, 0x7F0).data)[0] for _ in sent
        ]
        self.assertEqual(received, sent)


class SocketcandByHand(GatewayTest):
    """The protocol's messages themselves, as described in doc/protocol.md of linux-can/socketcand."""

    def connect(self):
        client = socket.create_connection(("127.0.0.1", self.port))
        self.addCleanup(client.close)
        client.settimeout(20.0)
        self.text = b""
        self.assertEqual(self.message(client), "< hi >")
        return client

    def message(self, client):
        while b">" not in self.text:
            more = client.recv(4096)
            if not more:
                return "closed"
            self.text += more
        message, self.text = self.text.split(b">", 1)
        return message.decode().lstrip() + ">"

    def say(self, client, *commands):
        for command in commands:
            client.sendall(command.encode())
            self.assertEqual(self.message(client), "< ok >", command)

    def test_a_web_page_cannot_reset_the_drives(self):
        witness = self.socketcand()
        body = "< open can_rarm >< rawmode >< send 0 2 81 0 >"
        for method in ("GET", "POST"):
            page = http.client.HTTPConnection("127.0.0.1", self.port, timeout=20)
            self.addCleanup(page.close)
            with self.assertRaises((http.client.HTTPException, OSError)):
                page.request(method, "/", body=body)
                page.getresponse()
        time.sleep(0.2)
        self.send(witness, 0x60B, bytes.fromhex("4000100000000000"))
        for message in self.frames(witness):
            self.assertNotEqual(bytes(message.data), b"\x00", "a boot-up message")
            if message.arbitration_id == 0x58B:
                return
        self.fail("no answer")

    def test_a_bad_open_is_answered_and_the_connection_closed(self):
        client = self.connect()
        client.sendall(b"< open vcan0 >")
        self.assertEqual(self.message(client), "< error could not open bus >")
        self.assertEqual(self.message(client), "closed")

    def test_subscription_in_mode_bcm(self):
        client = self.connect()
        self.say(client, "< open can_rarm >")
        client.sendall(b"< subscribe 0 0 58B >< send 60B 8 40 0 10 0 0 0 0 0 >< send 60C 8 40 0 10 0 0 0 0 0 >")
        self.assertRegex(self.message(client), r"^< frame 58B [0-9]+\.[0-9]{6} 43 00 10 00 92 01 [0-9A-F]{2} 00  >$")
        client.sendall(b"< echo >")
        self.assertEqual(self.message(client), "< echo >")

    def test_a_frame_at_an_interval(self):
        witness, client = self.socketcand(), self.connect()
        self.say(client, "< open can_rarm >")
        client.sendall(b"< add 0 50000 7F2 2 AB CD >")
        times = []
        for _ in range(5):
            message = self.wait_for(witness, 0x7F2)
            self.assertEqual(bytes(message.data), b"\xab\xcd")
            times.append(message.timestamp)
        for before, after in zip(times, times[1:]):
            self.assertAlmostEqual(after - before, 0.050, delta=0.003)
        client.sendall(b"< update 7F2 1 5 >")
        while bytes(self.wait_for(witness, 0x7F2).data) != b"\x05":
            pass
        client.close()  # ends the job
        self.send(witness, 0x60B, bytes.fromhex("4000100000000000"))
        self.wait_for(witness, 0x58B)
        time.sleep(0.2)
        self.send(witness, 0x60C, bytes.fromhex("4000100000000000"))
        self.assertLessEqual([m.arbitration_id for m in self.until(witness, 0x58C)].count(0x7F2), 1)

    def until(self, bus, identifier):
        for message in self.frames(bus):
            yield message
            if message.arbitration_id == identifier:
                return

    def test_statistics_in_mode_control(self):
        client = self.connect()
        self.say(client, "< open can_rarm >", "< controlmode >")
        client.sendall(b"< statistics 50 >")
        for _ in range(3):
            self.assertRegex(self.message(client), r"^< stat [0-9]+ [0-9]+ 0 0 >$")
        client.sendall(b"< statistics 0 >")

    def test_remote_frame_by_its_flag(self):
        other = self.slcan(bitrate=1000000)
        client = self.connect()
        self.say(client, "< open can_rarm >", "< rawmode >")
        client.sendall(b"< send 4000070B 1 0 >")
        message = self.wait_for(other, 0x70B)
        self.assertTrue(message.is_remote_frame and message.is_extended_id)


class Slcan(Tool, GatewayTest):
    def open(self):
        return self.slcan(bitrate=1000000)

    def test_without_a_bit_rate(self):
        self.assertEqual(self.upload(self.slcan(), 11, 0x1000)[0], 0x43)

    def test_version_and_serial_number(self):
        bus = self.open()
        self.assertEqual(bus.get_version(20), (1, 1))
        self.assertEqual(bus.get_serial_number(20), "RARM")

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
        port = serial.Serial(self.tty, timeout=20)
        self.addCleanup(port.close)

        def say(command, size):
            port.write(command)
            return port.read(size)

        # Answers of an earlier session may be left.
        port.write(b"\rC\rV\r")
        self.assertTrue(port.read_until(b"V0101\r").endswith(b"V0101\r"))
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
