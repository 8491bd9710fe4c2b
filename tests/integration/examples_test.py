#!/usr/bin/python3
"""The worked examples for other tools: what can run here is run, the rest is checked against the devices.

Usage: examples_test.py PROGRAM SOURCE_TREE [unittest arguments]

python_can and the pytest fixture for faults run with a whole emulator in real time. bus.yml is checked against exported data
sheets and the device table, since ROS 2 is not in Debian; python_canopen is only compiled, for the same reason.
"""
import configparser
import copy
import os
import py_compile
import re
import signal
import subprocess
import sys
import tempfile
import unittest

import yaml

PROGRAM = TREE = None
DRIVERS = {"ros2_canopen::Cia402Driver": "canopen_402_driver", "ros2_canopen::ProxyDriver": "canopen_proxy_driver"}
NODE_KEYS = {"node_id", "dcf", "driver", "package", "period", "enable_lazy_load", "heartbeat_producer", "sdo", "tpdo", "rpdo",
             "scale_pos_to_dev", "scale_pos_from_dev", "scale_vel_to_dev", "scale_vel_from_dev"}


def data_sheet(path):
    reader = configparser.RawConfigParser(strict=True)
    reader.optionxform = str
    reader.read(path)
    return reader


def entry(sheet, index, sub):
    for name in ("%04Xsub%X" % (index, sub), "%04X" % index if sub == 0 else ""):
        if name in sheet and sheet[name].get("DataType"):
            return sheet[name]
    return None


BITS = {0x0002: 8, 0x0003: 16, 0x0004: 32, 0x0005: 8, 0x0006: 16, 0x0007: 32, 0x0008: 32}


def findings(bus, table, sheets):
    """Returns the errors in a bus configuration: `table` node-ID -> (name, kind), `sheets` EDS name -> data sheet."""
    found = []
    if bus.get("options", {}).get("dcf_path") != "@BUS_CONFIG_PATH@":
        found.append("options.dcf_path is not what the build of a ROS package replaces")
    master = bus["master"]
    if master["node_id"] in table:
        found.append("the master's node-ID is a device's")
    nodes = {name: node for name, node in bus.items() if name not in ("options", "master")}
    if {node["node_id"]: name for name, node in nodes.items()} != {i: name for i, (name, _) in table.items()}:
        found.append("nodes are not those of the device table")
    for name, node in nodes.items():
        unknown = set(node) - NODE_KEYS
        if unknown:
            found.append("%s: unknown %s" % (name, ", ".join(sorted(unknown))))
        if DRIVERS.get(node["driver"]) != node["package"]:
            found.append("%s: driver %s is not in package %s" % (name, node["driver"], node["package"]))
        kind = table.get(node["node_id"], ("", ""))[1]
        sheet = sheets.get(node["dcf"])
        if sheet is None or node["dcf"] != kind + ".eds":
            found.append("%s: %s is not the data sheet of a %s" % (name, node["dcf"], kind))
            continue
        written = {}
        for item in node.get("sdo", []):
            target = entry(sheet, item["index"], item["sub_index"])
            if target is None or target["AccessType"] not in ("rw", "wo"):
                found.append("%s: %04Xh:%d cannot be written" % (name, item["index"], item["sub_index"]))
            written[item["index"], item["sub_index"]] = item["value"]
        if kind.endswith("_drive"):
            period = written.get((0x60C2, 1), 0) * 10.0 ** written.get((0x60C2, 2), 0)
            if abs(period * 1e6 - master["sync_period"]) > 1e-6 or node.get("period") != period * 1e3:
                found.append("%s: 60C2h, period and the master's sync_period differ" % name)
            if written.get((0x1016, 1)) != master["node_id"] << 16 | 250:
                found.append("%s: the master's heartbeat is not watched" % name)
        for way, access in (("tpdo", ("ro", "rw")), ("rpdo", ("rw", "wo"))):
            for number, record in node.get(way, {}).items():
                bits = 0
                for item in record["mapping"]:
                    target = entry(sheet, item["index"], item["sub_index"])
                    if target is None or target["PDOMapping"] != "1" or target["AccessType"] not in access:
                        found.append("%s: %s %d cannot map %04Xh:%d" % (name, way, number, item["index"], item["sub_index"]))
                        continue
                    bits += BITS[int(target["DataType"], 0)]
                if bits > 64:
                    found.append("%s: %s %d has %d bits" % (name, way, number, bits))
                if "%04X" % ((0x1800 if way == "tpdo" else 0x1400) + number - 1) not in sheet:
                    found.append("%s: no %s %d" % (name, way, number))
    return found


class Ros2(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        subprocess.run([PROGRAM, "export", "eds", "--out", cls.folder.name], check=True, stdout=subprocess.DEVNULL)
        cls.sheets = {name: data_sheet(os.path.join(cls.folder.name, name)) for name in os.listdir(cls.folder.name)}
        with open(os.path.join(TREE, "examples/ros2_canopen/bus.yml"), encoding="utf-8") as file:
            cls.bus = yaml.safe_load(file)
        with open(os.path.join(TREE, "urdf/walkman.devices.yaml"), encoding="utf-8") as file:
            devices = next(bus["devices"] for bus in yaml.safe_load(file)["buses"] if bus["name"] == "rarm")
        cls.table = {}
        for device in devices:
            key, kind = next((key, kind) for key, kind in (("joint", "joint_drive"), ("hand", "hand_drive"),
                                                           ("force_torque", "force_torque")) if key in device)
            cls.table[device["node"]] = (device[key], kind)

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def test_bus_fits_the_devices(self):
        self.assertEqual(findings(self.bus, self.table, self.sheets), [])
        self.assertEqual(len(self.table), 9)

    def test_the_check_can_fail(self):
        changes = {
            "not those of the device table": lambda b: b["RElbj"].update(node_id=15),
            "is a device's": lambda b: b["master"].update(node_id=11),
            "is not the data sheet": lambda b: b["r_arm_ft"].update(dcf="joint_drive.eds"),
            "is not in package": lambda b: b["RElbj"].update(package="canopen_core"),
            "sync_period differ": lambda b: b["master"].update(sync_period=10000),
            "60C2h, period": lambda b: b["RElbj"]["sdo"][1].update(value=10),
            "heartbeat is not watched": lambda b: b["RElbj"]["sdo"][0].update(value=0),
            "cannot be written": lambda b: b["RElbj"]["sdo"].append({"index": 0x6041, "sub_index": 0, "value": 0}),
            "cannot map 6041h": lambda b: b["RElbj"]["rpdo"][2]["mapping"].append({"index": 0x6041, "sub_index": 0}),
            "cannot map 6098h": lambda b: b["RElbj"]["rpdo"][2]["mapping"].append({"index": 0x6098, "sub_index": 0}),
            "has 80 bits": lambda b: b["RElbj"]["tpdo"][2]["mapping"].append({"index": 0x6041, "sub_index": 0}),
            "unknown perid": lambda b: b["RElbj"].update(perid=5),
        }
        for expected, change in changes.items():
            bus = copy.deepcopy(self.bus)
            change(bus)
            self.assertIn(expected, "\n".join(findings(bus, self.table, self.sheets)))


class PythonCan(unittest.TestCase):
    def test_a_joint_moves(self):
        with tempfile.TemporaryDirectory() as folder:
            # The pelvis is held: the physics is then fast enough on any machine.
            with open(os.path.join(TREE, "urdf/scenes/robot_at_table.yaml"), encoding="utf-8") as file:
                scene = file.read().replace("kind: floating", "kind: fixed")
            path = os.path.join(folder, "scene.yaml")
            with open(path, "w", encoding="utf-8") as file:
                file.write(re.sub(r": ([\w./]+\.(?:urdf|srdf|yaml))", ": " + TREE + "/urdf/scenes/\\1", scene))
            emulator = subprocess.Popen(
                [PROGRAM, "emulate", "--realtime", "--socketcand", "0", "--scene", path, "--camera",
                 "127.9.9.5"],
                stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
            try:
                port = None
                for line in emulator.stdout:
                    if match := re.search(r"127\.0\.0\.1:(\d+)|socketcand.*?(\d{4,5})", line):
                        port = match.group(1) or match.group(2)
                        break
                self.assertIsNotNone(port, "no port is printed")
                example = os.path.join(TREE, "examples/python_can/move_joint.py")
                done = subprocess.run([sys.executable, example, "--port", port], stdout=subprocess.PIPE,
                                      stderr=subprocess.STDOUT, text=True, timeout=240)
                self.assertEqual(done.returncode, 0, done.stdout)
                stands, there, back = [float(x) for x in re.findall(r"at (-?[\d.]+) rad", done.stdout)]
                self.assertAlmostEqual(there - stands, 0.1, delta=0.003)
                self.assertAlmostEqual(back, stands, delta=0.003)
                self.assertNotAlmostEqual(stands, 0.0, delta=0.05)
                # And it reports a drive that is not there.
                refused = subprocess.run([sys.executable, example, "--port", port, "--node", "30"], stdout=subprocess.PIPE,
                                         stderr=subprocess.STDOUT, text=True, timeout=240)
                self.assertEqual(refused.returncode, 1)
                self.assertIn("node 30 does not boot", refused.stdout)
            finally:
                emulator.send_signal(signal.SIGINT)
                emulator.communicate(timeout=60)


class Faults(unittest.TestCase):
    def test_the_fixture_starts_breaks_and_ends_an_emulator(self):
        done = subprocess.run(
            [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", os.path.join(TREE, "examples/faults")],
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=240,
            env={**os.environ, "WALKMAN_HIL": PROGRAM, "PYTHONDONTWRITEBYTECODE": "1"})
        self.assertEqual(done.returncode, 0, done.stdout)
        self.assertIn("4 passed", done.stdout)


class PythonCanopen(unittest.TestCase):
    def test_it_compiles_and_tells_its_options(self):
        example = os.path.join(TREE, "examples/python_canopen/move_joint.py")
        with tempfile.TemporaryDirectory() as folder:
            py_compile.compile(example, cfile=os.path.join(folder, "example.pyc"), doraise=True)
        self.assertIn("--eds", subprocess.run([sys.executable, example, "--help"], stdout=subprocess.PIPE, text=True).stdout)


if __name__ == "__main__":
    PROGRAM, TREE = sys.argv[1:3]
    unittest.main(argv=sys.argv[:1] + sys.argv[3:], verbosity=2)
