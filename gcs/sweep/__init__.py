"""Sweeps: many runs of one scenario, over a grid of settings and seeds, into one table."""
