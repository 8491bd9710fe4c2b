"""The emulated robot as a pytest fixture: started for each test, broken on purpose, and stopped at its end.

WALKMAN_HIL gives the program if `walkman-hil` is not in the PATH.
"""
import json
import os
import re
import subprocess
import tempfile
import threading

import can
import pytest

READY = 60  # s


class EmulatedRobot:
    """An emulator in real time, its buses through socketcand, its faults through its own socket."""

    def __init__(self, folder):
        self.program = os.environ.get("WALKMAN_HIL", "walkman-hil")
        self.socket = os.path.join(folder, "faults")
        reader, writer = os.pipe()
        self.process = subprocess.Popen(
            [self.program, "emulate", "--socketcand", "0", "--camera", "127.77.4.1", "--fault-socket", self.socket,
             "--ready-fd", str(writer)],
            pass_fds=[writer], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        os.close(writer)
        self.port, self.told, told = None, [], threading.Event()
        self.follower = threading.Thread(target=self._follow, args=[told], daemon=True)
        self.follower.start()
        watchdog = threading.Timer(READY, self.process.kill)
        watchdog.start()
        with open(reader, encoding="utf-8") as ready:
            line = ready.readline()
        watchdog.cancel()
        if line != "ready\n" or not told.wait(5):
            self.process.kill()
            self.follower.join()
            raise RuntimeError("the emulator did not come up: " + " ".join(self.told))

    def _follow(self, told):
        for line in self.process.stderr:
            self.told.append(line.strip())
            if match := re.match(r"socketcand: .*:(\d+)", line):
                self.port = int(match.group(1))
                told.set()

    def bus(self, name):
        """Returns a python-can bus for one of torso, rarm, larm, rleg and lleg."""
        return can.Bus(interface="socketcand", host="127.0.0.1", port=self.port, channel=name)

    def _ask(self, verb, *words):
        done = subprocess.run([self.program, "fault", verb, *words, "--socket", self.socket], capture_output=True,
                              text=True, check=False)
        if done.returncode != 0:
            raise ValueError(done.stderr.strip())
        return done.stdout.strip()

    def inject(self, *words, lasts=None):
        """Injects a fault: inject("RElbj", "encoder-stuck", "side=0", lasts="2s"). Returns the fault's name."""
        return self._ask("inject", *words, *(["--for", lasts] if lasts else []))

    def clear(self, name="all"):
        self._ask("clear", name)

    def active(self):
        return json.loads(self._ask("active"))["active"]

    def stop(self):
        self.process.terminate()
        self.process.wait(timeout=30)
        self.follower.join()


@pytest.fixture
def robot():
    with tempfile.TemporaryDirectory() as folder:
        emulated = EmulatedRobot(folder)
        try:
            yield emulated
        finally:
            emulated.stop()
