"""Wrinkles of the compressed free membrane in the soft case of Fig. 9: which azimuthal mode grows fastest.

Above: growth rates of the axisymmetric state (`vesdyn.modes`) on three meshes, without bending and with two
thicknesses; the wavelength of the fastest mode against thickness. Below: a disturbance of one mode in three
dimensions (two runs, disturbed and not, and their difference) beside the growth the rates predict.
"""

import looks
import numpy as np
from looks import DARK, GREEN, RED
from scipy.integrate import cumulative_trapezoid
from scipy.interpolate import CubicSpline

from vesdyn.diagnostics import Moment
from vesdyn.koiter import bending_stiffness
from vesdyn.modes import Modes
from vesdyn.spreading import Spreading
from vesdyn.stepping import march
from vesdyn.study import fitted_order

SCENE, TIME = "fig9-base", 0.03
EDGES = (0.03, 0.02, 0.0133)
CURVES = {0.0: (RED, "o"), 0.005: (GREEN, "^"), 0.01: (DARK, "s")}
THICKNESSES = (0.003, 0.004, 0.005, 0.007, 0.01, 0.014, 0.02)
IN_SPACE = {"mode": 15, "thickness": 0.01, "edge": 0.03, "start": 0.02, "end": 0.12, "size": 1e-4}


def axisymmetric(study, thickness, edge, end):
    """A meridian of equal edges: the scene and its state at ``end``."""
    changes = {"model": "axisymmetric", "time.step": "auto", "time.end": end, "membrane.thickness": thickness,
               "mesh.front_edge": edge, "mesh.far_edge": edge, "output.frames": []}  # fmt: skip
    sim = Spreading(study.planned(SCENE, changes)[0])
    *_, state = march(sim)
    return sim, state


def sectors(edge):
    """Sectors of about ``edge`` [a0] where the compressed membrane is."""
    return 2 * round(np.pi * 0.45 / edge)


def growth(study, thickness, edge, time=TIME):
    """Modes and their growth rates [D/a0^2] at ``time``; least hoop tension [kT/a0^2] and the radius there [a0]."""
    sim, state = axisymmetric(study, thickness, edge, time)
    modes = np.arange(2, sectors(edge) // 2 + 1)
    rates = Modes(sim, state, sectors(edge)).growth_rates(modes)
    hoop, gap = Moment(sim, state).tensions[:, 1], state.x[sim.body.elements, 1].min(axis=1)
    slackest = np.argmin(np.where(gap > sim.case.adhesion.cutoff, hoop, np.inf))
    return modes, rates, hoop[slackest], state.x[slackest, 0]


def fastest(modes, rates):
    """The mode of the largest rate, by a parabola through the three highest points."""
    k = int(np.clip(np.argmax(rates), 1, len(modes) - 2))
    left, top, right = rates[k - 1 : k + 2]
    bend = left - 2.0 * top + right
    return modes[k] + 0.5 * (left - right) / bend if bend < 0.0 else float(modes[k])


def predicted_wavelength(shear_modulus, thickness, tension):
    """Wavelength 2 pi (2 B / |T_2|)^(1/2) [a0] of a plane sheet under compression."""
    return 2.0 * np.pi * np.sqrt(2.0 * bending_stiffness(shear_modulus, thickness) / -tension)


def disturbed(study, mode, thickness, edge, start, end, size):
    """Amplitude [a0] of ``mode`` against time in three dimensions: rows of (t, amplitude); kept once computed."""
    changes = {"mode": mode, "h": thickness, "edge": edge, "start": start, "end": end, "size": size}
    store = study.file("wrinkle", changes, "csv")
    if not store.exists():
        times = [float(f"{t:.6g}") for t in np.arange(start, end + 1e-9, 0.005)]
        runs = [_in_space(study, mode, thickness, edge, times, disturbance) for disturbance in (0.0, size)]
        np.savetxt(store, [(t, _amplitude(x, y, mode)) for t, x, y in zip(times, *runs)], delimiter=",")
    return np.loadtxt(store, delimiter=",")


def _in_space(study, mode, thickness, edge, times, size):
    """Shapes at ``times`` of a surface whose free membrane is displaced by ``size`` cos(mode phi) at the first."""
    changes = {"model": "surface", "mesh.layout": "rings", "mesh.front_edge": edge, "mesh.far_edge": edge,
               "time.step": 0.0005, "time.end": times[-1], "output.frames": times[:-1], "solver.tolerance": 2e-5,
               "membrane.thickness": thickness}  # fmt: skip
    sim = Spreading(study.planned(SCENE, changes)[0])
    begun = _displaced(sim, next(state for state in march(sim) if state.time == times[0]), mode, size)
    return [begun.x, *(state.x for state in march(sim, begun) if state.time in times)]


def _displaced(sim, state, mode, size):
    """``state`` with its free membrane displaced along the radius by ``size`` cos(mode phi) [a0]."""
    x, y, z = state.x.T
    wave = size * np.cos(mode * np.arctan2(y, x)) * np.exp(-(((z - 0.22) / 0.1) ** 2)) * (z > 0.03)
    push = wave[:, None] * np.stack([x, y, 0.0 * z], axis=1) / np.maximum(np.hypot(x, y), 1e-9)[:, None]
    area, volume = sim.measure(state.x + push)
    return state._replace(x=state.x + push, x_before=state.x_before + push, area=area, volume=volume)


def _amplitude(control, other, mode):
    """Amplitude [a0] of ``mode`` in the radial difference of two shapes, over the free membrane."""
    x, y, z = control.T
    free = (z > 0.05) & (z < 0.5)
    radial = np.sum((other - control)[:, :2] * control[:, :2], axis=1)[free] / np.hypot(x, y)[free]
    return 2.0 * abs(np.mean(radial * np.exp(1j * mode * np.arctan2(y, x)[free])))


def predicted_amplitude(study, rows, mode, thickness, edge):
    """exp of the integral of the mode's rate from the second row on, where only the fastest shape is left."""
    times = rows[1:, 0]
    rates = []
    for t in times[::2]:
        sim, state = axisymmetric(study, thickness, edge, t)
        rates.append(Modes(sim, state, sectors(edge)).growth_rates([mode])[0])
    rate = CubicSpline(times[::2], rates)(times)
    return times, rows[1, 1] * np.exp(cumulative_trapezoid(rate, times, initial=0.0))


def measure(study, edges=EDGES, thicknesses=tuple(CURVES), scaled=THICKNESSES, in_space=IN_SPACE):
    """Growth by thickness and edge; wavelengths by thickness (n, 4); amplitudes in space and as predicted."""
    K = study.case(SCENE).membrane.shear_modulus
    scaling = []
    for h in scaled:
        modes, rate, tension, radius = growth(study, h, edges[-1])
        scaling.append(
            (h, 2 * np.pi * radius / fastest(modes, rate), predicted_wavelength(K, h, tension), rate.max())
        )
    rows = disturbed(study, **in_space)
    return {
        "shear modulus": K,
        "growth": {(h, e): growth(study, h, e) for h in thicknesses for e in edges},
        "wavelengths": np.array(scaling),
        "exponent": fitted_order(*np.array(scaling).T[:2]) if len(scaling) > 1 else (np.nan, np.nan),
        "in space": rows,
        "mode": in_space["mode"],
        "thickness": in_space["thickness"],
        "predicted": predicted_amplitude(study, rows, in_space["mode"], in_space["thickness"], in_space["edge"]),
    }


def draw(measured, out=looks.OUT):
    K, rates, scaling, rows = (measured[key] for key in ("shear modulus", "growth", "wavelengths", "in space"))
    times, expected = measured["predicted"]
    edges = list(dict.fromkeys(e for _, e in rates))
    table = []
    for (h, e), (modes, rate, tension, radius) in rates.items():
        m = fastest(modes, rate)
        wave = predicted_wavelength(K, h, tension)
        table.append((h, e, sectors(e), m, rate.max(), tension / K, 2 * np.pi * radius / m, wave or np.nan))
    looks.table(
        f"fastest azimuthal mode at t = {TIME}",
        ["h", "edge", "sectors", "m", "rate", "T_2/K", "wavelength", "2pi(2B/T)^.5"],
        table,
    )
    looks.table("wavelength against thickness", ["h", "wavelength", "predicted", "rate"], scaling.tolist())
    exponent, error = measured["exponent"]
    print(f"observed exponent of the wavelength: {exponent:.2f} ± {error:.2f} (1 predicted)")

    def fill(spectrum, wavelength, amplitude):
        for (h, e), (modes, rate, *_) in rates.items():
            color, _ = CURVES[h]
            line = ("-", "--", ":")[edges.index(e)]
            label = f"$h$ = {h:g}" if e == edges[-1] else None
            spectrum.semilogy(modes, np.where(rate > 0.0, rate, np.nan), color=color, linestyle=line)
            k = int(np.argmax(rate))
            spectrum.plot(modes[k], rate[k], color=color, marker=CURVES[h][1], linestyle="none", label=label)
        spectrum.set(xlabel="azimuthal mode $m$", ylabel=r"growth rate $\sigma_m$ [$D/a_0^2$]", ylim=(8, None))
        wavelength.loglog(
            scaling[:, 0], scaling[:, 1], color=DARK, marker="s", linestyle="none", label="fastest mode"
        )
        wavelength.loglog(scaling[:, 0], scaling[:, 2], color="0.4", label=r"$2\pi\,(2B/|T_2|)^{1/2}$")
        for e in edges:
            if (0.0, e) in rates:
                modes, rate, _, radius = rates[0.0, e]
                wavelength.axhline(2 * np.pi * radius / fastest(modes, rate), color=RED, linewidth=0.8,
                                   linestyle=("-", "--", ":")[edges.index(e)])  # fmt: skip
        wavelength.plot([], [], color=RED, linewidth=0.8, label="$h$ = 0, by mesh")
        wavelength.set(xlabel="thickness $h$ [$a_0$]", ylabel=r"wavelength $\lambda$ [$a_0$]")
        looks.plain(wavelength.xaxis, (0.003, 0.005, 0.01, 0.02))
        looks.plain(wavelength.yaxis, (0.05, 0.1, 0.2, 0.4))
        amplitude.semilogy(
            rows[:, 0],
            rows[:, 1],
            color=DARK,
            marker="s",
            markersize=3,
            linestyle="none",
            label="in three dimensions",
        )
        amplitude.semilogy(times, expected, color="0.4", label=r"$\exp\int\sigma_m\,dt$")
        amplitude.set(
            xticks=(0.03, 0.06, 0.09, 0.12),
            xlabel=looks.TIME,
            ylabel=f"amplitude of $m$ = {measured['mode']} [$a_0$]",
        )
        lines = ", ".join(f"{e:g} {name}" for e, name in zip(edges, ("full", "dashed", "dotted")))
        looks.legend_below(spectrum, title=f"edge: {lines}")
        looks.legend_below(wavelength)
        looks.legend_below(amplitude, title=f"$h$ = {measured['thickness']:g}")

    looks.panels(fill, "wrinkling", out, size=(7.2, 3.4), shape=(1, 3))


if __name__ == "__main__":
    looks.command_line(measure, draw, every=looks.INDEPENDENT)
