"""Coordination laws, selected by name; adding one is one file and one line here."""
