"""The numbers that sum up a run, a file for each quantity: any file here that defines metrics is found.

Each is a function of a trace, or of a window of one. Signals that hold the worst since the previous sample
look back no further than the window, see `record.window`; running totals are differenced over it, so they
count every physics step in it; means weigh samples by the time around them, so that more samples at one place
change nothing. Robots that are lost count no longer, but for contacts, distances and clearances: there they
are what the others must not touch.
"""

from escort_mj.metrics.metric import Metric, metrics_in

METRICS: tuple[Metric, ...] = metrics_in(__name__, __path__)
METRIC_NAMES = tuple(metric.name for metric in METRICS)
