"""Triangle updates per second of the relaxation, everything in its loop counted, and iterations a step: what bending costs.

The state is that of the typical case after a short run, the balance that of its next step; the thicknesses take turns,
so that each repeat compares them under the same conditions. Medians of repeats; compiled beforehand; one thread.
"""
import time

import numpy as np
import study
from study import DARK, GREEN, LIGHT, RED

from vesdyn import relaxation
from vesdyn.spreading import Spreading
from vesdyn.stepping import step

VERTICES = (2_500, 10_000, 20_000)
ITERATIONS = 300
REPEATS = 9
END, STEP = 0.02, 0.002
LOOKS = {0.0: (LIGHT, "o"), 0.005: (GREEN, "^"), 0.01: (DARK, "s"), 0.02: (RED, "D")}


def front_edge(vertices):
    """Front edge [a0] of a mesh of about so many vertices, far edges three times as long."""
    return float(f"{np.sqrt(1.95 / vertices):.2g}")


class Sample:
    """A typical case of thickness ``h`` after a short run on about so many ``vertices``."""

    def __init__(self, h, vertices, end):
        edge = front_edge(vertices)
        changes = {"model": "surface", "mesh.front_edge": edge, "mesh.far_edge": 3 * edge, "time.step": STEP,
                   "time.end": end, "membrane.thickness": h}  # fmt: skip
        self.sim, spent = Spreading(study.case_of("typical", changes)[0]), []
        while self.sim.time < end:
            step(self.sim, end)
            spent.append(self.sim.iterations)
        self.iterations_a_step = float(np.mean(spent))

    def seconds(self, iterations):
        """CPU time [s] of an iteration, of one thread: what else the machine does is not counted."""
        sim = self.sim
        balance = relaxation.Balance(sim.body, sim.adhesion, sim.case.drag / STEP, sim.volume_0, sim.number, sim.x)
        relaxation.set_fictitious_mass(balance, sim.x, sim.pressure, sim.work)
        x = sim.x.copy()
        began = time.process_time()
        outcome = relaxation.relax(balance, relaxation.Controls(0.0, iterations, False), x, sim.pressure, sim.work)
        return (time.process_time() - began) / outcome.iterations


def main(out=study.OUT, vertices=VERTICES, iterations=ITERATIONS, repeats=REPEATS, end=END, looks=LOOKS):
    study.compile_kernels("surface")
    rows, rates, efforts, sizes = [], {h: [] for h in looks}, {h: [] for h in looks}, []
    for n in vertices:
        samples = {h: Sample(h, n, end) for h in looks}
        spent = np.array([[sample.seconds(iterations) for sample in samples.values()] for _ in range(repeats)])
        triangles = len(samples[0.0].sim.body.elements)
        sizes.append(len(samples[0.0].sim.x))
        for k, (h, sample) in enumerate(samples.items()):
            rate = triangles / spent[:, k] / 1e6
            rates[h].append((np.median(rate), rate.min(), rate.max()))
            efforts[h].append(sample.iterations_a_step)
            more = sample.iterations_a_step / samples[0.0].iterations_a_step
            rows.append((sizes[-1], h, *map(float, rates[h][-1]), float(np.median(spent[:, k] / spent[:, 0])), efforts[h][-1], more))
    study.table(
        f"relaxation, {iterations} iterations, {repeats} repeats; steps of {STEP:g} to t = {end:g}",
        ["vertices", "h", "10^6 triangles/s", "lowest", "highest", "cost / h = 0", "iterations a step", "/ h = 0"],
        rows,
    )

    def draw(speed, effort):
        for h, (color, marker) in looks.items():
            middle, low, high = np.array(rates[h]).T
            look = {"color": color, "marker": marker, "label": f"{h:g}"}
            speed.errorbar(sizes, middle, [middle - low, high - middle], capsize=3, **look)
            effort.plot(sizes, efforts[h], linestyle="--", **look)
        speed.set(xlabel="vertices", ylabel="triangle updates per second [$10^6$/s]", ylim=(0, None))
        effort.set(xlabel="vertices", ylabel=f"iterations per coupling step of {STEP:g}", ylim=(0, None))
        for ax in (speed, effort):
            ax.set_xticks(sizes, [f"{n:,}" for n in sizes])
            ax.set_xlim(0, 1.1 * sizes[-1])
            ax.legend(title="thickness $h$ [$a_0$]", title_fontsize=7)

    study.panels(draw, "speed", out, size=(6.2, 2.9))


if __name__ == "__main__":
    main(study.command_line())
