"""Incompressible neo-Hookean membrane in plane stress (Liu et al. 2007, section 2.1).

    W = K/2 (I1 + l3^2 - 3)       per unit reference area, I1 = tr C, l3 = 1/J, J^2 = det C     (1)
    T_1 = K (l1^2 - l3^2) l3      force per current length, l1 a principal stretch             (1b)

I1 and J are what every body has: on a flat triangle I1 is quadratic in the edge lengths and J is a
ratio of areas; on a conical segment they are l1^2 + l2^2 and l1 l2. The laws take the stretch of
the thickness l3 = A0/A, which costs one division an element.
"""
from vesdyn._jit import njit


@njit
def strain_energy(K, I1, l3):
    """Strain energy W [K] per unit reference area, equation (1)."""
    return 0.5 * K * (I1 + l3 * l3 - 3.0)


@njit
def strain_energy_I1(K):
    """dW/dI1 [K]."""
    return 0.5 * K


@njit
def strain_energy_J(K, l3):
    """dW/dJ at fixed I1 [K]."""
    return -K * l3 * l3 * l3


@njit
def strain_energy_JJ(K, l3):
    """d2W/dJ2 at fixed I1 [K]."""
    return 3.0 * K * (l3 * l3) * (l3 * l3)


@njit
def principal_tension(K, stretch, l3):
    """Tension [K] along the direction of principal ``stretch``, per current length, equation (1b)."""
    return K * (stretch * stretch - l3 * l3) * l3
