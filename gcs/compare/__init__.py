"""Runs side by side: one table, overlaid tracks and separations, as a page and a recording."""
