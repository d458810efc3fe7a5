"""The controller for robots that no simulator of ours moves, such as real ones; imports no simulator."""
