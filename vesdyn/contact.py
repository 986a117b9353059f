"""Rigid frictionless plane z = 0: gap, complementarity.

    z >= 0,   reaction >= 0,   z * reaction = 0

A node reaches the plane exactly (z = 0, never below) and stays while the load presses it down; the
plane never pulls. Both statements are kept at every iteration, not only at the end.
"""
from vesdyn._jit import njit


@njit
def is_held(z, load):
    """True where the plane carries the vertical ``load`` [kT/a0] of a node at height ``z`` [a0]."""
    return z <= 0.0 and load <= 0.0
