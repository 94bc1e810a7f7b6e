"""Runs that were flown: their folders read again."""
