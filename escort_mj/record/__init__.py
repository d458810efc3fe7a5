"""What a run leaves behind: samples, trace, metrics, run folder."""
