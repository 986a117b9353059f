"""What bending costs: triangle updates per second of the relaxation, and iterations a step.

Everything in the loop is counted. The state is that of the typical case after a short run, the balance that of its
next step; the thicknesses take turns, so that each repeat compares them under the same conditions. Medians of
repeats; compiled beforehand; one thread.
"""

import time

import looks
import numpy as np
from looks import DARK, GREEN, LIGHT, RED

from vesdyn.adhesion import ligand_density
from vesdyn.balance import Balance, Limits
from vesdyn.relaxation import begin, relax, set_fictitious_mass
from vesdyn.spreading import Spreading
from vesdyn.stepping import march

VERTICES = (2_500, 10_000, 20_000)
ITERATIONS = 300
REPEATS = 9
END, STEP = 0.02, 0.002
LOOKS = {0.0: (LIGHT, "o"), 0.005: (GREEN, "^"), 0.01: (DARK, "s"), 0.02: (RED, "D")}


def front_edge(vertices):
    """Front edge [a0] of a mesh of about so many vertices, far edges three times as long."""
    return float(f"{np.sqrt(1.95 / vertices):.2g}")


def sample(study, h, vertices, end):
    """A typical case of thickness ``h`` on about so many ``vertices``: scene, state at ``end``, iterations a step."""
    edge = front_edge(vertices)
    changes = {"model": "surface", "mesh.front_edge": edge, "mesh.far_edge": 3 * edge, "time.step": STEP,
               "time.end": end, "membrane.thickness": h, "output.frames": []}  # fmt: skip
    sim = Spreading(study.planned("typical", changes)[0])
    states = list(march(sim))
    return sim, states[-1], float(np.mean([state.iterations for state in states]))


def seconds(sim, state, iterations):
    """CPU time [s] of an iteration, of one thread: what else the machine does is not counted."""
    ligands = ligand_density(sim.case.ligands, state.x)
    balance = Balance(sim.body, sim.adhesion, sim.case.drag / STEP, sim.volume_0, state.number, ligands, state.x)
    set_fictitious_mass(balance, state.x, state.pressure, sim.scratch)
    x, progress = state.x.copy(), begin(state.pressure, sim.scratch)
    began = time.process_time()
    progress = relax(balance, Limits(0.0, iterations), x, progress, False, iterations, sim.scratch)
    return (time.process_time() - began) / progress.iterations


def measure(study, vertices=VERTICES, iterations=ITERATIONS, repeats=REPEATS, end=END, thicknesses=tuple(LOOKS)):
    """Rows of vertices, thickness, rates [10^6/s] (median, lowest, highest), cost, iterations a step, ratio."""
    study.compile_kernels("surface")
    rows = []
    for n in vertices:
        samples = [sample(study, h, n, end) for h in thicknesses]
        spent = np.array([[seconds(sim, state, iterations) for sim, state, _ in samples] for _ in range(repeats)])
        for k, (h, (sim, state, effort)) in enumerate(zip(thicknesses, samples)):
            rate = len(sim.body.elements) / spent[:, k] / 1e6
            cost = float(np.median(spent[:, k] / spent[:, 0]))
            speeds = map(float, (np.median(rate), rate.min(), rate.max()))
            rows.append((len(state.x), h, *speeds, cost, effort, effort / samples[0][2]))
    return rows


def draw(measured, out=looks.OUT):
    looks.table(
        f"relaxation, compared to h = {measured[0][1]:g}; coupling steps of {STEP:g}",
        ["vertices", "h", "10^6 triangles/s", "lowest", "highest", "cost", "iterations a step", "ratio"],
        measured,
    )
    sizes = sorted({n for n, *_ in measured})

    def fill(speed, effort):
        for h in sorted({h for _, h, *_ in measured}):
            color, marker = LOOKS[h]
            _, _, middle, low, high, _, efforts, _ = np.array([row for row in measured if row[1] == h]).T
            look = {"color": color, "marker": marker, "label": f"{h:g}"}
            speed.errorbar(sizes, middle, [middle - low, high - middle], capsize=3, **look)
            effort.plot(sizes, efforts, linestyle="--", **look)
        speed.set(xlabel="vertices", ylabel="triangle updates per second [$10^6$/s]", ylim=(0, None))
        effort.set(xlabel="vertices", ylabel=f"iterations per coupling step of {STEP:g}", ylim=(0, None))
        for ax in (speed, effort):
            ax.set_xticks(sizes, [f"{n:,}" for n in sizes])
            ax.set_xlim(0, 1.1 * sizes[-1])
            ax.legend(title="thickness $h$ [$a_0$]", title_fontsize=7)

    looks.panels(fill, "speed", out, size=(6.2, 2.9))


if __name__ == "__main__":
    looks.command_line(measure, draw, every=looks.INDEPENDENT)
