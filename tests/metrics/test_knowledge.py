"""Metrics of knowledge and messages, on made traces and, recomputed, on a mission of `test_recomputed`."""

import numpy as np
import pytest

from escort_mj.measuring import measure
from tests.metrics.motions import TIME

N = 4
RING = np.array([[2, 4], [1, 3], [2, 4], [1, 3]])  # whom each hears, from 1


@pytest.fixture
def traced(make_trace):
    def make(**given):
        known = {"target_covariance": np.tile(np.eye(2), (N, 1, 1)), "heard_from": RING} | given
        return make_trace(TIME, robots=N, **known)

    return make


def test_errors_of_estimates(traced):
    off = np.zeros((len(TIME), N, 2))
    off[:, 1] = [0.3, 0.4]
    trace = traced(target_estimate=off, target_covariance=np.tile(0.25 * np.eye(2), (N, 1, 1)))
    assert measure("estimate_error_rms", trace).value == pytest.approx(0.5 / 2.0)
    found = measure("disagreement_max", trace)
    assert (found.value, found.who) == (pytest.approx(0.5 * 0.75), "robot 2")
    assert measure("estimate_consistency", trace).value == pytest.approx(0.25 / 0.25 / 4 / 2)


def test_ages_and_messages(traced):
    age = np.zeros((len(TIME), N))
    age[-1, 2] = 3.0
    count = 10.0 * TIME[:, None] * np.ones(N)
    trace = traced(
        information_age=age, messages_sent=count, messages_heard=1.5 * count, messages_lost=0.5 * count
    )
    assert measure("information_age_max", trace).value == 3.0
    assert measure("message_rate", trace).value == pytest.approx(10.0)
    assert measure("messages_lost_share", trace).value == pytest.approx(0.25)


def test_a_ring_that_breaks(traced):
    whole = traced()
    assert measure("connectivity_min", whole).value == pytest.approx(2.0)  # 2 - 2 cos(2 pi / 4)
    assert measure("disconnected_time", whole).value == 0.0
    heard = np.tile(RING, (len(TIME), 1, 1))
    heard[200:300] = [[2, 0], [1, 0], [4, 0], [3, 0]]
    heard[300:] = [[0, 0], [1, 0], [2, 0], [3, 0]]  # one way is enough
    apart = traced(heard_from=heard)
    assert (measure("connectivity_min", apart).value, measure("connectivity_min", apart).time) == (
        0.0,
        TIME[200],
    )
    assert measure("disconnected_time", apart).value == pytest.approx(2.0)
    lost = np.zeros((len(TIME), N))
    lost[:, :2] = 1.0
    assert measure("disconnected_time", traced(heard_from=heard, lost=lost)).value == 0.0


def test_an_estimator_without_a_covariance_is_not_judged(traced):
    trace = traced(target_covariance=np.zeros((N, 2, 2)))
    assert measure("estimate_consistency", trace).reason == "the estimator does not say how sure it is"


def test_without_knowledge_or_messages(make_trace):
    trace = make_trace(TIME, robots=2, truth=False)
    for name in ("estimate_error_rms", "disagreement_max", "information_age_max", "estimate_consistency"):
        assert measure(name, trace).reason == "all robots know what the team's sensors show"
    for name in ("message_rate", "messages_lost_share", "connectivity_min", "disconnected_time"):
        assert measure(name, trace).reason == "robots do not communicate"


def _knows(again):
    return "knowledge" in again.case.keys


def _off(again):
    return again.get("target_estimate") - again.target[:, None]


def recomputed_estimate_error_rms(again):
    return (
        float(np.sqrt((_off(again)[again.tail] ** 2).sum() / again.tail.sum() / again.n))
        if _knows(again)
        else None
    )


def recomputed_disagreement_max(again):
    if not _knows(again):
        return None
    estimate = again.get("target_estimate")[again.tail]
    return float(max(np.linalg.norm(row - row.mean(axis=0), axis=1).max() for row in estimate))


def recomputed_information_age_max(again):
    """The seer looks every 20 ms; each hop takes the delay and waits for the next message."""
    return float(again.get("information_age")[again.tail].max()) if _knows(again) else None


def recomputed_estimate_consistency(again):
    if not _knows(again) or again.case.keys["knowledge"]["estimator"] == "hold":
        return None
    covariance = again.get("target_covariance").reshape(again.steps, again.n, again.p, again.p)
    found = [
        off @ np.linalg.inv(sure) @ off
        for offs, sures in zip(_off(again)[again.tail], covariance[again.tail], strict=True)
        for off, sure in zip(offs, sures, strict=True)
    ]
    return float(np.mean(found) / again.p)


def recomputed_message_rate(again):
    """At a rate from the start on, or at every step."""
    if not _knows(again):
        return None
    period = 1.0 / again.case.keys["communication"].get("rate", 500.0)
    return float(np.floor(again.time[-1] / period + 1e-9) / again.time[-1])


def recomputed_messages_lost_share(again):
    if not _knows(again):
        return None
    gone, heard = again.get("messages_lost"), again.get("messages_heard")
    gone, heard = gone[-1] - gone[0], heard[-1] - heard[0]
    return float(gone.sum() / (gone + heard).sum())


def _laplacians(again):
    for heard in again.get("heard_from").astype(int):
        graph = np.zeros((again.n, again.n))
        for i, row in enumerate(heard):
            for j in row[row > 0] - 1:
                graph[i, j] = graph[j, i] = 1.0
        yield np.diag(graph.sum(axis=0)) - graph


def recomputed_connectivity_min(again):
    if not _knows(again):
        return None
    return float(max(0.0, round(min(np.sort(np.linalg.eigvalsh(one))[1] for one in _laplacians(again)), 9)))


def recomputed_disconnected_time(again):
    if not _knows(again):
        return None
    apart = [np.linalg.matrix_rank(one) < again.n - 1 for one in _laplacians(again)]
    return float(sum(apart[:-1]) * 0.002)
