"""Wrinkles of the compressed free membrane in the soft case of Fig. 9: which azimuthal mode grows fastest.

Above: growth rates of the axisymmetric state (`vesdyn.modes`) on three meshes, without bending and with two
thicknesses; the wavelength of the fastest mode against thickness. Below: a disturbance of one mode in three
dimensions (two runs, disturbed and not, and their difference) beside the growth the rates predict.
"""
import csv

import numpy as np
import study
from scipy.integrate import cumulative_trapezoid
from scipy.interpolate import CubicSpline
from study import DARK, GREEN, RED

from vesdyn.koiter import bending_stiffness
from vesdyn.modes import Modes
from vesdyn.spreading import Spreading
from vesdyn.stepping import step

SCENE, TIME = "fig9-base", 0.03
EDGES = (0.03, 0.02, 0.0133)
CURVES = {0.0: (RED, "o"), 0.005: (GREEN, "^"), 0.01: (DARK, "s")}
THICKNESSES = (0.003, 0.004, 0.005, 0.007, 0.01, 0.014, 0.02)
IN_SPACE = {"mode": 15, "thickness": 0.01, "edge": 0.03, "start": 0.02, "end": 0.12, "size": 1e-4}


def axisymmetric(thickness, edge, end):
    """A meridian of equal edges carried to ``end``, and the shape it started from."""
    changes = {"model": "axisymmetric", "time.step": "auto", "time.end": end, "membrane.thickness": thickness,
               "mesh.front_edge": edge, "mesh.far_edge": edge, "output.frames": []}  # fmt: skip
    sim = Spreading(study.case_of(SCENE, changes)[0])
    rest = sim.x.copy()
    while sim.time < end:
        step(sim, end)
    return sim, rest


def sectors(edge):
    """Sectors of about ``edge`` [a0] where the compressed membrane is."""
    return 2 * round(np.pi * 0.45 / edge)


def growth(thickness, edge, time=TIME):
    """Modes and their growth rates [D/a0^2] at ``time``; hoop tension [kT/a0^2] where it is least, radius there [a0]."""
    sim, rest = axisymmetric(thickness, edge, time)
    modes = np.arange(2, sectors(edge) // 2 + 1)
    rates = Modes(sim, rest, sectors(edge)).growth_rates(modes)
    hoop, gap = sim.tensions[:, 1], sim.x[sim.body.elements, 1].min(axis=1)
    slackest = np.argmin(np.where(gap > sim.adhesion.cutoff, hoop, np.inf))
    return modes, rates, hoop[slackest], sim.x[slackest, 0]


def fastest(modes, rates):
    """The mode of the largest rate, by a parabola through the three highest points."""
    k = int(np.clip(np.argmax(rates), 1, len(modes) - 2))
    left, top, right = rates[k - 1 : k + 2]
    bend = left - 2.0 * top + right
    return modes[k] + 0.5 * (left - right) / bend if bend < 0.0 else float(modes[k])


def predicted_wavelength(shear_modulus, thickness, tension):
    """Wavelength 2 pi (2 B / |T_2|)^(1/2) [a0] of a plane sheet under compression."""
    return 2.0 * np.pi * np.sqrt(2.0 * bending_stiffness(shear_modulus, thickness) / -tension)


def disturbed(mode, thickness, edge, start, end, size):
    """Amplitude [a0] of ``mode`` against time in three dimensions: rows of (t, amplitude); kept once computed."""
    changes = {"mode": mode, "h": thickness, "edge": edge, "start": start, "end": end, "size": size}
    file = study.note_file("wrinkle", changes, "csv")
    if not file.exists():
        times = np.arange(start, end + 1e-9, 0.005)
        runs = [_in_space(mode, thickness, edge, times, disturbance) for disturbance in (0.0, size)]
        rows = [(t, _amplitude(x, y, mode)) for t, x, y in zip(times, *runs)]
        with open(file, "w", newline="") as handle:
            csv.writer(handle).writerows(rows)
    return np.loadtxt(file, delimiter=",")


def _in_space(mode, thickness, edge, times, size):
    """Shapes at ``times`` of a surface whose free membrane is displaced by ``size`` cos(mode phi) at the first."""
    changes = {"model": "surface", "mesh.layout": "rings", "mesh.front_edge": edge, "mesh.far_edge": edge,
               "time.step": 0.0005, "time.end": times[-1], "output.frames": [], "solver.tolerance": 2e-5,
               "membrane.thickness": thickness}  # fmt: skip
    sim, shapes = Spreading(study.case_of(SCENE, changes)[0]), []
    for t in times:
        while sim.time < t - 1e-12:
            step(sim, t)
        if t == times[0]:
            x, y, z = sim.x.T
            wave = size * np.cos(mode * np.arctan2(y, x)) * np.exp(-(((z - 0.22) / 0.1) ** 2)) * (z > 0.03)
            push = wave[:, None] * np.stack([x, y, 0.0 * z], axis=1) / np.maximum(np.hypot(x, y), 1e-9)[:, None]
            sim.x, sim.x_before = sim.x + push, sim.x_before + push
        shapes.append(sim.x.copy())
    return shapes


def _amplitude(control, other, mode):
    """Amplitude [a0] of ``mode`` in the radial difference of two shapes, over the free membrane."""
    x, y, z = control.T
    free = (z > 0.05) & (z < 0.5)
    radial = np.sum((other - control)[:, :2] * control[:, :2], axis=1)[free] / np.hypot(x, y)[free]
    return 2.0 * abs(np.mean(radial * np.exp(1j * mode * np.arctan2(y, x)[free])))


def predicted_amplitude(rows, mode, thickness, edge):
    """exp of the integral of the mode's rate from the second row on, where only the fastest shape is left."""
    times = rows[1:, 0]
    rates = []
    for t in times[::2]:
        sim, rest = axisymmetric(thickness, edge, t)
        rates.append(Modes(sim, rest, sectors(edge)).growth_rates([mode])[0])
    rate = CubicSpline(times[::2], rates)(times)
    return times, rows[1, 1] * np.exp(cumulative_trapezoid(rate, times, initial=0.0))


def main(out=study.OUT, edges=EDGES, curves=CURVES, thicknesses=THICKNESSES, in_space=IN_SPACE):
    rates = {(h, e): growth(h, e) for h in curves for e in edges}
    K = study.case_of(SCENE, {})[0].membrane.shear_modulus
    table = []
    for (h, e), (modes, rate, tension, radius) in rates.items():
        m = fastest(modes, rate)
        wave = predicted_wavelength(K, h, tension)
        table.append((h, e, sectors(e), m, rate.max(), tension / K, 2 * np.pi * radius / m, wave or np.nan))
    study.table(
        f"fastest azimuthal mode at t = {TIME}",
        ["h", "edge", "sectors", "m", "rate", "T_2/K", "wavelength", "2pi(2B/T)^.5"],
        table,
    )
    scaling = []
    for h in thicknesses:
        modes, rate, tension, radius = growth(h, edges[-1])
        scaling.append((h, 2 * np.pi * radius / fastest(modes, rate), predicted_wavelength(K, h, tension), rate.max()))
    scaling = np.array(scaling)
    slope = np.polyfit(np.log(scaling[:, 0]), np.log(scaling[:, 1]), 1)[0] if len(scaling) > 1 else np.nan
    study.table("wavelength against thickness", ["h", "wavelength", "predicted", "rate"], scaling.tolist())
    print(f"observed exponent of the wavelength: {slope:.2f} (1 predicted)")
    rows = disturbed(**in_space)
    times, expected = predicted_amplitude(rows, in_space["mode"], in_space["thickness"], in_space["edge"])

    def draw(spectrum, wavelength, amplitude):
        for (h, e), (modes, rate, *_) in rates.items():
            color, _ = curves[h]
            line = ("-", "--", ":")[edges.index(e)]
            label = f"$h$ = {h:g}" if e == edges[-1] else None
            spectrum.semilogy(modes, np.where(rate > 0.0, rate, np.nan), color=color, linestyle=line)
            k = int(np.argmax(rate))
            spectrum.plot(modes[k], rate[k], color=color, marker=curves[h][1], linestyle="none", label=label)
        spectrum.set(xlabel="azimuthal mode $m$", ylabel=r"growth rate $\sigma_m$ [$D/a_0^2$]", ylim=(8, None))
        wavelength.loglog(scaling[:, 0], scaling[:, 1], color=DARK, marker="s", linestyle="none", label="fastest mode")
        wavelength.loglog(scaling[:, 0], scaling[:, 2], color="0.4", label=r"$2\pi\,(2B/|T_2|)^{1/2}$")
        for e in edges:
            if (0.0, e) in rates:
                modes, rate, _, radius = rates[0.0, e]
                wavelength.axhline(2 * np.pi * radius / fastest(modes, rate), color=RED, linewidth=0.8,
                                   linestyle=("-", "--", ":")[edges.index(e)])  # fmt: skip
        wavelength.plot([], [], color=RED, linewidth=0.8, label="$h$ = 0, by mesh")
        wavelength.set(xlabel="thickness $h$ [$a_0$]", ylabel=r"wavelength $\lambda$ [$a_0$]")
        study.plain(wavelength.xaxis, (0.003, 0.005, 0.01, 0.02))
        study.plain(wavelength.yaxis, (0.05, 0.1, 0.2, 0.4))
        amplitude.semilogy(rows[:, 0], rows[:, 1], color=DARK, marker="s", markersize=3, linestyle="none", label="in three dimensions")
        amplitude.semilogy(times, expected, color="0.4", label=r"$\exp\int\sigma_m\,dt$")
        amplitude.set(xticks=(0.03, 0.06, 0.09, 0.12), xlabel="time $t$ [$a_0^2/D$]", ylabel=f"amplitude of $m$ = {in_space['mode']} [$a_0$]")
        lines = ", ".join(f"{e:g} {name}" for e, name in zip(edges, ("full", "dashed", "dotted")))
        study.legend_below(spectrum, title=f"edge: {lines}")
        study.legend_below(wavelength)
        study.legend_below(amplitude, title=f"$h$ = {in_space['thickness']:g}")

    study.panels(draw, "wrinkling", out, size=(7.2, 3.4), shape=(1, 3))


if __name__ == "__main__":
    main(study.command_line())
