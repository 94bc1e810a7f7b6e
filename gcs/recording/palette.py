"""The colours of the world that are not a robot's own: told apart by colour-blind readers too.

Each of them also differs from the others in lightness, thickness or form.
"""

Rgb = tuple[int, int, int]
Rgba = tuple[int, int, int, int]

GROUND: Rgb = (44, 50, 59)  # behind everything
GRID: Rgba = (255, 255, 255, 26)
VELOCITY: Rgba = (255, 255, 255, 255)
FEED_FORWARD: Rgba = (240, 228, 66, 255)
PLAN: Rgba = (150, 160, 172, 255)
FENCE: Rgba = (86, 180, 233, 255)
STALE: Rgba = (230, 159, 0, 255)  # a belief that is too old to count
COLLISION: Rgba = (255, 64, 180, 255)
CLEARANCE: tuple[Rgba, Rgba, Rgba] = (  # calm, near, contact
    (150, 160, 172, 160),
    (240, 160, 0, 255),
    COLLISION,
)
CLEARANCE_POINTS = (1.2, 2.5, 5.0)  # thickness of a circle in points of the screen


def tint(colour: Rgb, white: float = 0.67) -> Rgb:
    """Return a colour mixed with white: pale enough that text in it is read on dark ground."""
    red, green, blue = (round(part + white * (255 - part)) for part in colour)
    return red, green, blue
