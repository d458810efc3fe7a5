"""Sweeps: definition, design, results and their statistics."""
