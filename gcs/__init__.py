"""The ground: stations, coordination, launcher, recording, report and command line."""
