"""What shall happen: the scenario schema, its loader, paths and the shipped missions."""
