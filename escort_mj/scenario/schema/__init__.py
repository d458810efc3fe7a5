"""The tables of a scenario: every key, its type, default and bounds."""
