"""Contact episodes kept in plain Python, from MuJoCo's own functions: what the native log must say."""

from __future__ import annotations

import mujoco
import numpy as np

from escort_mj.monitor.signals import FIRST, SECOND, START
from escort_mj.signals import EPISODE
from escort_mj.world.callback import native_loop
from escort_mj.world.plant import Plant


class Log:
    """Steps a plant and looks at each step."""

    def __init__(self, plant: Plant) -> None:
        self.plant = plant
        self.names = list(plant.world.bodies.names)
        self.before = plant.data.qvel.copy()
        self.under_way: dict[tuple[int, int], list[float]] = {}
        self.ended: list[list[float]] = []

    def _body(self, geom: int) -> int:
        model = self.plant.world.model
        body = int(model.geom_bodyid[geom])
        while body and model.body_parentid[body]:
            body = int(model.body_parentid[body])
        return self.names.index(model.body(body).name if body else model.geom(geom).name)

    def _velocity(self, body: int) -> np.ndarray:
        """Of a body's center in the step that was solved [m/s]; a turning sphere adds nothing."""
        state, model, velocity = self.plant.state, self.plant.world.model, np.zeros(3)
        n, p = state.q.shape
        thing = model.body(self.names[body]) if self.names[body] != "floor" else None
        if thing is not None and thing.jntnum[0]:
            joint = thing.jntadr[0]
            free = model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_FREE
            first, count = model.jnt_dofadr[joint], 3 if free else p
            velocity[:count] = self.before[first : first + count]
        elif body == n:
            velocity[:p] = state.target_velocity
        return velocity

    def step(self) -> None:
        """Advances by a physics step, and adds its contacts."""
        self.before = self.plant.data.qvel.copy()
        self.plant.step(1)
        model, data, time = self.plant.world.model, self.plant.data, float(self.plant.state.time[0])
        touching: dict[tuple[int, int], list[float]] = {}
        force = np.zeros(6)
        for index in range(data.ncon):
            contact = data.contact[index]
            if contact.efc_address < 0 or contact.dist > 0.0:
                continue
            first, second = self._body(contact.geom[0]), self._body(contact.geom[1])
            mujoco.mj_contactForce(model, data, index, force)
            normal = contact.frame[:3]
            closing = float((self._velocity(first) - self._velocity(second)) @ normal)
            key = min(first, second), max(first, second)
            known = touching.setdefault(key, [0.0, 0.0, -np.inf])
            known[0] += float(force[0])
            known[1], known[2] = max(known[1], -float(contact.dist)), max(known[2], closing)
        for key in [key for key in self.under_way if key not in touching]:
            self.ended.append(self.under_way.pop(key))
        dt = model.opt.timestep
        for key, (total, depth, closing) in touching.items():
            row = self.under_way.setdefault(key, [*key, time, 0.0, 0.0, 0.0, time, 0.0, 0.0, closing])
            row[3] = time + dt
            row[4] += dt
            if total > row[5]:
                row[5], row[6] = total, time
            row[7] += total * dt
            row[8] = max(row[8], depth)

    def rows(self) -> np.ndarray:
        """All episodes, ended or not, shape (k, len(EPISODE)), in the order of `ordered`."""
        return ordered(np.array([*self.ended, *self.under_way.values()]))


def ordered(rows: np.ndarray) -> np.ndarray:
    """Rows by time, then bodies."""
    rows = rows.reshape(-1, len(EPISODE))
    return rows[np.lexsort((rows[:, SECOND], rows[:, FIRST], rows[:, START]))]


def told(plant: Plant) -> np.ndarray:
    """What the native log says: all episodes, ended or not."""
    return ordered(np.vstack([plant.ended(), plant.under_way()]))


def both(world, steps: int, launch=id) -> tuple[np.ndarray, np.ndarray, Plant]:
    """Episodes of so many steps, natively and in Python; and the plant."""
    with native_loop(world):
        plant = Plant(world)
        launch(plant)
        log = Log(plant)
        for _ in range(steps):
            log.step()
    return told(plant), log.rows(), plant
