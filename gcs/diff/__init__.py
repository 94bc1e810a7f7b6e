"""Where two runs part: the first message, field, vehicle and time."""
