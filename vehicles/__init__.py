"""One robot: dynamics, controllers, autopilot, telemetry and the process that hosts them."""
