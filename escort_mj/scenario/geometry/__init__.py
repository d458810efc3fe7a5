"""Where everything is: shapes, obstacles, robots at their start, trajectories."""
