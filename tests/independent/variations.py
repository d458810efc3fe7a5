"""Missions in which who looks at samples, at centers or at MuJoCo's list alone is wrong: ten of a kind."""

from pathlib import Path

from ruamel.yaml import YAML

from tests.independent.missions import Keys, Variation, mission

__all__ = ["EVERY", "GROUPS", "Keys", "Variation"]

FOLDER = Path(__file__).with_name("variations")
GROUPS = {
    group: [
        Variation(one["name"], mission(**one["mission"]), one["questions"])
        for one in YAML(typ="safe").load(FOLDER / f"{group}.yaml")
    ]
    for group in ("time", "through", "inside", "speed")
}
EVERY = [(group, variation) for group, variations in GROUPS.items() for variation in variations]
