"""What became of a run: the truth read and judged, tables, figures, pages."""
