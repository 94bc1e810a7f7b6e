"""One run: its processes started, conducted and ended, and what the terminal shows meanwhile."""
