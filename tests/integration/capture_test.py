#!/usr/bin/env python3
"""Tests walkman-hil capture: its files are read by readers written here and compared with each other.
Usage: capture_test.py PROGRAM"""

import struct
import tempfile
import zlib
from pathlib import Path

from checks import check, end, run

URDF = Path(__file__).resolve().parents[2] / "urdf"


def paeth(a, b, c):
    p = a + b - c
    return min((abs(p - a), 0, a), (abs(p - b), 1, b), (abs(p - c), 2, c))[2]


def png(path):
    """Returns width, height, bits per channel, colour type and rows of bytes (PNG, sections 5 and 9)."""
    data = path.read_bytes()
    check(data[:8] == b"\x89PNG\r\n\x1a\n", f"{path.name} begins as a PNG does")
    at, packed = 8, b""
    while at < len(data):
        length, kind = struct.unpack_from(">I4s", data, at)
        body = data[at + 8:at + 8 + length]
        if kind == b"IHDR":
            width, height, bits, colour = struct.unpack_from(">IIBB", body)
        if kind == b"IDAT":
            packed += body
        at += 12 + length
    pixel = {0: 1, 2: 3}[colour] * bits // 8
    raw, rows, before = zlib.decompress(packed), [], bytes(width * pixel)
    for v in range(height):
        start = v * (1 + width * pixel)
        kind, row = raw[start], bytearray(raw[start + 1:start + 1 + width * pixel])
        for i, value in enumerate(row):
            left = row[i - pixel] if i >= pixel else 0
            corner = before[i - pixel] if i >= pixel else 0
            row[i] = (value + (0, left, before[i], (left + before[i]) // 2,
                               paeth(left, before[i], corner))[kind]) & 255
        rows.append(bytes(row))
        before = row
    return width, height, bits, colour, rows


def pcd_points(path):
    data = path.read_bytes()
    head, body = data.split(b"DATA binary\n", 1)
    fields = dict(line.split(" ", 1) for line in head.decode().splitlines() if not line.startswith("#"))
    check(fields["FIELDS"] == "x y z", "cloud.pcd has x, y and z")
    step = sum(int(s) * int(c) for s, c in zip(fields["SIZE"].split(), fields["COUNT"].split()))
    return int(fields["WIDTH"]), [struct.unpack_from("<fff", body, i * step)
                                  for i in range(int(fields["POINTS"]))]


FOCAL, CENTRE, WIDTH = 588.8, 511.5, 1024  # px, of the device's rectified calibration


def depths_apart(swept, cloud):
    """For the laser points that the camera also sees: difference (m) between their depth and the camera's depth at that
    pixel."""
    out = []
    for x, y, z in (point[:3] for point in swept):
        if not z > 0.3:
            continue
        u, v = round(CENTRE + FOCAL * x / z), round(CENTRE + FOCAL * y / z)
        if 128 <= u < WIDTH and 0 <= v < WIDTH:
            depth = cloud[v * WIDTH + u][2]
            if depth == depth and abs(depth - z) < 0.05:  # otherwise one of them is hidden from the other
                out.append(abs(depth - z))
    return out


def without_laser(folder):
    """Writes scene experiment_6 with a robot whose camera has no laser."""
    robot = (URDF / "walkman.robot.yaml").read_text()
    head, _, laser = robot.partition("  laser:")
    (folder / "bare.robot.yaml").write_text(head + laser.partition("hokuyo_joint\n")[2])
    for entry in URDF.iterdir():
        (folder / entry.name).symlink_to(entry)
    scene = folder / "bare.yaml"
    scene.write_text(f"extends: {URDF}/scenes/experiment_6.yaml\nrobot:\n  file: {folder}/bare.robot.yaml\n")
    return scene


def main():
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "a"
        done = run("capture", "--scene", "experiment_6", "--out", str(out), "--locate")
        check(done.returncode == 0, f"capture exits with 0, not {done.returncode}: {done.stderr}")
        for name in ("left.png", "right.png"):
            width, height, bits, colour, rows = png(out / name)
            check((width, height, bits, colour) == (1024, 1024, 8, 0), f"{name} is 1024x1024 px, 8 bits, grey")
            middle = sorted(b"".join(rows[::16]))[len(rows) * 32]
            check(20 < middle < 200, f"{name} is neither dark nor white: {middle}")
        check(png(out / "left.png")[4] != png(out / "right.png")[4], "the two images differ")
        width, _, bits, colour, depth = png(out / "depth.png")
        check((bits, colour) == (16, 0), "depth.png has 16 bits of grey")
        across, points = pcd_points(out / "cloud.pcd")
        check(across == width == 1024, "cloud and images are as wide")
        wrong = seen = 0
        for i in range(0, len(points), 7):
            mm, = struct.unpack_from(">H", depth[i // width], 2 * (i % width))
            z = points[i][2]
            seen += mm > 0
            wrong += mm != 0 if z != z else abs(mm - 1000 * z) > 0.51
        check(seen > 100000 and wrong == 0, f"depth.png has the cloud's z in mm: {wrong} of {seen} not")
        check(png(out / "disparity.png")[2:4] == (8, 2), "disparity.png is in colour")
        check((out / "seen.png").is_file(), "--locate draws what Stage I finds")
        with open(out / "cloud.ply", "rb") as ply:
            head = ply.read(1000).split(b"end_header")[0].decode()
        finite = sum(p[2] == p[2] for p in points)
        check(f"element vertex {finite}\n" in head and "intensity" in head, "cloud.ply has every point, with intensity")
        check(run("locate", str(out / "cloud.pcd")).returncode == 0, "Stage I finds a grasp in cloud.pcd")

        ideal = Path(folder) / "ideal"
        run("capture", "--scene", "experiment_6", "--out", str(ideal), "--noise", "none", "--model-error", "none")
        _, exact = pcd_points(ideal / "cloud.pcd")
        check(sum(p[2] == p[2] for p in exact) > finite, "the ideal sensor loses no point for want of texture")

        again = Path(folder) / "b"
        run("capture", "--scene", "experiment_6", "--out", str(again))
        for name in ("cloud.pcd", "left.png", "right.png", "disparity.png"):
            check((out / name).read_bytes() == (again / name).read_bytes(), f"{name} repeats byte for byte")

        (Path(folder) / "bare").mkdir()
        bad = run("capture", "--sensor", "lidar", "--scene", str(without_laser(Path(folder) / "bare")), "--out", folder)
        check(bad.returncode == 2 and "laser" in bad.stderr and bad.stderr.count("\n") == 1,
              f"a sweep without a laser is refused: {bad.returncode} {bad.stderr}")
        bad = run("capture", "--scene", "no_such", "--out", folder)
        check(bad.returncode == 2 and bad.stderr.count("\n") == 1, "an unknown scene is refused in one sentence")
        (Path(folder) / "file").touch()
        bad = run("capture", "--out", str(Path(folder) / "file"))
        check(bad.returncode == 2 and bad.stderr.count("\n") == 1, f"a file for a folder is refused: {bad.stderr}")

        swept = Path(folder) / "swept"
        options = ("--scene", "experiment_6", "--noise", "none", "--model-error", "none")
        done = run("capture", *options, "--sensor", "lidar", "--out", str(swept))
        check(done.returncode == 0, f"a sweep exits with 0, not {done.returncode}: {done.stderr}")
        png(swept / "sweep.png")
        apart = depths_apart(pcd_points(swept / "sweep.pcd")[1], exact)
        check(len(apart) > 5000, f"laser and camera see the same: {len(apart)} points")
        median = sorted(apart)[len(apart) // 2]
        check(median < 0.002, f"and have it in the same place: {1e3 * median:.2f} mm apart in the median")
    end()


main()
