"""Scenarios: the YAML format and its checks, and what it says about motion and the team."""

from escort_mj.scenario.geometry.placement import Placement, robot_count, team
from escort_mj.scenario.geometry.trajectory import Trajectory, disturbance_trajectory, target_trajectory
from escort_mj.scenario.reader.dump import dump_scenario, json_schema
from escort_mj.scenario.reader.load import load_file, parse_scenario
from escort_mj.scenario.schema.expressions import Expression, ExpressionError
from escort_mj.scenario.schema.scenario import Scenario

__all__ = [
    "Expression",
    "ExpressionError",
    "Scenario",
    "Placement",
    "Trajectory",
    "disturbance_trajectory",
    "dump_scenario",
    "json_schema",
    "load_file",
    "parse_scenario",
    "robot_count",
    "target_trajectory",
    "team",
]
