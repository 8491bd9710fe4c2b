#!/usr/bin/env python3
"""Tests walkman-hil locate on clouds generated here from surfaces in closed form: which object, in which frame, which
exit code.
Usage: locate_test.py PROGRAM"""

import json
import math
import random
import struct
import subprocess
import tempfile
from pathlib import Path

from checks import PROGRAM, check, end

SIZE, FOCAL = 400, 368.0
HEIGHT = 0.7  # camera height above the table, m
PITCH = math.atan2(HEIGHT, 0.5)


def table_point(right, away, up):
    """Converts table coordinates (below the camera) to the camera's optical frame."""
    up -= HEIGHT
    s, c = math.sin(PITCH), math.cos(PITCH)
    return (right, -s * away - c * up, c * away - s * up)


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def sub(a, b):
    return tuple(x - y for x, y in zip(a, b))


def unit(a):
    length = math.sqrt(dot(a, a))
    return tuple(x / length for x in a)


ORIGIN = table_point(0, 0, 0)
AXES = [sub(table_point(*e), ORIGIN) for e in ((1, 0, 0), (0, 1, 0), (0, 0, 1))]


def meet_box(ray, low, high):
    """Returns the depth at which a ray from the camera enters a box along the table's axes."""
    enter, leave = 0.0, math.inf
    for axis, a, b in zip(AXES, low, high):
        start, slope = -dot(axis, ORIGIN), dot(axis, ray)
        if abs(slope) < 1e-12:
            if not a <= start <= b:
                return math.inf
            continue
        t, u = (a - start) / slope, (b - start) / slope
        enter, leave = max(enter, min(t, u)), min(leave, max(t, u))
    return enter if 0 < enter <= leave else math.inf


def meet_tube(ray, start, end, radius):
    axis = unit(sub(end, start))
    along, w = dot(ray, axis), tuple(-x for x in start)
    u = sub(ray, tuple(along * x for x in axis))
    v = sub(w, tuple(dot(w, axis) * x for x in axis))
    a, b, c = dot(u, u), dot(u, v), dot(v, v) - radius * radius
    if a < 1e-15 or b * b < a * c:
        return math.inf
    t = (-b - math.sqrt(b * b - a * c)) / a
    place = dot(w, axis) + t * along
    return t if t > 0 and 0 <= place <= math.sqrt(dot(sub(end, start), sub(end, start))) else math.inf


def tube(right, away, length, radius):
    return ("tube", table_point(right - length / 2, away, radius), table_point(right + length / 2, away, radius), radius)


TABLE = ("box", (-0.7, 0.25, -0.04), (0.7, 1.05, 0))


def image(*objects):
    points = []
    for row in range(SIZE):
        for column in range(SIZE):
            ray = ((column - SIZE / 2 + 0.5) / FOCAL, (row - SIZE / 2 + 0.5) / FOCAL, 1.0)
            depth = min((meet_box if o[0] == "box" else meet_tube)(ray, *o[1:]) for o in (TABLE, *objects))
            points.append(tuple(depth * x for x in ray) if depth < 5 else (math.nan,) * 3)
    return points


def write(path, points, viewpoint="0 0 0 1 0 0 0"):
    head = (f"VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH {SIZE}\nHEIGHT {SIZE}\n"
            f"VIEWPOINT {viewpoint}\nPOINTS {SIZE * SIZE}\nDATA binary\n")
    path.write_bytes(head.encode() + b"".join(struct.pack("<3f", *p) for p in points))


def locate(path, *arguments):
    done = subprocess.run([PROGRAM, "locate", str(path), *arguments], capture_output=True, text=True, timeout=120)
    return done.returncode, done.stdout, done.stderr


def result(path, *arguments):
    code, out, err = locate(path, "--json", *arguments)
    check(out, f"no result: {err}")
    return code, json.loads(out)


def near(point):
    return ["--near", *(f"{x:.4f}" for x in point)]


def axis_distance(handle, tube_):
    axis, w = unit(sub(tube_[2], tube_[1])), sub(handle["centre"], tube_[1])
    return math.sqrt(max(0.0, dot(w, w) - dot(w, axis) ** 2))


def rotated(q, v):
    w, x, y, z = q
    u = (x, y, z)
    cross = lambda a, b: (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])
    t = tuple(2 * c for c in cross(u, v))
    return tuple(a + w * b + c for a, b, c in zip(v, t, cross(u, t)))


def main():
    folder = Path(tempfile.mkdtemp(prefix="locate"))
    bar, short = tube(0, 0.5, 0.6, 0.035), tube(0.1, 0.8, 0.25, 0.025)
    cloud = folder / "cloud.pcd"

    points = image(bar, short)
    write(cloud, points)
    code, plain = result(cloud)
    check(code == 0 and len(plain["objects"]) == 2, "two tubes: two objects and a grasp")
    check(plain["chosen"] == 0 and axis_distance(plain["handles"][0], bar) < 0.002, "the larger by default")
    check(abs(plain["handles"][0]["radius"] - 0.035) < 0.001, "its radius")
    check(not plain["cut_by_image"], "all of it is in the image")
    check(plain["handles"][0]["arc"] > 1.5 and plain["handles"][0]["residual"] < 0.001, "its figures")

    code, asked = result(cloud, *near(table_point(0.15, 0.8, 0.05)))
    check(code == 0 and asked["chosen"] == 1 and axis_distance(asked["handles"][0], short) < 0.002, "the one asked for")
    code, out, err = locate(cloud, *near(table_point(-0.4, 0.9, 0)))
    check(code == 1 and not out and err.count("\n") == 1 and "no object within 0.1 m" in err, f"none there: {err}")
    for wrong in (["--near", "1", "2"], ["--near", "1", "2", "nan"], ["--near", "a", "b", "c"]):
        code, out, err = locate(cloud, *wrong)
        check(code == 2 and not out and err.count("\n") == 1, f"{wrong}: {code} {err}")

    # The same cloud in the frame of a room.
    rng = random.Random(7)
    for _ in range(3):
        q = [rng.gauss(0, 1) for _ in range(4)]
        length = math.sqrt(sum(c * c for c in q))
        q = [c / length for c in q]
        at = [rng.uniform(-3, 3) for _ in range(3)]
        moved = lambda p: tuple(a + b for a, b in zip(rotated(q, p), at))
        write(cloud, [p if math.isnan(p[0]) else moved(p) for p in points],
              " ".join(f"{x:.9f}" for x in (*at, *q)))
        code, room = result(cloud, *near(moved(table_point(0.15, 0.8, 0.05))))
        check(code == 0 and room["chosen"] == 1, "the one asked for in the file's frame")
        for key in ("centre", "axis"):
            expected = asked["handles"][0][key]
            expected = moved(expected) if key == "centre" else rotated(q, expected)
            check(math.dist(room["handles"][0][key], expected) < 0.002, f"handle's {key} in the file's frame")
        check(math.dist(room["grasp"]["origin"], moved(asked["grasp"]["origin"])) < 0.003, "grasp in the file's frame")
        corner = moved(table_point(0.3, 0.6, 0))
        check(abs(dot(room["plane"]["normal"], corner) + room["plane"]["offset"]) < 0.001, "plane in the file's frame")

    # A box that is larger than the tube.
    box = ("box", (-0.45, 0.7, 0.0), (0.05, 1.0, 0.3))
    write(cloud, image(box, short))
    code, found = result(cloud)
    check(code == 0 and found["chosen"] == 1 and axis_distance(found["handles"][0], short) < 0.002,
          "the box has no handle, the tube has")
    code, out, err = locate(cloud, *near(table_point(-0.2, 0.7, 0.15)))
    check(code == 1 and "clusters that have handles: 1 (1)" in out, f"the box was asked for: {out}")

    write(cloud, image(tube(0.45, 0.6, 0.8, 0.035)))
    check(result(cloud)[1]["cut_by_image"], "the tube goes on beyond the image")

    write(cloud, image())
    for arguments in ([], ["--json"]):
        code, out, err = locate(cloud, *arguments)
        check(code == 1 and not out and err.count("\n") == 1 and "no object" in err, f"bare table: {code} {err}")
    write(cloud, [(math.nan,) * 3] * (SIZE * SIZE))
    check(locate(cloud)[0] == 1, "nothing seen")
    write(cloud, image(tube(0, 0.5, 0.6, 0.010)))
    code, thin = result(cloud)
    check(code == 1 and not thin["handles"], "too thin for the hand")
    end()


main()
