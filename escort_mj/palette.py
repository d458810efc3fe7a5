"""The colors that stay the same through every figure and the video: plain numbers, no plotting library.

Up to twelve robots get colors of their own: Okabe and Ito's, then darker and lighter ones chosen so that
any two stay apart for the color-blind too. Larger teams are shaded along the viridis ramp, so that
robots next to each other in the team look alike and a color bar can tell them.
"""

from __future__ import annotations

Color = tuple[float, float, float]
"""Red, green, blue (sRGB), each in 0..1."""


def from_hex(code: str) -> Color:
    """The color that six hexadecimal digits stand for."""
    red, green, blue = (int(code[place : place + 2], 16) / 255 for place in (0, 2, 4))
    return red, green, blue


TARGET = from_hex("1A1A1A")
OBSTACLE = from_hex("6A6A6A")
LIMIT = from_hex("4D4D4D")  # a bound: the escort radius, the safe distance, the force limit
RADIO = from_hex("2E7DA6")  # robots that hear each other
CONTACT = from_hex("C8001E")  # bodies that touch
LOST = (0.55, 0.56, 0.58)  # a robot that the team has lost

# Colors that a scenario can name for its obstacles.
NAMED = {
    name: from_hex(code)
    for name, code in {
        "gray": "6A6A6A",
        "red": "B2423B",
        "orange": "D98E3C",
        "yellow": "D9C24A",
        "green": "4F8F5B",
        "blue": "4A78A8",
        "purple": "84619E",
        "brown": "8A6642",
        "white": "E4E4E4",
    }.items()
}
OPPONENT = NAMED["purple"]
TEAMS = ("blue", "orange", "green", "red", "yellow", "brown")  # names of the colors of teams, in their order

# The behaviors by name; robots that nothing rules stay blank.
BEHAVIORS = {
    name: from_hex(code)
    for name, code in {
        "avoid_obstacles": "C8001E",
        "chords": "0072B2",
        "vertices": "009E73",
        "repulsion": "7F3B08",
        "surface": "E69F00",
        "goal": "56B4E9",
        "formation": "CC79A7",
    }.items()
}
PHASES = tuple(from_hex(code) for code in ("F2F2F2", "88CCEE", "DDCC77", "CC6677", "AA4499", "44AA99"))

# Why the Lyapunov function changes, in the order of `signals.CAUSES`.
CAUSES = tuple(
    from_hex(code) for code in ("01665E", "7F3B08", "332288", "888888", "CC79A7", "B58900", "C8001E")
)

_DISTINCT = tuple(
    from_hex(code)
    for code in (
        ("0072B2", "E69F00", "009E73", "CC79A7", "56B4E9", "D55E00")  # Okabe and Ito
        + ("332288", "7F3B08", "D9C800", "00D0B4", "01665E", "40004B")
    )
)
_RAMP = tuple(
    from_hex(code)
    for code in ("440154", "482878", "3E4989", "31688E", "26828E", "1F9E89", "35B779", "6ECE58", "B5DE2B")
)

MOST_DISTINCT = len(_DISTINCT)
MOST_LINES = 60
"""Robots that pictures show one by one, each with a line of its own; of more they show the crowd."""


def robot_color(index: int, count: int) -> Color:
    """The color of one robot of a team.

    Args:
        index: Which robot, counted from 0: an index into arrays, one less than the robot's number.
        count: Number of robots in the team.

    Raises:
        IndexError: If the team has no such robot.
    """
    if not 0 <= index < count:
        raise IndexError(f"index {index} in a team of {count} robots")
    if count <= MOST_DISTINCT:
        return _DISTINCT[index]
    place = index / (count - 1) * (len(_RAMP) - 1)
    step = min(int(place), len(_RAMP) - 2)
    share = place - step
    channels = zip(_RAMP[step], _RAMP[step + 1], strict=True)
    red, green, blue = ((1 - share) * low + share * high for low, high in channels)
    return red, green, blue


def team_color(index: int) -> Color:
    """The color of a team, by its index, counted from 0; after the last color comes the first."""
    return NAMED[TEAMS[index % len(TEAMS)]]


def target_color(team: int) -> Color:
    """The color of a team's target, by the number of the team; 0: no team escorts it, it is an obstacle."""
    return team_color(team - 1) if team > 0 else OBSTACLE


def robot_colors(count: int) -> list[Color]:
    """The colors of a whole team, in the order of its arrays."""
    return [robot_color(index, count) for index in range(count)]
