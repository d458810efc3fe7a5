"""A run in MuJoCo's own viewer, on a machine with a display.

Run it: escort-mj export renders/main main.npz; python examples/mujoco_viewer.py main.npz
"""

import sys
import time

import mujoco
import mujoco.viewer
import numpy as np

run = np.load(sys.argv[1])
model = mujoco.MjModel.from_xml_string(str(run["model"]))
data = mujoco.MjData(model)
with mujoco.viewer.launch_passive(model, data) as window:
    for sample in range(len(run["time"])):
        data.qpos = run["qpos"][sample]
        data.mocap_pos, data.mocap_quat = run["mocap_pos"][sample], run["mocap_quat"][sample]
        mujoco.mj_forward(model, data)
        window.sync()
        time.sleep(run["time"][1] - run["time"][0])
