"""Thrust and torques to the four rotors of a plus-frame quadcopter and back (paper eq. 20)."""

Wrench = tuple[float, float, float, float]
"""Total thrust (N, along body -z), then torques in roll, pitch and yaw (N m, FRD)."""

RotorThrusts = tuple[float, float, float, float]
"""Thrusts of rotors 1 front, 2 right, 3 rear and 4 left, N."""


def wrench_of(f: RotorThrusts, arm: float, torque_per_thrust: float) -> Wrench:
    """Return what four rotor thrusts do to the body: the matrix of (20).

    Its first row is printed as -1; it is +1 here, with thrust positive as in (10) and (17).
    """
    f1, f2, f3, f4 = f
    return (
        f1 + f2 + f3 + f4,
        arm * (f4 - f2),
        arm * (f1 - f3),
        torque_per_thrust * (f2 - f1 + f4 - f3),
    )


def clip(wrench: Wrench, arm: float, torque_per_thrust: float, max_thrust: float) -> RotorThrusts:
    """Return the plain inverse of (20), thrust limited first, then each rotor clipped by itself.

    This is what the paper's text amounts to; clipping changes thrust and torques all at once.
    """
    thrust, roll, pitch, yaw = wrench
    a, b, c = pitch / (2 * arm), roll / (2 * arm), yaw / (4 * torque_per_thrust)
    base = min(thrust / 4, max_thrust)
    f1, f2, f3, f4 = base - c + a, base + c - b, base - c - a, base + c + b
    return (
        min(max(f1, 0.0), max_thrust),
        min(max(f2, 0.0), max_thrust),
        min(max(f3, 0.0), max_thrust),
        min(max(f4, 0.0), max_thrust),
    )


def allocate(
    wrench: Wrench, arm: float, torque_per_thrust: float, max_thrust: float
) -> RotorThrusts:
    """Return rotor thrusts in 0..`max_thrust` for `wrench`: the inverse of (20).

    When not all of it can be had, roll and pitch come first (an upset vehicle cannot use its
    thrust), then thrust, then yaw. Roll and pitch that cannot be had are scaled down together,
    so their direction stays.
    """
    thrust, roll, pitch, yaw = wrench
    a = pitch / (2 * arm)
    b = roll / (2 * arm)
    size_a = a if a > 0 else -a
    size_b = b if b > 0 else -b
    tilt = size_a if size_a > size_b else size_b
    half = max_thrust / 2
    if tilt > half:
        scale = half / tilt
        a, b, size_a, size_b, tilt = a * scale, b * scale, size_a * scale, size_b * scale, half

    base = thrust / 4
    if base < tilt:
        base = tilt
    elif base > max_thrust - tilt:
        base = max_thrust - tilt

    c = yaw / (4 * torque_per_thrust)
    down, up = base, max_thrust - base  # room that each rotor has left without yaw
    low = size_b - down if size_b - down > size_a - up else size_a - up
    high = down - size_a if down - size_a < up - size_b else up - size_b
    if c < low:
        c = low
    elif c > high:
        c = high
    f1, f2, f3, f4 = base - c + a, base + c - b, base - c - a, base + c + b
    return (  # rounding can leave a stopped rotor a hair below zero
        f1 if f1 > 0 else 0.0,
        f2 if f2 > 0 else 0.0,
        f3 if f3 > 0 else 0.0,
        f4 if f4 > 0 else 0.0,
    )
