"""Pictures of the shipped scenarios, and docs/gallery.md with them.

python -m benchmarks.gallery [NAME ...] --docs

Each scenario is run and filmed with few frames; one of them, at a telling moment, is kept. Pictures that are
there are kept where names are given; the page lists all that have one.
"""

from __future__ import annotations

import argparse
import subprocess
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

import escort_mj
from benchmarks.document import DOCS, publish
from escort_mj.recognize import scenario_names, scenarios_folder
from escort_mj.record.folder import read_run
from escort_mj.report.video.encode import find_ffmpeg
from escort_mj.report.video.video import render_video, scenario_video
from escort_mj.scenario.reader.handbook import with_links

PICTURES = DOCS / "figures" / "gallery"
WIDTH, HEIGHT = 960, 540
FRAMES = 12  # of each film
TELLING = 0.55  # share of the mission at which most show what they are about
MOMENTS = {
    "main": 0.4,
    "head_on": 0.15,
    "supervised": 0.45,
    "one_of_six_fails": 0.75,
    "crowd": 0.5,
    "robots/diff_drive": 0.33,
    "robots/surface_vessel": 0.25,
    "worlds/pushed": 0.4,
    "worlds/corridor": 0.45,
    "worlds/depot": 0.68,
    "worlds/squeeze": 0.42,
    "goals/swap": 0.2,
    "goals/swap_32": 0.22,
    "goals/swap_space_100": 0.22,
    "goals/opening": 0.42,
    "goals/coverage": 0.15,
    "goals/waiting": 0.28,
    "worlds/tethered": 0.5,
    "knowledge/crossing": 0.15,
    "knowledge/split_and_rejoin": 0.5,
    "pursuit/dash": 0.8,
    "benchmarks/gcbf": 0.15,
    "benchmarks/gcbf_space": 0.1,
    "benchmarks/gcbf_drone": 0.15,
}
# Pictures of all that there is; others go with the target.
WHOLE = {"crowd", "head_on", "sixteen_cell", "benchmarks/gcbf"}
WHOLE |= {"benchmarks/gcbf_space", "benchmarks/gcbf_drone"}
WHOLE |= {f"goals/swap{rest}" for rest in ("", "_32", "_space_100")}
WHOLE |= {f"goals/{name}" for name in ("opening", "coverage", "dead_end", "waiting")}
WHOLE |= {"knowledge/crossing", "worlds/tethered", "worlds/downwash", "worlds/ground_effect"}
SECTIONS = {
    "": "Missions",
    "knowledge": "What robots know",
    "goals": "Goals and formations",
    "pursuit": "Pursuit",
    "robots": "Kinds of robots",
    "worlds": "Worlds",
    "benchmarks": "Benchmarks",
    "paper": "The paper's seven cases",
}


def main() -> None:
    """Takes the pictures that are asked for, or all, and writes the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", help="scenarios to take anew [default: all]")
    parser.add_argument("--docs", action="store_true", help="write the page, too")
    options = parser.parse_args()
    PICTURES.mkdir(parents=True, exist_ok=True)
    for name in options.names or shown():
        print(name, picture(name), flush=True)
    publish("gallery.md", {"gallery": "\n\n".join(filter(None, map(section, SECTIONS)))}, options.docs)


def shown() -> list[str]:
    """Names of the scenarios that are shown; those of planted faults are not."""
    return [name for name in scenario_names(scenarios_folder()) if not name.startswith("faults/")]


def file_of(name: str) -> Path:
    """Where a scenario's picture is."""
    return PICTURES / f"{name.replace('/', '-')}.webp"


def picture(name: str) -> Path:
    """Runs a scenario and keeps one frame of its film."""
    with tempfile.TemporaryDirectory() as folder:
        escort_mj.run(name, folder, figures=False, video=False)
        run = read_run(folder)
        end = float(run.trace["time"][-1])
        wanted: dict[str, Any] = {"width": WIDTH, "height": HEIGHT, "rate": 1, "speed": end / FRAMES}
        wanted |= {} if name in WHOLE else {"camera": "follow"}
        film = render_video(folder, scenario_video(run).model_copy(update=wanted))
        frame = round(MOMENTS.get(name, TELLING) * FRAMES)
        one = rf"-vf select=eq(n\,{frame}) -frames:v 1 -f rawvideo -pix_fmt rgb24 -".split()
        pixels = subprocess.run([find_ffmpeg(), "-v", "error", "-i", film, *one], capture_output=True)
    image = np.frombuffer(pixels.stdout, dtype=np.uint8).reshape(HEIGHT, WIDTH, 3)
    Image.fromarray(image).save(file_of(name), quality=80, method=6)
    return file_of(name)


def section(folder: str) -> str:
    """The scenarios of one folder: what each is about, its picture, and how to run it; empty for none."""
    parts = [f"## {SECTIONS[folder]}"]
    for name in shown():
        if name.rpartition("/")[0] == folder and file_of(name).exists():
            scenario = escort_mj.load_scenario(name)
            path = file_of(name).relative_to(DOCS).as_posix()
            parts.append(f"### {name}")
            parts.append(f"![Frame of the video of {name}]({path})")
            parts.append(f"{with_links(scenario.description.strip())}\n`escort-mj run {name}`")
    return "\n\n".join(parts) if len(parts) > 1 else ""


if __name__ == "__main__":
    main()
