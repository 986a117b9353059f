"""Koiter's bending of an incompressible thin shell (Liu et al. 2007 give G h only; model of thin shells, nu = 1/2).

    W_b = B/2 [(1 - nu) tr(rho^2) + nu (tr rho)^2]     per unit reference area
        = B/2 (rho_11^2 + rho_22^2 + rho_11 rho_22 + rho_12^2),   B = K h^2/3                          (2)

rho = b - b_0 is the change of the second fundamental form in an orthonormal frame of the reference surface.
Any discrete b that is a unit normal times linear second differences, b = n . h, has the variation
n . (dh - Gamma dg) with g the tangents and Gamma the components of h along them: all bending forces are
normal to the surface.
"""
from vesdyn._jit import njit


def bending_stiffness(shear_modulus, thickness):
    """Bending stiffness B [kT] of in-plane shear modulus K [kT/a0^2] and thickness h [a0]."""
    return shear_modulus * thickness**2 / 3.0


@njit
def bending_energy(B, rho_11, rho_22, rho_12):
    """Bending energy W_b [kT/a0^2] per unit reference area, equation (2)."""
    return 0.5 * B * (rho_11 * rho_11 + rho_22 * rho_22 + rho_11 * rho_22 + rho_12 * rho_12)


@njit
def bending_moments(B, rho_11, rho_22, rho_12):
    """dW_b/drho [kT/a0]: m_11, m_22 and twice m_12."""
    return B * (rho_11 + 0.5 * rho_22), B * (rho_22 + 0.5 * rho_11), B * rho_12
