"""Files beside a scenario: waypoints, robots, networks, and where they may lie."""
