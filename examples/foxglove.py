"""A run folder as an MCAP file for Foxglove: bodies as balls, and what each robot does, at every sample.

Run it: pip install mcap; python examples/foxglove.py renders/main main.mcap
"""

import json
import sys
from pathlib import Path

from mcap.writer import Writer

import escort_mj


def named(values) -> dict[str, float]:
    """Coordinates by the names of their axes."""
    return {axis: float(value) for axis, value in zip("xyz", values, strict=False)}


def ball(name: str, place, radius: float, color: tuple[float, float, float]) -> dict:
    """A body as Foxglove's SceneUpdate has it."""
    still = {"x": 0.0, "y": 0.0, "z": 0.0}
    sphere = {
        "pose": {"position": still | named(place), "orientation": still | {"w": 1.0}},
        "size": dict.fromkeys("xyz", 2.0 * radius),
        "color": dict(zip("rgba", (*color, 1.0), strict=True)),
    }
    empty = dict.fromkeys(("arrows", "cubes", "cylinders", "lines", "triangles", "texts", "models"), ())
    zero = {"sec": 0, "nsec": 0}
    about = {"timestamp": zero, "lifetime": zero, "frame_locked": False, "metadata": ()}
    return {"id": name, "frame_id": "world", "spheres": [sphere]} | about | empty


def convert(folder: str | Path, path: str | Path) -> None:
    """Write an MCAP file with messages in JSON; time zero is the start of the mission."""
    trace = escort_mj.open_run(folder).trace
    signals = {"position": "q", "velocity": "v", "reference_velocity": "v_d", "force": "force"}
    signals = {key: name for key, name in signals.items() if not trace[name].isnull().all()}  # as logged
    with open(path, "wb") as file:
        writer, channels = Writer(file), {}
        writer.start(library="escort_mj")

        def write(topic: str, schema: str, time: float, message: dict) -> None:
            if topic not in channels:
                kind = writer.register_schema(schema, "jsonschema", b'{"type": "object"}')
                channels[topic] = writer.register_channel(topic, "json", kind)
            moment = round(1e9 * time)
            writer.add_message(channels[topic], moment, json.dumps(message).encode(), moment)

        for k, time in enumerate(trace.time.values):
            bodies = [ball("target", trace.target_position.values[k], trace.target_radius, (0.1, 0.1, 0.1))]
            for name, radius, place in zip(
                trace.obstacle.values,
                trace.obstacle_radius.values,
                trace.obstacle_position.values[k],
                strict=True,
            ):
                bodies.append(ball(str(name), place, radius, (0.5, 0.5, 0.5)))
            for number, (radius, place) in enumerate(
                zip(trace.robot_radius.values, trace.q.values[k], strict=True), 1
            ):
                bodies.append(ball(f"robot_{number}", place, radius, (0.0, 0.45, 0.7)))
                told = {key: named(trace[name].values[k, number - 1]) for key, name in signals.items()}
                write(f"/robots/{number}", "escort_mj.Robot", time, told)
            write("/scene", "foxglove.SceneUpdate", time, {"deletions": (), "entities": bodies})
        writer.finish()


if __name__ == "__main__":
    convert(sys.argv[1], sys.argv[2])
