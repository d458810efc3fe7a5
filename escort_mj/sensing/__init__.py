"""What robots know: sensors, and what they make of the truth."""
