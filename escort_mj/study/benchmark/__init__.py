"""Missions on worlds that others drew, judged as they judge theirs."""
