"""What users may set: names, types, limits, values, and the files that keep them."""
