"""Figures of studies, comparisons and tuning."""
