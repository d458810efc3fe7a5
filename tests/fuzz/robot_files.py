"""Robot files broken at random, with what anybody may get wrong in MJCF or URDF."""

from __future__ import annotations

import random
import re
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from escort_mj.api import scenarios_folder

SLIDER = """<mujoco>
  <worldbody>
    <body name="base" pos="0 0 0.2">
      <joint name="x" type="slide" axis="1 0 0"/><joint name="y" type="slide" axis="0 1 0"/>
      <geom name="hub" type="sphere" size="0.2" mass="1"/>
      <body name="arm" pos="0 0 0.1">
        <joint name="arm" axis="0 1 0"/>
        <geom type="capsule" size="0.02 0.1" mass="0.2"/></body>
    </body>
  </worldbody>
  <actuator><motor joint="x" ctrlrange="-20 20"/><motor joint="y" ctrlrange="-20 20"/></actuator>
</mujoco>
"""
ROVER = """<mujoco>
  <compiler angle="radian"/>
  <worldbody>
    <body name="base" pos="0 0 0.06">
      <freejoint/>
      <geom type="box" size="0.15 0.1 0.03" pos="0 0 0.04" mass="6"/>
      <geom size="0.02" friction="0.01 0.001 0.001" priority="1" mass="0.1" pos="0.12 0 -0.04"/>
      <geom size="0.02" friction="0.01 0.001 0.001" priority="1" mass="0.1" pos="-0.12 0 -0.04"/>
      <body name="left" pos="0 0.13 0">
        <joint name="left" axis="0 1 0"/>
        <geom type="cylinder" size="0.06 0.015" zaxis="0 1 0" mass="0.4"/></body>
      <body name="right" pos="0 -0.13 0">
        <joint name="right" axis="0 1 0"/>
        <geom type="cylinder" size="0.06 0.015" zaxis="0 1 0" mass="0.4"/></body>
    </body>
  </worldbody>
  <actuator><motor joint="left" ctrlrange="-1.5 1.5"/><motor joint="right" ctrlrange="-1.5 1.5"/></actuator>
</mujoco>
"""
URDF = """<robot name="cart">
  <link name="base">
    <inertial>
    <mass value="2"/>
    <inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><geometry><box size="0.3 0.3 0.2"/></geometry></collision></link>
  <link name="wheel">
    <inertial>
    <mass value="0.2"/>
    <inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><geometry><sphere radius="0.1"/></geometry></collision></link>
  <joint name="axle" type="continuous"><parent link="base"/><child link="wheel"/><axis xyz="0 1 0"/></joint>
</robot>
"""
GOOD = {
    "slider": SLIDER,
    "rover": ROVER,
    "hexarotor": (scenarios_folder() / "robots/hexarotor.xml").read_text(),
    "cart": URDF,
}
"""Files that are right, but for the URDF, which has no actuators."""
NUMBERS = [
    "0",
    "-1",
    "1e308",
    "1e-308",
    "nan",
    "inf",
    "-inf",
    "",
    "1 2 3 4 5 6 7",
    "x",
    "1e9",
    "0 0 0",
    "0 0 0 0",
    "0.1 -0.1",
    "1,5",
    "10mm",
    "true",
    "٣",
]
WORDS = [
    "",
    "base",
    "world",
    "target",
    "robot_1",
    "floor",
    "a/b",
    "é",
    " ",
    "x y",
    "../r.xml",
    "none",
    "sphere",
    "plane",
    "hfield",
    "sdf",
    "ball",
    "free",
]
EXTRAS = [
    '<include file="r.xml"/>',
    '<include file="/etc/hostname"/>',
    '<include file="nowhere.xml"/>',
    '<extension><plugin plugin="mujoco.elasticity.cable"/></extension>',
    '<asset><mesh name="m" file="nowhere.stl"/></asset>',
    '<asset><mesh name="m" vertex="0 0 0 1 0 0 0 1 0"/></asset>',
    '<asset><hfield name="h" nrow="2" ncol="2" size="1 1 1 1"/></asset>',
    '<asset><texture name="t" file="nowhere.png" type="2d"/></asset>',
    '<option timestep="0"/>',
    '<option timestep="nan" gravity="0 0 9.81"/>',
    '<option integrator="RK4"/>',
    '<size memory="1"/>',
    '<size njmax="1" nconmax="1"/>',
    '<compiler inertiafromgeom="false"/>',
    '<compiler angle="degrees"/>',
    '<compiler coordinate="global"/>',
    '<contact><exclude body1="base" body2="nobody"/></contact>',
    '<contact><pair geom1="hub" geom2="hub"/></contact>',
    '<equality><weld body1="base"/></equality>',
    '<equality><joint joint1="x" joint2="y"/></equality>',
    '<equality><connect body1="base" body2="arm" anchor="0 0 0"/></equality>',
    '<tendon><fixed name="t"><joint joint="x" coef="1"/></fixed></tendon>',
    '<actuator><motor joint="nobody"/></actuator>',
    '<actuator><motor joint="x" gear="0"/></actuator>',
    '<actuator><muscle joint="x"/></actuator>',
    '<actuator><adhesion body="base" ctrlrange="0 1"/></actuator>',
    '<sensor><user dim="3"/></sensor>',
    '<keyframe><key qpos="1 2 3 4 5 6 7 8 9 10 11 12 13 14"/></keyframe>',
    '<keyframe><key qpos="nan nan nan"/></keyframe>',
    '<worldbody><body name="base"><freejoint/><geom size="0.1"/></body></worldbody>',
    '<worldbody><body name="other" pos="3 0 0.2"><freejoint/><geom size="0.1"/></body></worldbody>',
    '<worldbody><body mocap="true"><geom size="0.1"/></body></worldbody>',
    '<worldbody><geom name="floor" type="plane" size="1 1 1"/></worldbody>',
    '<worldbody><geom type="sphere" size="500"/></worldbody>',
    '<worldbody><replicate count="30000" offset="1 0 0"><geom size="1"/></replicate></worldbody>',
    '<worldbody><replicate count="2000" offset="1 0 0">'
    '<body><freejoint/><geom size="0.1"/></body></replicate></worldbody>',
    '<worldbody><flexcomp name="f" type="grid" count="60 60 60" spacing="0.1 0.1 0.1" pos="0 0 1"/>'
    "</worldbody>",
    '<worldbody><composite type="cable" curve="s" count="100000 1 1" size="1"/></worldbody>',
    "<worldbody><body>" * 300 + "</body></worldbody>" * 300,
    "<deformable><skin/></deformable>",
    '<visual><map znear="0"/></visual>',
    '<statistic extent="nan"/>',
    '<custom><numeric name="plan" data="1 2 3"/></custom>',
    '<unheard of="it"/>',
    "<!-- -- -->",
    "]]>",
    "&nbsp;",
    "<?php ?>",
]


def _value(text: str, dice: random.Random) -> str:
    """An attribute with a value of another kind, or out of range."""
    found = list(re.finditer(r'(\w+)="([^"]*)"', text))
    one = dice.choice(found)
    words = one[1] in ("name", "type", "joint", "site", "class", "mesh", "file", "link", "angle")
    value = dice.choice(WORDS if words and dice.random() < 0.7 else NUMBERS)
    if re.fullmatch(r"[-\d. e]+", one[2]) and dice.random() < 0.5:
        value = " ".join(f"{float(x) * dice.choice((-1, 0, 1e-9, 1e3, 1e12)):g}" for x in one[2].split())
    return text[: one.start(2)] + value + text[one.end(2) :]


def _lost(text: str, dice: random.Random) -> str:
    """An attribute or an element that is lost, doubled or moved to the end of another."""
    pattern = dice.choice((r'\s\w+="[^"]*"', r"<[^/!?][^>]*/>", r"</?\w+[^>]*>"))
    one = dice.choice(list(re.finditer(pattern, text)))
    return text[: one.start()] + one.group() * dice.choice((0, 0, 2)) + text[one.end() :]


def _renamed(text: str, dice: random.Random) -> str:
    """An element or an attribute with a name of another one, or of none."""
    one = dice.choice(list(re.finditer(r"(?<=<)\w+|(?<= )\w+(?==)", text)))
    name = dice.choice(
        (
            one[0][:-1],
            one[0].upper(),
            dice.choice(
                (
                    "geom",
                    "joint",
                    "body",
                    "site",
                    "motor",
                    "position",
                    "freejoint",
                    "frame",
                    "size",
                    "pos",
                    "quat",
                    "range",
                    "damping",
                    "solref",
                    "margin",
                    "gap",
                    "contype",
                    "conaffinity",
                )
            ),
        )
    )
    return text[: one.start()] + name + text[one.end() :]


def _more(text: str, dice: random.Random) -> str:
    """An element that does not belong there, is circular, missing or huge."""
    ends = list(re.finditer(r"</(mujoco|robot|worldbody|body)>", text))
    at = dice.choice((ends[-1], dice.choice(ends))).start()
    return text[:at] + dice.choice(EXTRAS) + text[at:]


def _given(text: str, dice: random.Random) -> str:
    """An attribute that geoms, joints, bodies or motors have, with an odd value."""
    tag = dice.choice(("geom", "joint", "body", "motor"))
    names = {
        "geom": (
            "contype",
            "conaffinity",
            "margin",
            "gap",
            "mass",
            "density",
            "friction",
            "solref",
            "condim",
            "group",
            "quat",
            "fromto",
            "pos",
        ),
        "joint": (
            "range",
            "limited",
            "stiffness",
            "damping",
            "armature",
            "frictionloss",
            "springref",
            "ref",
            "pos",
            "type",
            "axis",
        ),
        "body": ("pos", "quat", "euler", "mocap", "gravcomp", "childclass"),
        "motor": ("ctrlrange", "forcerange", "gear", "ctrllimited", "actdim", "actlimited", "cranklength"),
    }[tag]
    found = list(re.finditer(rf"<{tag}(?=[ />])", text))
    if not found:
        return _value(text, dice)
    at = dice.choice(found).end()
    return f'{text[:at]} {dice.choice(names)}="{dice.choice(NUMBERS)}"{text[at:]}'


def _text(text: str, dice: random.Random) -> str:
    """Text that is no XML, or another one than it says."""
    return dice.choice(
        (
            lambda: text[: dice.randrange(len(text))],
            lambda: "",
            lambda: text + text,
            lambda: text.replace('"', "'", 1),
            lambda: "<!DOCTYPE a [<!ENTITY b 'c'>]>" + text,
            lambda: '<?xml version="1.0" encoding="utf-16"?>' + text,
            lambda: "\ufeff" + text,
            lambda: text.replace("base", "b\u202ease\0"),
            lambda: text.replace("mujoco", "robot"),
            lambda: text.replace("worldbody", "world"),
            lambda: "solid cube\nendsolid\n",
            lambda: '{"robot": 1}',
        )
    )()


WAYS: tuple[Callable[[str, random.Random], str], ...] = (
    _value,
    _value,
    _value,
    _lost,
    _renamed,
    _more,
    _given,
    _given,
    _text,
)


def robot_file(dice: random.Random) -> tuple[str, str]:
    """Return which file it was, and that with one or two things wrong in it."""
    name = dice.choice(sorted(GOOD))
    text = GOOD[name]
    for _ in range(dice.choice((1, 1, 2))):
        with suppress(IndexError):  # nothing is left of the kind
            text = dice.choice(WAYS)(text, dice)
    return name, text


def mission_of(name: str, folder: Path, text: str) -> dict[str, object]:
    """Write a robot file, and return a mission of two such robots."""
    (folder / "r.xml").write_text(text, errors="surrogatepass")
    still = [0.0] if name == "hexarotor" else []
    return {
        "duration": 0.1,
        "axes": 2 + len(still),
        "target": {"position": [9, 0, *still]},
        "robots": {"count": 2, "kind": {"kind": "mjcf", "file": "r.xml"}},
        "obstacles": [{"position": [4, 4, *(4.0 for _ in still)], "radius": 0.3}],
        "controller": {"gains": "auto"},
        "expect": [{"contacts": "none"}, {"sanity": "all"}],
    }
