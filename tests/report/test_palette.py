import itertools

import numpy as np
import pytest

from escort_mj import palette

# Machado, Oliveira, Fernandes 2009, severity 1, on linear RGB.
SIGHT = {
    "full": np.eye(3),
    "deuteranopia": [
        [0.367322, 0.860646, -0.227968],
        [0.280085, 0.672501, 0.047413],
        [-0.01182, 0.04294, 0.968881],
    ],
    "protanopia": [
        [0.152286, 1.052583, -0.204868],
        [0.114503, 0.786281, 0.099216],
        [-0.003882, -0.048116, 1.051998],
    ],
}


def oklab(color, sight):
    color = np.asarray(color)
    linear = np.where(color <= 0.04045, color / 12.92, ((color + 0.055) / 1.055) ** 2.4)
    seen = np.clip(np.asarray(SIGHT[sight]) @ linear, 0, 1)
    cones = np.cbrt(
        np.array([[0.41222, 0.53633, 0.05145], [0.21190, 0.68070, 0.10740], [0.08830, 0.28172, 0.62998]])
        @ seen
    )
    return (
        np.array([[0.21045, 0.79362, -0.00407], [1.978, -2.42859, 0.45059], [0.0259, 0.78277, -0.80868]])
        @ cones
    )


@pytest.mark.parametrize("sight", SIGHT)
def test_colors_stay_apart_for_everyone(sight):
    colors = [*palette.robot_colors(8), palette.TARGET, palette.OBSTACLE]
    for one, other in itertools.combinations(colors, 2):
        assert np.linalg.norm(oklab(one, sight) - oklab(other, sight)) > 0.05


@pytest.mark.parametrize("count", [1, 5, 12, 13, 50, 5000])
def test_every_robot_has_a_color(count):
    colors = np.array(palette.robot_colors(count))
    assert colors.shape == (count, 3) and colors.min() >= 0 and colors.max() <= 1
    assert len({tuple(color) for color in colors}) == count


def test_a_robot_keeps_its_color_as_the_team_grows():
    assert palette.robot_colors(12)[:5] == palette.robot_colors(5)


def test_a_large_team_is_shaded_from_dark_to_bright():
    lightness = [oklab(color, "deuteranopia")[0] for color in palette.robot_colors(40)]
    assert (np.diff(lightness) > 0).all()


@pytest.mark.parametrize("index", [-1, 5])
def test_no_such_robot(index):
    with pytest.raises(IndexError):
        palette.robot_color(index, 5)
