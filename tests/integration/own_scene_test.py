#!/usr/bin/env python3
"""A user's own scenes. A pole of two links, one of them a mesh, and a box beside it, both on the table: the pole is the larger
one, and the result is judged by the plant, from the pole's centre of mass in its URDF. And a robot that is hit so hard that its
hardware would not survive. Usage: own_scene_test.py PROGRAM SOURCE_TREE"""

import json
import math
import pathlib
import sys
import tempfile

from checks import check, end, run

LENGTH, RADIUS, SIDES = 0.80, 0.03, 24  # m
POLE_MASS, BLOCK_MASS, BLOCK_AT = 0.4, 0.6, 0.22  # kg, m to the right of the pole's centre
BLOCK = 0.10  # m, its edge length


def write_prism(file):
    """Writes the pole as an STL, its axis along x."""
    ring = [(RADIUS * math.cos(2 * math.pi * i / SIDES), RADIUS * math.sin(2 * math.pi * i / SIDES)) for i in range(SIDES)]
    facets = []
    for (y, z), (v, w) in zip(ring, ring[1:] + ring[:1]):
        left, right = [(-LENGTH / 2, y, z), (-LENGTH / 2, v, w)], [(LENGTH / 2, y, z), (LENGTH / 2, v, w)]
        facets += [(left[0], right[0], right[1]), (left[0], right[1], left[1])]
        facets += [((-LENGTH / 2, 0, 0), left[0], left[1]), ((LENGTH / 2, 0, 0), right[1], right[0])]
    with open(file, "w", encoding="ascii") as out:
        print("solid pole", file=out)
        for facet in facets:
            print(" facet normal 0 0 0\n  outer loop", file=out)
            for corner in facet:
                print("   vertex", *corner, file=out)
            print("  endloop\n endfacet", file=out)
        print("endsolid pole", file=out)


def write_scene(folder, urdf):
    write_prism(folder / "pole.stl")
    across = POLE_MASS * (RADIUS**2 / 4 + LENGTH**2 / 12)
    (folder / "pole.urdf").write_text(f"""<robot name="pole">
  <link name="pole">
    <inertial><mass value="{POLE_MASS}"/>
      <inertia ixx="{POLE_MASS * RADIUS**2 / 2}" ixy="0" ixz="0" iyy="{across}" iyz="0" izz="{across}"/></inertial>
    <collision><geometry><mesh filename="pole.stl"/></geometry></collision>
  </link>
  <link name="block">
    <inertial><mass value="{BLOCK_MASS}"/>
      <inertia ixx="0.001" ixy="0" ixz="0" iyy="0.001" iyz="0" izz="0.001"/></inertial>
    <collision><geometry><box size="0.03 {BLOCK} {BLOCK}"/></geometry></collision>
  </link>
  <link name="foot">
    <inertial><mass value="0.02"/>
      <inertia ixx="3e-5" ixy="0" ixz="0" iyy="2e-5" iyz="0" izz="2e-5"/></inertial>
    <collision><geometry><box size="0.03 {BLOCK} {BLOCK}"/></geometry></collision>
  </link>
  <joint name="block_on_pole" type="fixed"><parent link="pole"/><child link="block"/><origin xyz="{BLOCK_AT} 0 0"/></joint>
  <joint name="foot_on_pole" type="fixed"><parent link="pole"/><child link="foot"/><origin xyz="-0.36 0 0"/></joint>
</robot>
""")
    (folder / "crate.urdf").write_text("""<robot name="crate"><link name="crate">
  <inertial><mass value="0.3"/><inertia ixx="0.001" ixy="0" ixz="0" iyy="0.001" iyz="0" izz="0.001"/></inertial>
  <collision><geometry><box size="0.12 0.12 0.08"/></geometry></collision>
</link></robot>
""")
    scene = folder / "own.yaml"
    scene.write_text(f"""extends: {urdf / "scenes" / "robot_at_table.yaml"}
objects:
  - {{name: crate, urdf: crate.urdf, xyz_m: [0.95, 0.25, 0.94], rpy_rad: [0, 0, 0.3]}}
  - {{name: pole, urdf: pole.urdf, xyz_m: [0.70, -0.20, 0.95], rpy_rad: [0, 0, -1.570796327]}}
""")
    return scene


def hit(urdf):
    """A blow on the other hand, beyond the range of its wrist's sensor."""
    with tempfile.TemporaryDirectory() as scratch:
        scene = pathlib.Path(scratch) / "hit.yaml"
        scene.write_text(f"""extends: {urdf / "scenes" / "experiment_11.yaml"}
events:
  - in_phase: {{phase: approach, after_s: 0.5}}
    push: {{link: LSoftHand, force_N: [0, 0, 2500], duration_s: 0.006}}
""")
        done = run("experiment", "--scene", str(scene), "--json", "--out", str(pathlib.Path(scratch) / "out"))
        check(done.returncode == 1, f"exit {done.returncode}: {done.stderr[-300:]}")
        repetition = json.loads(done.stdout)["repetitions"][0]
    check(repetition["outcome"] == "stopped" and "l_arm_ft" in repetition["reason"], str(repetition))
    torques = [limit for limit in repetition["limits"] if limit.startswith("torque on l_arm_ft, N·m: ")]
    check(len(torques) == 1 and torques[0].endswith(" s, expected at most 35"), f"{repetition['limits']}")


def main():
    urdf = pathlib.Path(sys.argv[2]).resolve() / "urdf"
    com = (BLOCK_MASS * BLOCK_AT - 0.02 * 0.36) / (POLE_MASS + BLOCK_MASS + 0.02) + LENGTH / 2  # from its left end
    with tempfile.TemporaryDirectory() as scratch:
        folder = pathlib.Path(scratch)
        done = run("experiment", "--scene", str(write_scene(folder, urdf)), "--seed", "3", "--model-error", "calibrated",
                   "--json", "--out", str(folder / "out"))
        check(done.returncode == 0, f"exit {done.returncode}: {done.stderr[-300:]}")
        result = json.loads(done.stdout)
        repetition = result["repetitions"][0]
    check(result["experiment"] is None and result["scene"] == "own", f"{result['experiment']}, {result['scene']}")
    check(repetition["outcome"] in ("minimum torque", "minimum displacement"), str(repetition))
    check(abs(repetition["d_r"] - com) < 1e-6, f"centre of mass at {repetition['d_r']} m, by the URDF {com}")
    check(abs(repetition["f_g"] - 1.02 * 9.81) < 0.5, f"{repetition['f_g']} N")
    check(abs(repetition["d_after"] - repetition["d_after_true"]) < 0.005, f"{repetition['d_after']} m")
    # Where the hand closed, as seen, and how far the centre of mass is from there, in truth.
    check(abs(repetition["d_v"] + repetition["d_true"] - com) < 0.003, f"{repetition['d_v']} + {repetition['d_true']} m, {com}")
    check(repetition["regrasps"] >= 1 and repetition["reduction_percent_true"] > 80, f"{repetition['reduction_percent_true']} %")
    hit(urdf)
    end()


main()
