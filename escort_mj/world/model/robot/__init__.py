"""Robots from MJCF of others: their files, their bodies in a flat tree, and what their actuators do."""
