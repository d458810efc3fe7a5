"""One scenario under other laws and outer loops."""

from __future__ import annotations

from escort_mj.control.outer_loops import OUTER_LOOPS, OuterLoop
from escort_mj.laws import Law
from escort_mj.scenario import Scenario
from escort_mj.scenario.reader.catalog import catalog_of


def controller_of(base: Scenario, law: str) -> Law:
    """A law with the gains of the scenario's own law, where both have them and mean the same by them.

    Args:
        base: The scenario.
        law: Name of the law; the scenario's own law comes back as it is.
    """
    if base.controller.law == law:
        return base.controller
    (model,) = [model for model in catalog_of(base).of(Law) if model.own_name() == law]
    own = model.own_keys | base.controller.own_keys | {"law"}
    shared = [
        key for key in type(base.controller).model_fields if key in model.model_fields and key not in own
    ]
    return model(**{key: getattr(base.controller, key) for key in shared})


def outer_of(base: Scenario, loop: str) -> OuterLoop:
    """An outer loop by its name: the scenario's own as it is, any other with its default gains."""
    if base.mission.outer.loop == loop:
        return base.mission.outer
    (model,) = [model for model in OUTER_LOOPS if model.own_name() == loop]
    return model.model_validate({})
