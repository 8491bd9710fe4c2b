#!/usr/bin/env python3
"""Tests `walkman-hil emulate --free-run` from outside: the robot stands, two runs are equal, contradictory options are refused.

Usage: free_run_test.py WALKMAN_HIL SOURCE_TREE [unittest arguments]
"""

import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest

PROGRAM = TREE = None


def emulate(*options):
    return subprocess.run([PROGRAM, "emulate", *options], capture_output=True, text=True, timeout=300, check=False)


def whole_scene(folder):
    """Returns the first experiment's scene merged with the scene that it extends."""
    with open(os.path.join(folder, "robot_at_table.yaml"), encoding="utf-8") as stream:
        base = stream.read()
    with open(os.path.join(folder, "experiment_1.yaml"), encoding="utf-8") as stream:
        own = stream.read()
    return base.replace("objects: []\n", own[own.index("objects:"):])


class FreeRunTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name

    def path(self, name):
        return os.path.join(self.folder, name)

    def run_free(self, *options, code=0):
        """Returns the text on stdout, and the JSON in it."""
        done = emulate("--free-run", "--json", *options)
        self.assertEqual(done.returncode, code, done.stderr)
        return done.stdout, json.loads(done.stdout)

    def scene(self, change):
        """Writes the first experiment's scene as one file with its text changed, together with everything that it refers to."""
        shutil.copytree(os.path.join(TREE, "urdf"), self.path("urdf"))
        os.mkdir(self.path("adaptation"))
        shutil.copy(os.path.join(TREE, "adaptation/head_at_home.yaml"), self.path("adaptation"))
        text = whole_scene(self.path("urdf/scenes"))
        changed = self.path("urdf/scenes/changed.yaml")
        with open(changed, "w", encoding="utf-8") as stream:
            stream.write(change(text))
        self.assertNotEqual(change(text), text)
        return changed

    def test_the_robot_stands_and_two_runs_are_the_same(self):
        text, result = self.run_free("--duration", "61")
        self.assertEqual((result["ending"], result["stands"]), ("duration", True))
        self.assertEqual(result["emulated_seconds"], 61)
        self.assertGreater(result["drift"]["seconds"], 45)
        for drift in (result["drift"]["most"], result["drift"]["last_second"]):
            self.assertLess(drift["feet_m"], 1e-4)
            self.assertLess(drift["centre_of_mass_m"], 5e-4)
            self.assertLess(drift["base_m"], 5e-4)
            self.assertLess(drift["base_rad"], 1e-3)
        # The drift is really measured: sensors are noisy, so a robot that balances by them moves.
        self.assertGreater(result["drift"]["most"]["centre_of_mass_m"], 0)
        self.assertEqual([row["seconds"] for row in result["hashes"]], [60, 61])
        self.assertEqual(len({row["state"] for row in result["hashes"]}), 2)
        self.assertEqual(result["hashes"][-1]["frame_count"], sum(bus["frames"] for bus in result["buses"]))
        self.assertEqual(self.run_free("--duration", "61")[0], text)

    def test_other_noise_is_another_run(self):
        one = self.run_free("--duration", "6")[1]
        other = self.run_free("--duration", "6", "--seed", "2")[1]
        for what in ("state", "frames"):
            self.assertNotEqual(one["hashes"][0][what], other["hashes"][0][what])

    def test_the_log_holds_what_was_hashed_and_changes_nothing(self):
        log = self.path("can.log")
        text, result = self.run_free("--duration", "2", "--log", log)
        with open(log, encoding="ascii") as stream:
            self.assertEqual(sum(1 for _ in stream), result["hashes"][-1]["frame_count"])
        self.assertEqual(self.run_free("--duration", "2")[0], text)

    def test_a_held_base_has_no_feet_to_stand_on(self):
        scene = self.scene(lambda text: text.replace("kind: floating", "kind: fixed").replace("1.0478]", "1.1]"))
        result = self.run_free("--duration", "15", "--scene", scene)[1]
        self.assertEqual((result["ending"], result["stands"]), ("duration", False))
        self.assertEqual(result["drift"]["most"]["base_m"], 0)

    def test_a_robot_that_is_pushed_over_ends_the_run(self):
        push = "events:\n  - at_s: 7\n    push: {link: DWYTorso, force_N: [3000, 0, 0], duration_s: 0.1}\n"
        result = self.run_free("--duration", "20", "--scene", self.scene(lambda text: text + push), code=1)[1]
        self.assertEqual(result["ending"], "stopped")
        self.assertTrue(result["reason"])
        self.assertTrue(7 < result["emulated_seconds"] < 12, result)

    def test_a_signal_ends_it_with_what_there_is(self):
        process = subprocess.Popen([PROGRAM, "emulate", "--free-run", "--json"], stdout=subprocess.PIPE,
                                   stderr=subprocess.PIPE, text=True)
        time.sleep(3)
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=60)
        self.assertEqual(process.returncode, 0, err)
        result = json.loads(out)
        self.assertEqual(result["ending"], "signal")
        self.assertEqual(result["hashes"][-1]["seconds"], result["emulated_seconds"])
        self.assertRegex(err, r"^walkman-hil: [0-9.]+ s emulated in [0-9.]+ s, .* resident memory .*\n$")

    def test_what_contradicts_is_refused_in_a_sentence(self):
        against = {"--can": "rarm=vcan0", "--socketcand": "0", "--socketcand-beacon": None, "--slcan": "rarm",
                   "--camera": "127.0.0.1", "--ready-fd": "1", "--lockstep": None,
                   "--realtime": None, "--stalls": "drop", "--period": "5"}
        for option, value in against.items():
            self.refused(option, ["--free-run", option, *([] if value is None else [value])])
        for option, value in {"--rate": "200", "--layout": "a"}.items():
            self.refused(option, [option, value, "--duration", "0.01"])
        self.refused("--rate", ["--free-run", "--rate", "300"])
        self.refused("--layout", ["--free-run", "--layout", "nosuch"])
        self.refused("CAN FD", ["--free-run", "--layout", "d"])

    def refused(self, named, options):
        done = emulate(*options)
        self.assertEqual(done.returncode, 2, done.stderr)
        self.assertEqual(done.stdout, "")
        self.assertEqual(done.stderr.count("\n"), 1, done.stderr)
        self.assertIn(named, done.stderr)
        self.assertIn("expected", done.stderr)


if __name__ == "__main__":
    PROGRAM = os.path.abspath(sys.argv.pop(1))
    TREE = sys.argv.pop(1)
    unittest.main(verbosity=2)
