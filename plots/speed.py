"""Triangle updates per second of the relaxation, everything in its loop counted, and iterations a step.

The state is that of the typical case after a short run, the balance that of its next step. Medians of repeats;
compiled beforehand; one thread.
"""
import time

import numpy as np
import study
from study import DARK, RED

from vesdyn import relaxation
from vesdyn.spreading import Spreading
from vesdyn.stepping import step

VERTICES = (2_500, 10_000, 20_000)
ITERATIONS = 300
REPEATS = 9
END, STEP = 0.02, 0.002


def front_edge(vertices):
    """Front edge [a0] of a mesh of about so many vertices, far edges three times as long."""
    return float(f"{np.sqrt(1.95 / vertices):.2g}")


def measure(vertices, iterations, repeats, end):
    """Vertices, triangles, updates per second (n_repeats,), and mean iterations a step of the short run."""
    edge = front_edge(vertices)
    changes = {"model": "surface", "mesh.front_edge": edge, "mesh.far_edge": 3 * edge, "time.step": STEP, "time.end": end}
    sim = Spreading(study.case_of("typical", changes)[0])
    spent = []
    while sim.time < end:
        step(sim, end)
        spent.append(sim.iterations)
    balance = relaxation.Balance(sim.body, sim.adhesion, sim.case.drag / STEP, sim.volume_0, sim.number, sim.x)
    controls = relaxation.Controls(0.0, iterations, False)
    relaxation.set_fictitious_mass(balance, sim.x, sim.pressure, sim.work)
    rates = []
    for _ in range(repeats):
        x = sim.x.copy()
        began = time.process_time()  # one thread: what else the machine does is not counted
        outcome = relaxation.relax(balance, controls, x, sim.pressure, sim.work)
        rates.append(outcome.iterations * len(sim.body.elements) / (time.process_time() - began))
    return len(sim.x), len(sim.body.elements), np.array(rates), np.mean(spent)


def main(out=study.OUT, vertices=VERTICES, iterations=ITERATIONS, repeats=REPEATS, end=END):
    study.compile_kernels("surface")
    measured = [measure(n, iterations, repeats, end) for n in vertices]
    study.table(
        f"relaxation, {iterations} iterations, {repeats} repeats; steps of {STEP:g} to t = {end:g}",
        ["vertices", "triangles", "10^6 triangles/s", "lowest", "highest", "iterations a step"],
        [(n, m, *(float(f(r)) / 1e6 for f in (np.median, np.min, np.max)), float(i)) for n, m, r, i in measured],
    )
    sizes = np.array([n for n, *_ in measured])
    rates = np.array([rate / 1e6 for _, _, rate, _ in measured])

    def draw(speed, effort):
        middle = np.median(rates, axis=1)
        speed.errorbar(sizes, middle, [middle - rates.min(axis=1), rates.max(axis=1) - middle], color=DARK, marker="o", capsize=3)
        speed.set(xlabel="vertices", ylabel="triangle updates per second [$10^6$/s]", ylim=(0, 1.15 * rates.max()))
        effort.plot(sizes, [i for *_, i in measured], color=RED, marker="s", linestyle="--")
        effort.set(xlabel="vertices", ylabel=f"iterations per coupling step of {STEP:g}")
        effort.set(ylim=(0.0, 1.15 * max(i for *_, i in measured)))
        for ax in (speed, effort):
            ax.set_xticks(sizes, [f"{n:,}" for n in sizes])
            ax.set_xlim(0, 1.1 * sizes[-1])

    study.panels(draw, "speed", out, size=(6.2, 2.7))


if __name__ == "__main__":
    main(study.command_line())
