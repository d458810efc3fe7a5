"""The Lyapunov function and its causes: computed again in NumPy, and what the theory says of them."""

import numpy as np
import pytest

from escort_mj.monitor.signals import CAUSES
from tests.corpus import missions

STARTS = [[5, 10], [-5, 5], [-5, -5], [5, -10], [5, 0]]
QUIET = {
    "robots": {"positions": STARTS, "force_limit": None},
    "mission": {"radius": 5.0},
    "target": {"position": ["3+0.1*t", 0]},
    "recording": {"truth": True},
}
MISSIONS = missions(__file__)
LAWS = {
    "apd_smc": {"slope": 20.0, "kp": 30.0, "kd": 50.0, "k": 1.0, "mu": 20.0},
    "asmc": {"slope": 20.0, "kp": 0.0, "kd": 0.0, "k": 80.0, "mu": 20.0},
    "pd_smc": {"slope": 20.0, "kp": 30.0, "kd": 50.0, "k": 1.0, "mu": 0.0},
}
DT = 0.002


def dot(*vectors: np.ndarray) -> np.ndarray:
    product = vectors[0] * vectors[1]
    return product.sum(axis=-1)


def twin(r: dict[str, np.ndarray], mass: float, slope: float, kp: float, kd: float, k: float, mu: float):
    """V1, rho and the change of V1 by cause over each step, of a record of every step of free masses."""
    e, e_dot = r["q_d"] - r["q"], r["v_d"] - r["v"]
    s = e_dot + slope * e
    push = np.diff(r["v_d"], axis=0, prepend=r["v_d"][:1]) / DT
    rho = mass * (push + slope * e_dot) + r["bias_force"]
    error = rho - r["rho_hat"]
    stiffness = kp + slope * kd
    v1 = 0.5 * (mass * dot(s, s) + stiffness * dot(e, e) + (dot(error, error) / mu if mu else 0.0))

    ideal = r["rho_hat"] + kp * e + kd * e_dot + k * np.tanh(s)
    carried = np.diff(r["q_d"], axis=0) / DT - r["v_d"][:-1]  # how fast anti-windup carries q_d
    adapted = np.diff(r["rho_hat"], axis=0) / DT
    now = {name: value[:-1] for name, value in (("e", e), ("e_dot", e_dot), ("s", s), ("error", error))}
    measured = r["s"][:-1]
    jump = np.diff(r["v_d"], axis=0)
    later = rho[1:] - r["rho_hat"][1:]
    before = rho[:-1] - r["rho_hat"][1:]
    change = {
        "dissipation": -DT
        * (
            kd * dot(now["e_dot"], now["e_dot"])
            + slope * kp * dot(now["e"], now["e"])
            + k * dot(now["s"], np.tanh(now["s"]))
        ),
        "external": -DT * dot(now["s"], r["disturbance"][:-1]),
        "noise": -DT * dot(now["s"], (r["tau"] - ideal)[:-1]),
        "saturation": -DT * dot(now["s"], (r["force"] - r["tau"])[:-1]),
        "anti_windup": DT * dot(stiffness * now["e"] + slope * mass * now["s"], carried),
        "reference": mass * dot(s[1:] - 0.5 * jump, jump) - DT * mass * dot(now["s"], push[:-1]),
    }
    if mu:
        change["noise"] -= DT * dot(now["error"], measured - now["s"])
        change["anti_windup"] += DT * dot(now["error"], measured - adapted / mu)
        change["reference"] += 0.5 * (dot(later, later) - dot(before, before)) / mu
    else:
        change["reference"] += DT * dot(now["s"], now["error"])
    change["unexplained"] = np.diff(v1, axis=0) - sum(change.values())
    return v1, rho, change


@pytest.mark.parametrize("law", LAWS)
def test_every_cause_computed_again(law: str, make_world, record_steps) -> None:
    world = make_world(**MISSIONS["noisy"], controller=law)
    record = record_steps(world, 800)
    v1, rho, change = twin(record, mass=1.6, **LAWS[law])
    size = np.abs(v1).max()
    np.testing.assert_allclose(record["reference_torque"], rho, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(record["lyapunov"], v1, rtol=1e-9, atol=1e-9)
    for index, cause in enumerate(CAUSES):
        booked = np.diff(record["lyapunov_change"][..., index], axis=0)
        np.testing.assert_allclose(booked, change[cause], rtol=1e-7, atol=1e-11 * size, err_msg=cause)
        assert np.abs(change[cause]).max() > 1e-3, f"{cause} plays no part here"
    total = record["lyapunov"][0] + record["lyapunov_change"].sum(axis=2)
    np.testing.assert_allclose(total, record["lyapunov"], rtol=0, atol=1e-11 * size)


@pytest.mark.parametrize(
    "law", [law if law == "apd_smc" else pytest.param(law, marks=pytest.mark.slow) for law in LAWS]
)
def test_what_is_unexplained_shrinks_with_the_timestep(law: str, make_world, record_steps) -> None:
    """MuJoCo's semi-implicit Euler steps have order 1: half the timestep, half of what is unexplained."""
    left = []
    timesteps = np.array([2e-3, 1e-3, 5e-4])
    for timestep in timesteps:
        world = make_world(**QUIET, controller=law, physics={"timestep": float(timestep)})
        record = record_steps(world, round(0.4 / timestep))
        unexplained = record["lyapunov_change"][..., CAUSES.index("unexplained")]
        left.append(np.abs(np.diff(unexplained, axis=0)).sum())
    slope = np.polyfit(np.log(timesteps), np.log(left), 1)[0]
    assert 0.85 < slope < 1.15
    assert left[-1] < 0.02 * record["lyapunov"][0].sum()


def test_it_falls_at_every_step_once_the_reference_is_accounted_for(make_world, record_steps) -> None:
    record = record_steps(make_world(**QUIET), 1500)
    left = record["lyapunov"] - record["lyapunov_change"][..., CAUSES.index("reference")]
    assert np.diff(left, axis=0).max() <= 1e-12 * record["lyapunov"][0].max()
    for cause in ("external", "noise", "saturation", "anti_windup"):
        assert np.abs(record["lyapunov_change"][..., CAUSES.index(cause)]).max() < 1e-10


@pytest.mark.parametrize("law", ["pd", "computed_torque", "super_twisting"])
def test_a_law_of_another_family_has_truth_but_no_lyapunov_function(law, make_world, record_steps) -> None:
    world = make_world(**MISSIONS["noisy"], controller=law)
    record = record_steps(world, 200)
    assert "lyapunov" not in record and "lyapunov_change" not in record
    e_dot = record["v_d"] - record["v"]
    push = np.diff(record["v_d"], axis=0, prepend=record["v_d"][:1]) / DT
    rho = 1.6 * (push + world.setup.law.slope * e_dot) + record["bias_force"]
    np.testing.assert_allclose(record["reference_torque"], rho, rtol=1e-9, atol=1e-9)
