"""Synthetic traces with contact episodes and clearances: two robots, a target, a rock, a wall, a floor."""

import numpy as np
import xarray

BODIES = {
    "robot_1": "robots",
    "robot_2": "robots",
    "target": "target",
    "rock": "obstacles",
    "wall_1": "walls",
    "floor": "floor",
}
NAMES = list(BODIES)
GROUPS = ("robots", "target", "obstacles", "walls", "rock")
RADIUS = 5.0


def episode(first, second, start, long=0.1, force=2.0, depth=1e-3, closing=0.5):
    """One touch; its peak is in the middle."""
    return {
        "first": NAMES.index(first),
        "second": NAMES.index(second),
        "start": start,
        "end": start + long,
        "touch_time": long,
        "peak_force": force,
        "peak_time": start + 0.5 * long,
        "impulse": 0.5 * force * long,
        "depth": depth,
        "closing_speed": closing,
    }


def watched(*episodes, end=10.0, rows=11, clearance=(), target_clearance=(), **given):
    """A trace of two robots at rest on the mission's radius.

    Args:
        episodes: Touches.
        end: Its last time.
        rows: Its samples.
        clearance: (row, robot, group, distance, name of the body that is near).
        target_clearance: (row, group, distance, name).
        given: Other values of a variable or an attribute.
    """
    time = np.linspace(0.0, end, rows)
    near = np.full((rows, 2, len(GROUPS)), 3.0)
    body = np.full(near.shape, NAMES.index("rock"))
    for row, robot, group, distance, name in clearance:
        near[row, robot, GROUPS.index(group)] = distance
        body[row, robot, GROUPS.index(group)] = NAMES.index(name)
    about_target = np.full((rows, len(GROUPS)), 3.0)
    body_at_target = np.full(about_target.shape, NAMES.index("rock"))
    for row, group, distance, name in target_clearance:
        about_target[row, GROUPS.index(group)] = distance
        body_at_target[row, GROUPS.index(group)] = NAMES.index(name)
    q = np.zeros((rows, 2, 2))
    q[:, :, 0] = [RADIUS, -RADIUS]
    still = np.zeros((rows, 2, 2))
    variables = {
        "q": (("time", "robot", "axis"), q),
        "v": (("time", "robot", "axis"), still.copy()),
        "force": (("time", "robot", "axis"), still.copy()),
        "disturbance": (("time", "robot", "axis"), still.copy()),
        "target_position": (("time", "axis"), np.zeros((rows, 2))),
        "target_velocity": (("time", "axis"), np.zeros((rows, 2))),
        "work": (("time", "robot"), np.zeros((rows, 2))),
        "lost": (("time", "robot"), np.zeros((rows, 2), int)),
        "speed_max": (("time", "robot"), np.zeros((rows, 2))),
        "target_speed_max": ("time", np.zeros(rows)),
        "obstacle_speed_max": (("time", "obstacle"), np.zeros((rows, 2))),
        "clearance": (("time", "robot", "group"), near),
        "clearance_body": (("time", "robot", "group"), body),
        "target_clearance": (("time", "group"), about_target),
        "target_clearance_body": (("time", "group"), body_at_target),
        "obstacle_position": (("time", "obstacle", "axis"), np.full((rows, 2, 2), 9.0)),
        "contacts_untold": ("time", np.zeros(rows, int)),
        "body_thickness": ("body", np.array([0.4, 0.4, 0.6, 1.0, 0.8, np.inf])),
        "robot_radius": ("robot", np.array([0.2, 0.2])),
        "robot_mass": ("robot", np.array([1.0, 2.0])),
        "neighbors": (("edge", "end"), np.zeros((0, 2), int)),
        "spacing": ("edge", np.zeros(0)),
    }
    keys = episode("robot_1", "robot_2", 0.0)
    for key in keys:
        values = np.array([one[key] for one in episodes], int if key in ("first", "second") else float)
        variables[f"episode_{key}"] = ("episode", values)
    trace = xarray.Dataset(
        variables,
        coords={
            "time": time,
            "robot": [1, 2],
            "group": list(GROUPS),
            "body": NAMES,
            "obstacle": ["rock", "wall_1"],
            "body_group": ("body", list(BODIES.values())),
            "body_motion": ("body", ["free", "free", "led", "still", "still", "still"]),
        },
        attrs={"mission_radius": RADIUS, "timestep": 0.002, "gravity": 0.0, "wind": 0.0, "robots_mass": 3.0},
    )
    for name, value in given.items():
        if name in trace:
            trace[name][:] = value
        else:
            trace.attrs[name] = value
    return trace
