"""Missions drawn at random with robots from files: geoms, joints, heights, masks and margins of all sorts.

Nothing avoids anything: robots go straight to goals behind obstacles, the target and one another.
"""

from __future__ import annotations

import json
from pathlib import Path
from random import Random
from typing import Any, NamedTuple

Keys = dict[str, Any]
GEOMS = ("sphere", "box", "capsule", "cylinder", "ellipsoid", "mesh")
SHAPES = ("sphere", "box", "cylinder", "capsule", "ellipsoid", "mesh")
MASKS = ((1, 1), (1, 1), (1, 1), (2, 4), (0, 1), (1, 0), (0, 0))
TARGET = 0.25  # radius of a target [m]
BUILT_IN = (
    "point_mass",
    "rolling_sphere",
    "diff_drive",
    {"kind": "slung", "payload_collides": True, "cable": 0.5},
    {"kind": "slung"},
)


ROVER = """<mujoco model="rover"><compiler angle="radian"/><worldbody>
  <body name="base" pos="0 0 0.06"><freejoint/>
    <geom type="box" size="0.15 0.1 {half}" pos="0 0 {middle}" mass="6"/>
    <geom size="0.02" friction="0.01 0.001 0.001" priority="1" mass="0.1" pos="0.12 0 -0.04"/>
    <geom size="0.02" friction="0.01 0.001 0.001" priority="1" mass="0.1" pos="-0.12 0 -0.04"/>
    <body name="left" pos="0 0.13 0"><joint name="left" axis="0 1 0"/>
      <geom type="cylinder" size="0.06 0.015" zaxis="0 1 0" mass="0.4"/></body>
    <body name="right" pos="0 -0.13 0"><joint name="right" axis="0 1 0"/>
      <geom type="cylinder" size="0.06 0.015" zaxis="0 1 0" mass="0.4"/></body>
    {limb}
  </body>
  </worldbody><actuator><motor joint="left" ctrlrange="-1.5 1.5"/><motor joint="right" ctrlrange="-1.5 1.5"/>
  </actuator></mujoco>"""


class Drawn(NamedTuple):
    """A mission and the files of its robots.

    Attributes:
        keys: The scenario.
        files: MJCF by file name.
    """

    keys: Keys
    files: dict[str, str]

    def write(self, folder: Path) -> Path:
        """Write all files to a folder, and return that of the scenario."""
        for name, text in self.files.items():
            (folder / name).write_text(text)
        path = folder / "drawn.yaml"
        path.write_text(json.dumps(self.keys))
        return path


def _numbers(*values: float) -> str:
    return " ".join(f"{value:.4g}" for value in values)


class _Draw:
    """What one seed draws."""

    def __init__(self, seed: int) -> None:
        self.random = Random(seed)
        self.meshes: list[str] = []

    def geom(self, name: str, mass: float, around: float = 0.0, ghostly: bool = True) -> str:
        """A geom near the origin of its body."""
        r, kind = self.random, self.random.choice(GEOMS)
        half = [r.uniform(0.04, 0.22) for _ in range(3)]
        size = {"sphere": half[:1], "capsule": half[:2], "cylinder": half[:2], "mesh": []}.get(kind, half)
        types, affinity = r.choice(MASKS if ghostly else MASKS[:3])
        text = f'<geom name="{name}" type="{kind}" mass="{mass:.3g}" contype="{types}"'
        text += f' conaffinity="{affinity}" pos="{_numbers(*(r.uniform(-around, around) for _ in range(3)))}"'
        text += f' euler="{_numbers(*(r.uniform(-1.5, 1.5) for _ in range(3)))}"'
        if size:
            text += f' size="{_numbers(*size)}"'
        if kind == "mesh":
            corners = [r.choice((-1, 1)) * r.uniform(0.05, 0.2) for _ in range(24)]
            self.meshes.append(f'<mesh name="{name}" vertex="{_numbers(*corners)}"/>')
            text += f' mesh="{name}"'
        if r.random() < 0.25:
            text += f' margin="{r.choice((0.02, 0.1, 0.3)):g}"'
        if r.random() < 0.15:
            text += f' gap="{r.choice((0.01, 0.05)):g}"'
        return f"{text}/>"

    def limb(self) -> tuple[str, str, str]:
        """A part on a joint of its own, its actuator, and its number in a keyframe."""
        r, kind = self.random, self.random.choice(("telescope", "pendulum", "spinner", "servo"))
        reach = r.uniform(0.2, 0.9)
        geom, away = self.geom("tip", 0.1, 0.05), f'pos="{_numbers(reach * 0.5, 0, r.uniform(-0.1, 0.2))}"'
        if kind == "telescope":
            joint = f'<joint name="limb" type="slide" axis="1 0 0" springref="{reach:.3g}" stiffness="3" '
            joint += f'damping="1" range="0 {reach + 0.2:.3g}"/>'
            return f'<body name="limb">{joint}{geom}</body>', "", "0"
        axis = r.choice(("0 0 1", "0 1 0")) if kind != "spinner" else "0 0 1"
        joint = f'<joint name="limb" type="hinge" axis="{axis}" damping="0.02"/>'
        body = f'<body name="limb">{joint}<body name="far" {away}>{geom}</body></body>'
        if kind == "spinner":
            servo = '<velocity name="limb" joint="limb" kv="0.02" ctrlrange="-50 50"/>'
            return body, servo, f"{r.uniform(2, 30):.3g}"
        if kind == "servo":
            servo = '<position name="limb" joint="limb" kp="2" kv="0.2" ctrlrange="-3 3"/>'
            return body, servo, f"{r.uniform(-2, 2):.3g}"
        return body, "", "0"

    def rover(self) -> str:
        """A robot on wheels that may tip over, perhaps with a mast that swings, as MJCF."""
        half = self.random.choice((0.03, 0.03, 0.15))
        limb = ""
        if self.random.random() < 0.4:
            limb = '<body name="mast" pos="0 0 0.1"><joint axis="0 1 0" stiffness="2" damping="0.05"/>'
            limb += '<geom type="capsule" size="0.02" fromto="0 0 0 0 0 0.4" mass="0.1"/></body>'
        return ROVER.format(half=half, middle=half + 0.01, limb=limb)

    def robot(self, axes: int) -> str:
        """A robot on slides, or in the plane one on wheels, as MJCF."""
        r = self.random
        self.meshes = []
        if axes == 2 and r.random() < 0.15:
            return self.rover()
        names = "xyz" if axes == 3 or r.random() < 0.2 else "xy"
        slides = "".join(
            f'<joint name="{axis}" type="slide" axis="{_numbers(*(float(axis == one) for one in "xyz"))}"/>'
            for axis in names
        )
        motors = "".join(f'<motor joint="{axis}" ctrlrange="-60 60"/>' for axis in names)
        count = r.choice((1, 1, 2, 3))
        ghost = r.random() < 0.03
        geoms = "".join(self.geom(f"part_{k}", 1.0 / count, 0.12 * (count > 1)) for k in range(count))
        if not ghost:
            geoms = geoms.replace('contype="0" conaffinity="0"', 'contype="1" conaffinity="1"', 1)
        limb, servo, control = self.limb() if r.random() < 0.6 else ("", "", "0")
        if ghost:
            geoms, limb, servo = '<geom name="ghost" size="0.2" contype="0" conaffinity="0"/>', "", ""
        key = ""
        if servo:
            pose, controls = ["0"] * (len(names) + 1), ["0"] * len(names) + [control]
            key = f'<keyframe><key qpos="{" ".join(pose)}" ctrl="{" ".join(controls)}"/></keyframe>'
        contact = (
            '<contact><exclude body1="base" body2="limb"/></contact>' if limb and r.random() < 0.5 else ""
        )
        height, aside = r.choice((0.2, 0.2, 0.5, r.uniform(-0.5, 1.5))), r.uniform(-1, 1)
        return (
            f'<mujoco model="drawn"><compiler angle="radian"/><asset>{"".join(self.meshes)}</asset>'
            f'<worldbody><body name="base" pos="{_numbers(aside, 0, height)}">{slides}{geoms}{limb}'
            f"</body></worldbody>{contact}<actuator>{motors}{servo}</actuator>{key}</mujoco>"
        )

    def obstacle(self, number: int, axes: int) -> Keys:
        """An obstacle near the middle."""
        r, shape = self.random, self.random.choice(SHAPES)
        place = [r.uniform(-0.6, 0.6), 2.4 * number - 1.2 + r.uniform(-0.5, 0.5), r.uniform(-0.3, 0.3)][:axes]
        keys: Keys = {"name": f"body_{number}", "shape": shape, "position": place}
        half = [round(r.uniform(0.1, 0.5), 3) for _ in range(3)]
        if shape == "sphere":
            keys["radius"] = half[0]
        elif shape == "mesh":
            keys["vertices"] = [
                [r.choice((-1, 1)) * r.uniform(0.15, 0.5) for _ in range(3)] for _ in range(8)
            ]
            if axes == 2:
                keys["vertices"] = [[-0.4, -0.3], [0.4, -0.2], [0.1, 0.4]]
        else:
            keys["size"] = half[: 3 if shape in ("box", "ellipsoid") else 2]
        if shape != "sphere" and r.random() < 0.4:
            keys["orientation"] = r.uniform(-1.5, 1.5)
        if r.random() < 0.25:
            keys["motion"] = {"position": [f"{place[0]:.3f} + 0.4*sin(t)", *place[1:]]}
            del keys["position"]
        return keys


def drawn(seed: int) -> Drawn:
    """Return the mission of a seed."""
    draw = _Draw(seed)
    r = draw.random
    axes, count = r.choice((2, 2, 3)), r.choice((1, 2, 3))
    files = {f"robot_{k}.xml": draw.robot(axes) for k in range(r.choice((1, 1, 2)))}
    kinds: list[Any] = [{"kind": "mjcf", "file": r.choice(list(files))} for _ in range(count)]
    if count > 1 and r.random() < 0.35:
        kinds[-1] = r.choice(BUILT_IN if axes == 2 else (BUILT_IN[0], *BUILT_IN[3:]))
    starts = [
        [r.choice((-1, 1)) * r.uniform(3.0, 3.5), 2.4 * k - 1.2 + r.uniform(-0.2, 0.2)] for k in range(count)
    ]
    deep = [[r.uniform(-0.2, 0.2)] for _ in range(count)] if axes == 3 else [[]] * count
    starts = [[*start, *more] for start, more in zip(starts, deep, strict=True)]
    goals = [
        [-start[0], start[1] + r.uniform(-0.5, 0.5), *more] for start, more in zip(starts, deep, strict=True)
    ]
    target: Keys | None = None
    if r.random() < 0.6:
        low = [0.0] * (axes - 2)
        target = {"position": ["0.9*t - 1.9", f"{r.uniform(-1, 3):.3f} + 0.2*t", *low], "radius": TARGET}
        if r.random() < 0.3:
            target["body"] = {}
    bound = round(r.uniform(0.05, 0.8), 3)
    expect: list[Keys] = [
        {"contacts": "none"},
        {"metric": "contacts", "at_most": r.choice((0, 1))},
        {"clearance": ["robots", "obstacles"], "at_least": bound},
        {"metric": "obstacle_clearance_min", "at_least": bound, "after": 1},
        {"contacts": ["robots", "body_0"]},
        {"clearance": ["robots", "body_0"], "at_least": bound},
    ]
    if count > 1:
        expect += [{"clearance": ["robots", "robots"], "at_least": bound}]
        expect += [{"metric": "robot_clearance_min", "at_least": bound, "before": 3}]
        expect += [{"contacts": ["robot_1", "robot_2"]}]
    if target is not None:
        expect += [{"clearance": ["robots", "target"], "at_least": bound}, {"contacts": ["robots", "target"]}]
        expect += [{"clearance": ["target", "obstacles"], "at_least": bound}]
        expect += [{"contacts": ["target", "obstacles"]}]
    keys: Keys = {
        "name": f"drawn {seed}",
        "duration": 4,
        "axes": axes,
        "seed": seed,
        "target": target,
        "robots": {
            "positions": starts,
            "kind": kinds[0],
            "overrides": [{"robot": k + 1, "kind": kind} for k, kind in enumerate(kinds) if k],
        },
        "obstacles": [draw.obstacle(k, axes) for k in range(r.choice((1, 2, 3)))],
        "mission": {
            "max_speed": r.choice((1.0, 2.0)),
            "behaviors": [{"behavior": "goal", "goals": goals, "gain": 1}],
        },
        "controller": {"proportional_gain": 4, "derivative_gain": 12, "adaptation_rate": 2},
        "recording": {"rate": r.choice((500, 50, 5))},
        "expect": expect,
    }
    return Drawn(keys, files)
