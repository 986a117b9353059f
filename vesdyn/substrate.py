"""Rigid frictionless plane z = 0: gap, complementarity.

    z >= 0,   reaction >= 0,   z * reaction = 0

A node reaches the plane exactly (z = 0, never below) and stays while the load presses it down; the
plane never pulls. Both statements are kept at every iteration, not only at the end. The normal of the plane is
the last coordinate of a node, and this file alone says so outside the bodies.
"""
import numpy as np

from vesdyn._jit import njit


@njit
def normal_axis(dimension):
    """The coordinate along the normal of the plane, of ``dimension`` of them."""
    return dimension - 1


@njit
def gap_of(x, i):
    """Gap [a0] between node ``i`` of ``x`` (n_nodes, d) and the plane."""
    return x[i, normal_axis(x.shape[1])]


def gaps(x):
    """Gaps (n_nodes,) [a0] of all nodes of ``x`` (n_nodes, d), a view."""
    return x[:, normal_axis(x.shape[1])]


def in_plane(x):
    """Coordinates (n_nodes, d - 1) [a0] along the plane, a view of ``x`` (n_nodes, d)."""
    return x[:, : normal_axis(x.shape[1])]


@njit
def touches(gap):
    """True where a node at ``gap`` [a0] is on the plane."""
    return gap <= 0.0


@njit
def is_held(gap, load):
    """True where the plane carries the normal ``load`` [kT/a0] of a node at ``gap`` [a0]."""
    return touches(gap) and load <= 0.0


@njit
def land(gap, move):
    """Gap [a0] after ``move`` [a0] along the normal, and the part of the move that the plane allows."""
    if gap + move < 0.0:
        return 0.0, -gap
    return gap + move, move


def kept_landed(x, moved):
    """``moved`` (n_nodes, d) [a0] with the nodes that touch in ``x`` kept on the plane and no other below it."""
    ahead = gaps(moved)
    ahead[:] = np.where(touches(gaps(x)), 0.0, np.maximum(ahead, 0.0))
    return moved
