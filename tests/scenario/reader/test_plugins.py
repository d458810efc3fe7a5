"""Plugins in scenarios: found, loaded, checked, and what messages say of wrong ones."""

import pickle
from pathlib import Path

import pytest

from escort_mj.components.parameters import description_of
from escort_mj.errors import PluginError, ScenarioError
from escort_mj.scenario import Scenario, dump_scenario, json_schema, load_file, parse_scenario
from escort_mj.scenario.reader.catalog import catalog_of, scenario_type_with
from escort_mj.scenario.reader.handbook import handbook
from escort_mj.scenario.reader.plugins import GROUP
from tests.corpus import assert_said, read
from tests.plugged import LAW, SCENARIO


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "own_law.py").write_text(LAW)
    (tmp_path / "own.yaml").write_text(SCENARIO)
    return tmp_path


def fault(folder, text=SCENARIO, law=None, plugins=()):
    """What is said of a scenario and its plugin."""
    if law is not None:
        (folder / "own_law.py").write_text(law)
    with pytest.raises(ScenarioError) as caught:
        parse_scenario(text, str(folder / "own.yaml"), (), plugins)
    (found,) = caught.value.faults
    return str(found)


class TestLoading:
    def test_a_law_of_a_file_beside_the_scenario_has_its_parameters_as_keys(self, folder):
        scenario = load_file(folder / "own.yaml", {"controller.proportional_gain": 7})
        assert isinstance(scenario, Scenario)
        assert (scenario.controller.law, scenario.controller.proportional_gain) == ("pid", 7.0)
        assert [plugin.name for plugin in catalog_of(scenario).plugins] == ["own_law.py"]

    def test_its_name_alone_stands_for_its_defaults(self, folder):
        scenario = load_file(folder / "own.yaml", {"controller": "pid"})
        assert scenario.controller.integral_gain == 20.0

    def test_it_is_the_law_of_all_robots(self, folder):
        rest = ", robots: [3, 4, 5], targets: [{name: b, position: [20, 0]}], controller: "
        teams = "target: null\nteams: [{name: one, robots: [1, 2], targets: [{name: a}], controller: pid}, "
        text = "plugins: [own_law.py]\n" + teams + "{name: two" + rest
        assert len(parse_scenario(text + "pid}]", str(folder / "own.yaml")).laws) == 1
        message = fault(folder, text + "pd}]")
        assert "teams[0].controller: found pid, the law of a plugin" in message

    def test_a_scenario_without_plugins_has_the_plain_type(self):
        assert type(parse_scenario("duration: 1")) is Scenario

    def test_plugins_of_the_command_line_come_beside_those_of_the_file(self, folder, monkeypatch):
        monkeypatch.chdir(folder)
        scenario = parse_scenario("controller: pid", "<text>", (), ["own_law.py"])
        assert scenario.controller.law == "pid"

    def test_a_copy_may_name_others(self, folder, monkeypatch):
        monkeypatch.chdir(folder)
        own = parse_scenario("duration: 1").replace({"plugins": ["own_law.py"], "controller": "pid"})
        assert own.controller.law == own.replace(seed=3).controller.law == "pid"
        assert Scenario(plugins=["own_law.py"], controller="pid") == own.replace(duration=30)
        with pytest.raises(ScenarioError, match='controller.law: found "pid"; allowed are'):
            own.replace({"plugins": []})
        with pytest.raises(ScenarioError, match=r"plugins\[0\]: .*none\.py: there is no such file"):
            own.replace({"plugins": ["none.py"]})

    def test_a_wrong_one_of_the_command_line_is_told_without_a_place_in_the_file(self, folder):
        with pytest.raises(PluginError, match=r"^\S*own_lav.py: there is no such file; did you mean"):
            parse_scenario("duration: 1", "<text>", (), [str(folder / "own_lav.py")])

    def test_the_same_content_is_loaded_once_and_changed_content_anew(self, folder):
        first, again = (type(load_file(folder / "own.yaml").controller) for _ in range(2))
        (folder / "own_law.py").write_text(LAW.replace("= 30.0", "= 31.0"))
        changed = load_file(folder / "own.yaml")
        assert first is again
        assert changed.controller.proportional_gain == 31.0
        description = description_of(type(changed.controller), "integral_gain")
        assert description == "Rate at which the estimate follows s [N/m]."

    def test_what_is_dumped_reads_back_and_knows_the_content(self, folder):
        scenario = load_file(folder / "own.yaml")
        text = dump_scenario(scenario)
        assert parse_scenario(text) == scenario
        (folder / "own_law.py").write_text(LAW + "\n")
        with pytest.raises(ScenarioError, match="own_law.py: has changed: .* take the key sha256 out"):
            parse_scenario(text)

    def test_pickled_it_comes_back_where_the_plugin_can_be_loaded(self, folder):
        scenario = load_file(folder / "own.yaml")
        assert pickle.loads(pickle.dumps(scenario)) == scenario

    def test_an_installed_plugin_is_found_by_its_entry_point(self, folder, monkeypatch):
        (folder / "nice_laws.py").write_text(LAW)
        info = folder / "nice_laws-2.5.dist-info"
        info.mkdir()
        (info / "METADATA").write_text("Metadata-Version: 2.1\nName: nice-laws\nVersion: 2.5\n")
        (info / "entry_points.txt").write_text(f"[{GROUP}]\nnice = nice_laws\n")
        monkeypatch.syspath_prepend(str(folder))
        scenario = parse_scenario("{plugins: [nice], controller: pid}")
        (plugin,) = catalog_of(scenario).plugins
        assert (plugin.name, plugin.version) == ("nice", "2.5")
        with pytest.raises(ScenarioError, match='no installed plugin .* did you mean "nice"'):
            parse_scenario("{plugins: [nicer], controller: pid}")


class TestSchema:
    def test_schema_and_handbook_know_the_parameters(self, folder):
        kind = scenario_type_with([str(folder / "own_law.py")])
        table = json_schema(kind)["$defs"]["Pid"]["properties"]["proportional_gain"]
        assert table["minimum"] == 0
        assert table["description"] == "Gain of the position error [N/m]."
        assert "| `integral_gain` | number >= 0 | `20.0` |" in handbook(kind)
        assert "Pid" not in handbook()

    def test_wrong_values_are_told_as_those_of_built_in_laws(self, folder):
        wrong = SCENARIO.replace("law: pid", "law: pid, integral_gain: -1")
        assert fault(folder, wrong).endswith("controller.integral_gain: found -1; expected at least 0")
        wrong = SCENARIO.replace("law: pid", "law: pid, integral_gian: 1")
        assert "is not a key of pid; allowed are" in fault(folder, wrong)
        assert fault(folder, wrong).endswith('did you mean "integral_gain"?')
        wrong = SCENARIO.replace("law: pid", "law: pib")
        assert fault(folder, wrong).endswith('did you mean "pid"?')


class TestWrongPlugins:
    def test_a_file_that_is_not_there(self, folder):
        message = fault(folder, SCENARIO.replace("own_law.py", "own_lav.py"))
        assert "there is no such file" in message
        assert message.endswith('did you mean "own_law.py"?')

    def test_a_module_beside_it_is_no_part_of_it(self, folder):
        (folder / "helpers.py").write_text("x = 1\n")
        message = fault(folder, law="import helpers\n" + LAW)
        assert "a plugin of several modules is an installed package" in message

    def test_two_plugins_with_one_name(self, folder):
        (folder / "more").mkdir()
        (folder / "more" / "own_law.py").write_text(LAW.replace('"pid"', '"other"'))
        assert "two plugins called own_law.py" in fault(folder, plugins=[str(folder / "more" / "own_law.py")])

    LONG = {"text": f"['{'x' * 5000}.py']", "said": "... cannot be read: File name too long"}

    @pytest.mark.parametrize("case", [*read(Path(__file__).parents[1] / "plugins.yaml"), LONG])
    def test_what_names_no_plugin(self, folder, case):
        text = SCENARIO.replace("[own_law.py]", str(case["text"])).replace("pid", "pd")
        assert_said(fault(folder, text), case["said"])
