"""What the drag changes: bound receptors are immobile, so that the final state depends on the way to it.

(a) Final binding area of the typical case against the drag, at two mobilities: a path, not an equilibrium.
(b) Front of the soft case at t = 0.140, against the r = 0.416 that Fig. 9a prints, and where the drag would lie if it were
ABAQUS's automatic stabilisation: viscous forces c M* v, M* the mass matrix of unit density, c chosen so that they
dissipate 2e-4 of the strain energy of the first increment of the step,

    c sum A0 |u|^2 / dt = 2e-4 dE     with u the displacement and dE the strain energy of that increment,

u and dE from the step itself: without drag, dt = 0.004 long, receptors where they are. Chosen anew in each step, c takes
2e-4 of the energy in each: the way is that without drag.
"""

import looks
import numpy as np
from looks import DARK, RED

from vesdyn.body import elastic_energy
from vesdyn.diagnostics import Moment
from vesdyn.spreading import Spreading
from vesdyn.study import ON_MERIDIAN, value_at

DRAGS = 1e-4, 1e-3, 0.01, 0.03, 0.07, 0.2, 1.0, 20.0, 200.0
MOBILITIES = 2.1875, 13.0  # extremes in Fig. 2; a legend
FRACTION = 2e-4  # ABAQUS's default
FIRST_STEP = 0.004  # the paper's, as its printed times tell [a0^2/D]
FIRST, PRINTED, READ = 0.14, 0.416, 0.003  # Fig. 9a
END = 2000.0
ACCURACY = 0.02
MERIDIAN = {"model": "axisymmetric", "mesh.front_edge": 0.0075, "mesh.far_edge": 0.045}


def measure(study, drags=DRAGS, mobilities=MOBILITIES, end=END):
    """By mobility: final areas (n_drags,) and fronts r(0.140) (n_drags,); by case: what stabilisation comes to."""
    found = {}
    for mobility in mobilities:
        changes = [
            {"drag": drag, "receptors.mobility": mobility, "accuracy": ACCURACY, "time.end": end, "output.frames": []}
            for drag in drags
        ]
        soft = [{**ON_MERIDIAN, **change, "time.end": min(end, 2 * FIRST)} for change in changes]
        study.prepare([("typical-auto", c) for c in changes] + [("fig9-base", c) for c in soft])
        areas = [float(study.history("typical-auto", c)["binding_area"][-1]) for c in changes]
        fronts = [float(value_at(study.history("fig9-base", c), "contact_radius", FIRST)) for c in soft]
        found[mobility] = np.array(areas), np.array(fronts)
    stabilised = {name: stabilisation(study, name) for name in ("typical-auto", "fig9-base")}
    return {"drags": np.array(drags), "found": found, "stabilised": stabilised}


def stabilisation(study, name):
    """The drag [kT D^-1 a0^-2] that ABAQUS's automatic stabilisation comes to, and the front [a0] after its step."""
    changes = {**MERIDIAN, "drag": 0.0, "receptors.frozen": True, "accuracy": ACCURACY, "output.frames": []}
    sim = Spreading(study.planned(name, changes)[0])
    state = sim.advance(sim.start(), FIRST_STEP)
    energy = elastic_energy(sim.body, state.x) - sim.elastic_energy_0
    moved = sim.body.reference_area.sum() * sim.distance(state.x, sim.x_start) ** 2
    return float(FRACTION * energy * FIRST_STEP / moved), float(Moment(sim, state)["contact_radius"])


def draw(measured, out=looks.OUT):
    drags = measured["drags"]
    for mobility, (areas, fronts) in measured["found"].items():
        looks.table(f"mobility {mobility:g}", ["drag", "final A, typical", "r(0.140), soft"],
                    [(float(d), float(a), float(r)) for d, a, r in zip(drags, areas, fronts)])  # fmt: skip
    looks.table("automatic stabilisation", ["case", "drag", "r after the first step"],
                [(name, *map(float, values)) for name, values in measured["stabilised"].items()])  # fmt: skip

    def fill(area, front):
        for (mobility, (areas, fronts)), color, marker in zip(measured["found"].items(), (DARK, RED), "os"):
            label = f"{looks.SYMBOLS['receptors.mobility']} = {mobility:g}"
            area.semilogx(drags, areas, marker=marker, color=color, label=label)
            front.semilogx(drags, fronts, marker=marker, color=color, label=label)
        area.set(xlabel=r"drag $\eta$ [$kT D^{-1} a_0^{-2}$]", ylabel="final area $A$ [$a_0^2$]", ylim=(0, None))
        front.axhspan(PRINTED - READ, PRINTED + READ, color="0.8", linewidth=0, label="printed in Fig. 9a")
        drag, radius = measured["stabilised"]["fig9-base"]
        front.plot(drag, radius, "k*", markersize=8, label="automatic stabilisation, first step")
        front.set(xlabel=r"drag $\eta$ [$kT D^{-1} a_0^{-2}$]", ylabel="front $r(0.140)$ [$a_0$]", ylim=(0, None))
        area.legend(loc="lower left")
        front.legend(loc="lower left")

    looks.panels(fill, "drag", out, size=(7.2, 2.8))


if __name__ == "__main__":
    looks.command_line(measure, draw)
