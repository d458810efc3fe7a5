"""What a plugin is shown is not what others judge."""

import numpy as np
import pytest

from escort_mj import Scenario, errors, load_scenario, run

WRITERS = {
    "sets the flag": "a = trace['clearance'].values; a.flags.writeable = True; a[:] = 100.0",
    "looks behind": "trace['clearance']._array[:] = 100.0",
    "goes to the base": "a = trace['clearance'].values.base; a.flags.writeable = True; a[:] = 100.0",
    "takes a part": "a = trace.isel(time=range(9))['clearance'].values; a.flags.writeable = True; a[:] = 9.0",
}
METRIC = """\
from escort_mj.plugins import metric
@metric(unit="m")
def forged(trace):
    \"\"\"A metric that writes.\"\"\"
    BODY
    return 1.0
"""
EXPECTATION = """\
from pydantic import PositiveFloat
from escort_mj.plugins import Expectation, Judgment
class Forged(Expectation):
    \"\"\"An expectation that writes.\"\"\"
    kind = "forged"
    forged: PositiveFloat
    \"\"\"Bound [m].\"\"\"
    SKIP
    def judge(self, trace):
        BODY
        return Judgment(held=True, words="w")
"""
LAW = """\
from typing import Literal
from escort_mj.plugins import Law
class Forged(Law):
    \"\"\"A law that writes.\"\"\"
    law: Literal["forged"] = "forged"
    def force(self, robots):
        robots.time.flags.writeable = True
        robots.time[0] = 5.0
"""


def mission(folder, text, entry=None, **keys):
    """Two robots 5.6 m apart, and a plugin."""
    (folder / "plugin.py").write_text(text)
    expect = [{"clearance": ["robots", "robots"], "at_least": 5.8}]
    whole = {
        "duration": 1,
        "robots": {"positions": [[3, 0], [-3, 0.5]]},
        "plugins": [str(folder / "plugin.py")],
    }
    return load_scenario(whole | {"expect": [entry, *expect] if entry else expect} | keys)


@pytest.mark.parametrize("body", WRITERS.values(), ids=WRITERS)
def test_what_judges_writes_to_copies(compiled, tmp_path, body):
    plain = run(Scenario(duration=1, robots={"positions": [[3, 0], [-3, 0.5]]}))
    metric = mission(tmp_path, METRIC.replace("BODY", body), {"metric": "forged", "at_most": 5})
    expectation = mission(tmp_path, EXPECTATION.replace("BODY", body).replace("SKIP", ""), {"forged": 1})
    for scenario in (metric, expectation):
        found = run(scenario)
        assert found.verdicts[1].passed and not found.verdicts[2].passed
        assert np.array_equal(found.trace["clearance"].values, plain.trace["clearance"].values)


def test_a_law_cannot_write_to_what_it_reads(compiled, tmp_path):
    found = run(mission(tmp_path, LAW, controller={"law": "forged"}))
    assert found.outcome.value == "failed" and "plugin.py:7" in found.message


def test_a_key_that_is_inherited_cannot_be_hidden(tmp_path):
    text = EXPECTATION.replace("BODY", "pass").replace("SKIP", "skip = property(lambda self: 'me')")
    with pytest.raises(errors.EscortError, match="Forged: skip is a key that it inherits"):
        mission(tmp_path, text, {"forged": 1})


def test_a_key_whose_bounds_are_no_numbers_is_refused(tmp_path):
    bound = "extra: __import__('typing').Annotated[float, __import__('pydantic').Field(gt='x')] = 1.0"
    text = EXPECTATION.replace("BODY", "pass").replace("SKIP", bound)
    with pytest.raises(errors.EscortError, match=r"plugin\.py: SchemaError"):
        mission(tmp_path, text, {"forged": 1})


@pytest.mark.parametrize("name", ["subject", "demanded", "watched", "window_in", "judge_run"])
def test_an_expectation_says_by_its_judgment_alone_what_it_found(tmp_path, name):
    """All else is called where an exit would end the command, and skip what else is judged."""
    text = EXPECTATION.replace("BODY", "pass").replace("SKIP", f"{name} = property(lambda self: quit())")
    with pytest.raises(errors.EscortError, match=f"Forged: found {name} .*has parameters and judge"):
        mission(tmp_path, text, {"forged": 1})
