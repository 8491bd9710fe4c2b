"""Scenes around Experiment 1's: a bar on a table in front of the robot, with one or all properties different."""

import dataclasses
import math
import pathlib
import random
import typing

BAR_LENGTH = 1.05  # m
WEIGHT_THICKNESS = 0.015  # m, along the bar
CLAMP_OVER_BAR = 0.010  # m, by which a clamp projects beyond the bar
TABLE_TOP = 0.90  # m, of table.urdf
TABLE_MIDDLE = 0.90  # m, the near edge is at 0.50


@dataclasses.dataclass
class Case:
    name: str
    mass: float = 1.2  # kg, bar and weights
    bar_share: float = 1 / 6  # share of the mass that is the bar's own
    diameter: float = 0.07  # m
    weights: tuple = (0.25, 0.95)  # m from the left end; none: a bare bar
    friction: float = 0.8  # of the bar
    table: float = 0.90  # m
    yaw: float = 0.0  # rad, 0: across in front of the robot
    x: float = 0.70  # m, centre of the bar
    y: float = -0.24
    bar_com: float = -0.03  # m, of the bar alone from its centre
    off_axis: float = 0.0  # m, horizontal offset of the total centre of mass from the bar's axis, by its clamps
    tilt: float = 0.0  # rad, of the table, its far edge up
    slope: float = 0.0  # rad, of the table, its left side up
    beside: tuple = ()  # boxes on the table: x, y, then sizes, m
    refusal: str = ""  # what a refusal may say: a regular expression

    def com(self) -> float:
        """Returns the true centre of mass, m from the left end."""
        own = self.mass * (self.bar_share if self.weights else 1)
        middle = BAR_LENGTH / 2 + self.bar_com
        if not self.weights:
            return middle
        each = (self.mass - own) / len(self.weights)
        return (own * middle + each * sum(self.weights)) / self.mass


def tube_urdf(case: Case) -> str:
    mass = case.mass * (case.bar_share if case.weights else 1)
    r = case.diameter / 2
    about = mass * r * r
    across = mass * (r * r / 2 + BAR_LENGTH**2 / 12 - case.bar_com**2)
    return f"""<robot name="bar"><link name="bar">
  <inertial><origin xyz="{case.bar_com:.6g} 0 0"/><mass value="{mass:.6g}"/>
    <inertia ixx="{about:.6g}" ixy="0" ixz="0" iyy="{across:.6g}" iyz="0" izz="{across:.6g}"/></inertial>
  <collision><origin rpy="0 {math.pi / 2} 0"/><geometry><cylinder radius="{r:.6g}" length="{BAR_LENGTH}"/></geometry></collision>
  <contact><lateral_friction value="{case.friction:.6g}"/></contact>
</link></robot>
"""


def clamp_urdf(case: Case) -> str:
    mass = case.mass * (1 - case.bar_share) / len(case.weights)
    side = case.diameter + 2 * CLAMP_OVER_BAR
    beside = case.off_axis / (1 - case.bar_share)
    along = mass * (side**2 / 6 - beside**2)
    across = mass * (side**2 + WEIGHT_THICKNESS**2) / 12
    upright = across - mass * beside**2
    return f"""<robot name="clamp"><link name="clamp">
  <inertial><origin xyz="0 {beside:.6g} 0"/><mass value="{mass:.6g}"/>
    <inertia ixx="{along:.6g}" ixy="0" ixz="0" iyy="{across:.6g}" iyz="0" izz="{upright:.6g}"/></inertial>
  <collision><geometry><box size="{WEIGHT_THICKNESS} {side:.6g} {side:.6g}"/></geometry></collision>
  <contact><lateral_friction value="{case.friction:.6g}"/></contact>
</link></robot>
"""


def box_urdf(size) -> str:
    return f"""<robot name="box"><link name="box">
  <collision><origin xyz="0 0 {size[2] / 2}"/><geometry><box size="{size[0]} {size[1]} {size[2]}"/></geometry></collision>
</link></robot>
"""


def rotation(roll: float, pitch: float, yaw: float):
    cr, sr, cp, sp, cy, sy = (f(a) for a in (roll, pitch, yaw) for f in (math.cos, math.sin))
    return [[cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr]]


def times(a, b):
    return [[sum(a[i][k] * b[k][j] for k in range(3)) for j in range(len(b[0]))] for i in range(3)]


def rpy(r):
    return math.atan2(r[2][1], r[2][2]), -math.asin(max(-1.0, min(1.0, r[2][0]))), math.atan2(r[1][0], r[0][0])


def write_scene(case: Case, urdf_folder: pathlib.Path, folder: pathlib.Path) -> pathlib.Path:
    """Writes the scene and its objects' URDFs; returns the scene's file."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "bar.urdf").write_text(tube_urdf(case))
    if case.weights:
        (folder / "clamp.urdf").write_text(clamp_urdf(case))
    table = rotation(case.slope, -case.tilt, 0)
    normal = [row[2] for row in table]
    # Under the bar's centre, the table top is at the table's height.
    under = (case.x, case.y, case.table)
    middle_top = [TABLE_MIDDLE, 0.0, 0.0]
    middle_top[2] = under[2] - (normal[0] * (middle_top[0] - under[0]) + normal[1] * (middle_top[1] - under[1])) / normal[2]
    frame = [middle_top[i] - TABLE_TOP * normal[i] for i in range(3)]
    side = case.diameter / 2 + (CLAMP_OVER_BAR if case.weights else 0)
    above = 0.0002 + 0.02 * max(abs(math.sin(case.tilt)), abs(math.sin(case.slope)))  # its shifts are along the floor
    centre = [under[i] + (side + above) * normal[i] for i in range(3)]
    turned = times(table, rotation(0, 0, -math.pi / 2 + case.yaw))
    numbers = lambda values: ", ".join(f"{v:.6f}" for v in values)
    text = f"""robot:
  file: {urdf_folder / "walkman.robot.yaml"}
  posture: home
  base: {{kind: floating, xyz_m: [0.047, 0, 1.0478], rpy_rad: [0, 0, 0]}}
fixed_bodies:
  - {{name: room, urdf: {urdf_folder / "scenes/room.urdf"}, xyz_m: [0, 0, 0], rpy_rad: [0, 0, 0]}}
  - {{name: table, urdf: {urdf_folder / "scenes/table.urdf"}, xyz_m: [{numbers(frame)}], rpy_rad: [{numbers(rpy(table))}]}}
"""
    for i, box in enumerate(case.beside):
        (folder / f"box_{i}.urdf").write_text(box_urdf(box[2:]))
        text += (f"  - {{name: box_{i}, urdf: box_{i}.urdf, xyz_m: [{box[0]:.4f}, {box[1]:.4f}, {case.table:.4f}], "
                 f"rpy_rad: [0, 0, 0]}}\n")
    text += f"""objects:
  - name: bar
    urdf: bar.urdf
    xyz_m: [{numbers(centre)}]
    rpy_rad: [{numbers(rpy(turned))}]
"""
    if case.weights:
        text += "    weights:\n"
        for i, at in enumerate(case.weights):
            text += f"      - {{name: weight_{i}, urdf: clamp.urdf, from_left_end_m: {at:.4f}}}\n"
    text += "jitter: {x_m: 0.01, y_m: 0.01, yaw_rad: 0.035}\n"
    file = folder / "scene.yaml"
    file.write_text(text)
    return file


def one_at_a_time() -> typing.List[Case]:
    """Returns Experiment 1's scene with one property changed at a time."""
    degrees = math.pi / 180
    cases = [Case(f"mass {m} kg", mass=m) for m in (0.5, 0.8, 2.0, 3.0, 4.0)]
    # The open fingers reach 7 cm below the palm: with a lower object they would touch the table beside it.
    low = lambda height: "(Finger|Thumb).* and the table would touch" if height < 0.068 else ""
    cases += [Case(f"diameter {100 * d:g} cm", diameter=d, refusal=low(d + CLAMP_OVER_BAR)) for d in (0.04, 0.05, 0.06, 0.08, 0.09)]
    cases += [Case(f"bare, diameter {100 * d:g} cm", diameter=d, weights=(), bar_com=-0.08, refusal=low(d))
              for d in (0.04, 0.055, 0.07, 0.09)]
    cases += [Case(f"friction {f}", friction=f) for f in (0.3, 0.5, 1.0, 1.2)]
    cases += [Case(f"table {t} m", table=t) for t in (0.75, 0.82, 0.97, 1.05)]
    cases += [Case(f"yaw {a} degrees", yaw=a * degrees) for a in (-40, -20, 20, 40)]
    # Turned this far, its near end would be inside the robot.
    cases += [Case(f"yaw {a} degrees, x 0.82 m", yaw=a * degrees, x=0.82) for a in (-60, 60)]
    cases += [Case(f"x {x} m", x=x) for x in (0.58, 0.64, 0.76, 0.82)]
    cases += [Case(f"y {y} m", y=y) for y in (-0.45, -0.10, 0.0, 0.10, 0.25, 0.45)]
    cases += [Case(f"weights at {a} and {b} m", weights=(a, b)) for a, b in ((0.30, 0.75), (0.38, 0.67), (0.42, 0.56))]
    cases += [Case(f"CoM {100 * c:+.0f} cm off", bar_share=0.5, weights=(0.525 + c - 0.12, 0.525 + c + 0.12), bar_com=c)
              for c in (-0.30, -0.20, 0.20, 0.30)]
    cases += [Case(f"CoM {1000 * o:+.0f} mm beside the axis", off_axis=o) for o in (-0.015, -0.006, 0.006, 0.015)]
    cases += [
        Case("a box beside its left half", beside=((0.78, 0.10, 0.06, 0.10, 0.12),)),
        Case("a box behind it", beside=((0.85, -0.20, 0.08, 0.40, 0.20),)),
        Case("boxes at both sides", beside=((0.58, -0.36, 0.05, 0.05, 0.06), (0.83, 0.0, 0.06, 0.06, 0.10))),
    ]
    cases += [Case(f"table's far edge {t} degrees up", tilt=t * degrees) for t in (3, 10)]
    cases += [Case(f"table's left side {t} degrees up", slope=t * degrees) for t in (3, 10, -10)]
    return cases


def beyond() -> typing.List[Case]:
    """Heavier, or with a longer lever, than the hand and arm can carry: to be put down again, and held where that is
    possible."""
    cases = [Case(f"beyond: mass {m} kg", mass=m, refusal="above its motor's continuous torque") for m in (6.0, 8.0, 12.0)]
    # These turn or swing in the fingers; near their centre of mass they can be held.
    cases += [Case(f"beyond: 4 kg, CoM {100 * c:+.0f} cm off", mass=4, bar_share=0.5,
                   weights=(0.525 + c - 0.12, 0.525 + c + 0.12), bar_com=c) for c in (-0.30, -0.20, 0.20, 0.30)]
    return cases


def drawn(count: int, seed: int) -> typing.List[Case]:
    """Returns scenes with every property changed at once, over the same ranges."""
    draw = random.Random(seed)
    cases = []
    for i in range(count):
        bare = draw.random() < 0.25
        first = draw.uniform(0.05, 0.45)
        cases.append(Case(
            f"drawn {i + 1}",
            mass=draw.uniform(0.5, 4.0) if not bare else draw.uniform(0.5, 2.0),
            bar_share=draw.uniform(0.15, 0.5),
            diameter=draw.uniform(0.04, 0.09),
            weights=() if bare else (first, draw.uniform(max(0.55, first + 0.15), 1.0)),
            friction=draw.uniform(0.3, 1.2),
            table=draw.uniform(0.75, 1.05),
            yaw=math.radians(draw.uniform(-60, 60)),
            x=draw.uniform(0.58, 0.82),
            y=draw.uniform(-0.45, 0.45),
            bar_com=draw.uniform(-0.15, 0.15)))
    return cases
