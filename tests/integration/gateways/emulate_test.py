"""Tests `walkman-hil emulate` from outside, without CAN in the kernel: its sockets and links, its output, its pace.

Usage: emulate_test.py WALKMAN_HIL [unittest arguments]
"""

import json
import os
import signal
import socket
import stat
import struct
import subprocess
import sys
import tempfile
import time
import unittest

import multisense

PROGRAM = None


class Emulator:
    """One `emulate` process with the given options; its stderr is kept."""

    def __init__(self, *options, **arguments):
        self.process = subprocess.Popen(
            [PROGRAM, "emulate", *options], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **arguments
        )

    def wait_for(self, path, seconds=20.0):
        end = time.monotonic() + seconds
        while not os.path.lexists(path):
            if self.process.poll() is not None or time.monotonic() > end:
                raise AssertionError(f"no {path}: {self.finish(0)}")
            time.sleep(0.01)

    def finish(self, seconds=20.0, signal_number=signal.SIGTERM):
        """Returns exit status, stdout and stderr; ends the process by a signal if necessary."""
        if self.process.poll() is None and signal_number:
            self.process.send_signal(signal_number)
        try:
            out, err = self.process.communicate(timeout=seconds + 20.0)
        except subprocess.TimeoutExpired:
            self.process.kill()
            out, err = self.process.communicate()
            return "hung", out, err
        return self.process.returncode, out, err


class EmulateTest(unittest.TestCase):
    count = 0

    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        EmulateTest.count += 1
        self.camera = multisense.loopback(os.getpid() * 64 + EmulateTest.count)
        self.running = []

    def tearDown(self):
        for emulator in self.running:
            if emulator.process.poll() is None:
                emulator.process.kill()
            emulator.process.communicate()

    def path(self, name):
        return os.path.join(self.folder.name, name)

    def client(self, address=None):
        client = multisense.Client(address or self.camera)
        self.addCleanup(client.close)
        return client

    def wait_for_camera(self, address=None, seconds=20.0):
        end = time.monotonic() + seconds
        client = self.client(address)
        while time.monotonic() < end:
            client.send(multisense.GET_VERSION)
            if client.message(0.2):
                return
        raise AssertionError(f"no camera at {address or self.camera}")

    def start(self, *options, **arguments):
        emulator = Emulator(*options, **arguments)
        self.running.append(emulator)
        return emulator

    def refused(self, *options):
        """Checks that there is a single sentence, and that it took no time."""
        began = time.monotonic()
        status, _, err = self.start(*options, "--duration", "0.01").finish(10.0, None)
        self.assertEqual(status, 3, err)
        self.assertEqual(err.count("\n"), 1, err)
        self.assertLess(time.monotonic() - began, 10.0)
        return err


class Files(EmulateTest):
    def test_an_address_is_not_taken_over(self):
        first = self.start("--camera", self.camera)
        self.wait_for_camera()
        self.assertIn(f"{self.camera}:9001: Address already in use", self.refused("--camera", self.camera))
        self.assertEqual(first.finish()[0], 0)

    def test_without_the_default_address_it_goes_on(self):
        holder = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.addCleanup(holder.close)
        try:
            holder.bind(("127.0.0.1", multisense.PORT))
        except OSError:
            pass  # another test's emulator uses it
        status, _, err = self.start("--duration", "0.01").finish(20.0, None)
        self.assertEqual(status, 0, err)
        self.assertIn("Address already in use; going on without the camera", err)

    def test_what_is_no_address_is_refused(self):
        for address in ("camera.sock", "127.0.0", "127.0.0.1:0", "localhost"):
            status, _, err = self.start("--camera", address, "--duration", "0.01").finish(10.0, None)
            self.assertEqual(status, 2, err)
            self.assertIn("expected an IPv4 address", err)

    def test_what_a_killed_emulator_left_is_replaced(self):
        link = self.path("tty")
        options = ("--camera", self.camera, "--slcan", f"rarm={link}")
        first = self.start(*options)
        first.wait_for(link)
        first.finish(signal_number=signal.SIGKILL)
        self.assertTrue(os.path.lexists(link))
        second = self.start(*options, "--duration", "0.1")
        status, _, err = second.finish(20.0, None)
        self.assertEqual(status, 0, err)
        self.assertFalse(os.path.lexists(link))

    def test_a_live_emulator_s_link_is_not_stolen(self):
        link = self.path("tty")
        first = self.start("--camera", self.camera, "--slcan", f"rarm={link}")
        first.wait_for(link)
        terminal = os.readlink(link)
        other = ("--camera", multisense.loopback(os.getpid() * 64 + 63), "--slcan", f"rarm={link}")
        self.assertIn("in use", self.refused(*other))
        self.assertEqual(os.readlink(link), terminal)
        self.assertEqual(first.finish()[0], 0)

    def test_what_took_the_place_of_its_own_stays_at_the_end(self):
        link = self.path("tty")
        emulator = self.start("--camera", self.camera, "--slcan", f"rarm={link}")
        emulator.wait_for(link)
        os.unlink(link)
        with open(link, "w", encoding="ascii") as file:
            file.write("precious")
        self.assertEqual(emulator.finish()[0], 0)
        self.assertTrue(os.path.isfile(link), link)


class Camera(EmulateTest):
    def test_it_speaks_the_vendor_s_protocol(self):
        emulator = self.start("--camera", self.camera)
        self.wait_for_camera()
        client = self.client()
        client.stream(0xFF7FFFFF, 0)
        self.assertEqual(client.message(), (multisense.ACK, struct.pack("<Hi", multisense.STREAM, 0)))
        client.send(multisense.GET_VERSION)
        self.assertEqual(client.message()[1], struct.pack("<Hi", multisense.GET_VERSION, 0))
        version = client.wait_for(multisense.VERSION)
        length, = struct.unpack_from("<H", version)
        self.assertEqual(struct.unpack_from("<H", version, 2 + length), (0x0303,))
        client.send(0x0033)
        self.assertEqual(client.message()[1], struct.pack("<Hi", 0x0033, -5))
        client.stream(multisense.DISPARITY_LEFT, multisense.DISPARITY_LEFT)
        told = set()
        while True:  # metadata come before their image; this client is slow, and the kernel's buffer for it small
            kind, body = client.message()
            if kind == multisense.METADATA:
                told.add(struct.unpack_from("<q", body)[0])
            if kind == multisense.DISPARITY:
                break
        client.stream(multisense.DISPARITY_LEFT, 0)
        frame, width, height, image = multisense.disparities(body)
        self.assertIn(frame, told)
        self.assertEqual((width, height), (1024, 1024))
        self.assertEqual(client.first_part[multisense.DISPARITY], 16)
        seen = [d / 16 for d in image if d]
        self.assertGreater(len(seen), 0.5 * len(image))
        # At 588.8 px and 70 mm, 4.1 px are 10 m: the room is smaller. 59 px are 0.7 m, the table's near edge.
        self.assertTrue(4 < sorted(seen)[len(seen) // 2] < 59)
        self.assertEqual(emulator.finish()[0], 0)

    def test_its_images_go_with_their_metadata(self):
        emulator = self.start("--camera", self.camera)
        self.wait_for_camera()
        client = self.client()
        both = multisense.LUMA_LEFT | multisense.LUMA_RIGHT
        client.stream(both, both)
        metadata, images = {}, {}
        while len(images) < 2:
            kind, body = client.message()
            if kind == multisense.METADATA:
                metadata[struct.unpack_from("<q", body)[0]] = body
            if kind == multisense.IMAGE:
                source, bits, frame, width, height, pixels = multisense.image(body)
                self.assertEqual((bits, width, height), (8, 1024, 1024))
                images[source] = (frame, pixels)
        client.stream(both, 0)
        self.assertEqual(set(images), {multisense.LUMA_LEFT, multisense.LUMA_RIGHT})
        frame, left = images[multisense.LUMA_LEFT]
        counts = multisense.histogram(metadata[frame])
        for value in (0, 50, 100, 150):
            self.assertEqual(sum(counts[value::256]), left.count(value))
        self.assertGreater(len(set(left)), 100)
        self.assertEqual(emulator.finish()[0], 0)

    def test_its_inertial_unit_feels_gravity(self):
        emulator = self.start("--camera", self.camera)
        self.wait_for_camera()
        client = self.client()
        client.stream(multisense.IMU, multisense.IMU)
        numbers, seen = [], {1: [], 2: [], 3: []}
        while len(numbers) < 10:
            number, samples = multisense.imu_samples(client.wait_for(multisense.IMU_DATA))
            numbers.append(number)
            for kind, _, *value in samples:
                seen[kind].append(value)
        self.assertEqual(numbers, list(range(numbers[0], numbers[0] + 10)))
        mean = [sum(v[axis] for v in seen[1]) / len(seen[1]) for axis in range(3)]
        self.assertAlmostEqual(sum(m * m for m in mean) ** 0.5, 1, delta=0.05)
        # With its brakes closed and without balance control the robot sways, by some degrees per second and about zero.
        for axis in range(3):
            self.assertLess(abs(sum(v[axis] for v in seen[2]) / len(seen[2])), 10)
        self.assertGreater(len(seen[3]), 20)
        self.assertEqual(emulator.finish()[0], 0)

    def test_six_clients_that_never_read_delay_nobody(self):
        self.start("--camera", self.camera)
        self.wait_for_camera()
        for _ in range(6):
            self.client().stream(multisense.DISPARITY_LEFT, multisense.DISPARITY_LEFT)
        time.sleep(0.5)
        began = time.monotonic()
        newcomer = self.client()
        newcomer.send(multisense.GET_STATUS)
        newcomer.wait_for(multisense.STATUS)
        newcomer.stream(multisense.DISPARITY_LEFT, multisense.DISPARITY_LEFT)
        newcomer.wait_for(multisense.METADATA)
        self.assertLess(time.monotonic() - began, 8.0)


class Pace(EmulateTest):
    def test_ready_is_told_in_one_line_and_to_a_script(self):
        reader, writer = os.pipe()
        emulator = self.start("--camera", self.camera, "--ready-fd", str(writer), pass_fds=(writer,))
        os.close(writer)
        with os.fdopen(reader) as pipe:
            self.assertEqual(pipe.read(), "ready\n")  # it ends: the descriptor was closed
        status, _, err = emulator.finish()
        self.assertEqual(status, 0)
        self.assertRegex(err, r"(?m)^walkman-hil: ready, [0-9]+ nodes have booted$")

    def test_a_descriptor_that_is_none_is_refused(self):
        for number in ("2", "77", "-1", "x"):
            status, _, err = self.start("--ready-fd", number).finish(10.0, None)
            self.assertEqual(status, 2, err)
            self.assertIn("--ready-fd", err)

    def test_a_duration_that_is_none_is_refused(self):
        for duration in ("nan", "inf", "-1", "0", "1e10", "x"):
            status, _, err = self.start("--camera", self.camera, f"--duration={duration}").finish(10.0, None)
            self.assertEqual(status, 2, err)
            self.assertIn(f"duration of {duration} s", err)

    def stopped_for_two_seconds(self, *options):
        reader, writer = os.pipe()
        emulator = self.start("--camera", self.camera, "--json", "--ready-fd", str(writer), *options, pass_fds=(writer,))
        os.close(writer)
        with os.fdopen(reader) as pipe:
            pipe.read()
        time.sleep(0.5)
        emulator.process.send_signal(signal.SIGSTOP)
        time.sleep(2.0)
        emulator.process.send_signal(signal.SIGCONT)
        time.sleep(1.0)
        status, out, err = emulator.finish()
        self.assertEqual(status, 0, err)
        return json.loads(out)

    def test_a_stall_is_left_out_and_counted(self):
        told = self.stopped_for_two_seconds()
        self.assertGreaterEqual(told["stalls"], 1)
        self.assertGreater(told["dropped_seconds"], 1.9)
        self.assertLess(told["emulated_seconds"], told["wall_seconds"] - 1.9)
        self.assertGreater(told["worst_lateness_seconds"], 1.9)
        self.assertAlmostEqual(
            told["emulated_seconds"] + told["dropped_seconds"], told["wall_seconds"], delta=0.1)

    def test_or_replayed_if_asked(self):
        told = self.stopped_for_two_seconds("--stalls", "replay")
        self.assertEqual((told["stalls"], told["dropped_seconds"]), (0, 0))
        self.assertGreater(told["late_steps"], 100)

    def test_socket_servers_without_clients_call_the_system_no_more_often(self):
        """Counts calls per millisecond of emulated time, with every server and with none."""
        calls = []
        for options in ((), ("--socketcand", "0", "--slcan", "rarm", "--slcan", "larm")):
            trace = self.path(f"trace{len(calls)}")
            command = ["strace", "-c", "-U", "calls,name", "-o", trace, PROGRAM, "emulate", "--camera", self.camera,
                       "--duration", "3", *options]
            subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, timeout=120)
            with open(trace, encoding="ascii") as file:
                total = [line.split() for line in file if line.split()[-1:] == ["total"]]
            calls.append(int(total[0][0]) / 3000)
        print(f"{calls[0]:.2f} and {calls[1]:.2f} calls a millisecond", file=sys.stderr)
        self.assertLess(calls[1], calls[0] + 0.3)


class Socketcand(EmulateTest):
    def serve(self, *options):
        """Starts an emulator with a socketcand server on a free port; returns the port when it is ready."""
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            port = free.getsockname()[1]
        reader, writer = os.pipe()
        self.start("--camera", self.camera, "--socketcand", str(port), "--ready-fd", str(writer), *options,
                   pass_fds=(writer,))
        os.close(writer)
        with os.fdopen(reader) as pipe:
            self.assertEqual(pipe.read(), "ready\n")
        return port

    def test_who_opens_no_bus_is_hung_up_on_after_30_s(self):
        port = self.serve()
        with socket.create_connection(("127.0.0.1", port), 60.0) as silent, \
                socket.create_connection(("127.0.0.1", port), 60.0) as opened:
            began = time.monotonic()
            self.assertEqual(opened.recv(100), b"< hi >")
            opened.sendall(b"< open can_rarm >")
            self.assertEqual(opened.recv(100), b"< ok >")
            self.assertEqual(silent.recv(100), b"< hi >")
            while silent.recv(100):
                pass
            self.assertGreater(time.monotonic() - began, 29.0)
            self.assertLess(time.monotonic() - began, 45.0)
            opened.sendall(b"< rawmode >")
            self.assertEqual(opened.recv(100), b"< ok >")

    def beacons(self, listener, seconds):
        """Returns the beacons of this test's emulator, with their arrival times."""
        ends = time.monotonic() + seconds
        found = []
        while (left := ends - time.monotonic()) > 0:
            listener.settimeout(left)
            try:
                text = listener.recv(2048).decode()
            except socket.timeout:
                break
            if f"<URL>can://127.0.0.1:{self.port}</URL>" in text:
                found.append((time.monotonic(), text))
        return found

    def test_the_beacon_comes_every_3_s_if_asked(self):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as listener:
            # Every listener with this option receives a broadcast: the test does not need the port for itself.
            listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            listener.bind(("", 42000))
            self.port = self.serve()
            self.assertEqual(self.beacons(listener, 4.0), [])
            self.running[-1].finish()
            self.port = self.serve("--socketcand-beacon")
            found = self.beacons(listener, 10.0)
        self.assertGreaterEqual(len(found), 3)
        for bus in ("torso", "rarm", "larm", "rleg", "lleg"):
            self.assertIn(f'<Bus name="can_{bus}"/>', found[0][1])
        for (one, _), (next_one, _) in zip(found[1:], found[2:]):  # the first may have waited in the socket
            self.assertAlmostEqual(next_one - one, 3.0, delta=0.5)


if __name__ == "__main__":
    PROGRAM = sys.argv.pop(1)
    unittest.main(verbosity=2)
