"""The MuJoCo model of a mission: MJCF composed from parts, compiled, and wired to the controller."""
