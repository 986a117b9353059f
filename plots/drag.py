"""What the drag changes: bound receptors are immobile, so that the final state depends on the way to it.

(a) Final binding area of the typical case against the drag, at two mobilities: a path, not an equilibrium.
(b) Front of the soft case at t = 0.140, against the r = 0.416 that Fig. 9a prints, and where the drag would lie if it were
ABAQUS's automatic stabilisation: viscous forces c M* v, M* the mass matrix of unit density, c chosen so that they
dissipate 2e-4 of the strain energy of the first increment of the step,

    c sum A0 |u|^2 / dt = 2e-4 dE     with u the displacement and dE the strain energy of that increment,

u and dE from the step itself: without drag, dt = 0.004 long, receptors where they are. Chosen anew in each step, c takes
2e-4 of the energy in each: the way is that without drag. A run at the first step's drag is carried to its end.
Written to docs/drag.md, with a picture in plots/out/.
"""

import looks
import numpy as np
from looks import DARK, RED

from vesdyn.body import elastic_energy
from vesdyn.diagnostics import Moment
from vesdyn.inference_report import table
from vesdyn.spreading import Spreading
from vesdyn.study import ON_MERIDIAN, value_at

PAGE = looks.ROOT / "docs" / "drag.md"
DRAGS = 0.0, 1e-3, 0.01, 0.024, 0.07, 0.2, 1.0, 20.0, 200.0
MOBILITIES = 2.1875, 13.0  # of configs/base/extremes.yaml and paper.yaml
FRACTION = 2e-4  # ABAQUS's default
FIRST_STEP = 0.004  # the paper's, as its printed times tell [a0^2/D]
FIRST, PRINTED, READ = 0.14, 0.416, 0.003  # Fig. 9a
END = 2000.0
LONG = 3.0  # end of the runs with the drag of the stabilisation: soon at rest
NAMES = "typical-auto", "fig9-base"
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
    stabilised = {(name, mobility): stabilised_run(study, name, mobility, end) for name in NAMES for mobility in mobilities}
    return {"drags": np.array(drags), "found": found, "stabilised": stabilised}


def stabilised_run(study, name, mobility, end):
    """Drag and front [a0] of `stabilisation`; r(0.140) [a0] and final area [a0^2] of a run with that drag."""
    drag, front = stabilisation(study, name)
    changes = {**ON_MERIDIAN, "drag": float(f"{drag:.3g}"), "receptors.mobility": mobility, "accuracy": ACCURACY,
               "time.end": min(end, LONG), "output.frames": []}  # fmt: skip
    rows = study.history(name, changes)
    return drag, front, float(value_at(rows, "contact_radius", FIRST)), float(rows["binding_area"][-1])


def stabilisation(study, name):
    """The drag [kT D^-1 a0^-2] that ABAQUS's automatic stabilisation comes to, and the front [a0] after its step."""
    changes = {**MERIDIAN, "drag": 0.0, "receptors.frozen": True, "accuracy": ACCURACY, "output.frames": []}
    sim = Spreading(study.planned(name, changes)[0])
    state = sim.advance(sim.start(), FIRST_STEP)
    energy = elastic_energy(sim.body, state.x) - sim.elastic_energy_0
    moved = sim.body.reference_area.sum() * sim.distance(state.x, sim.x_start) ** 2
    return float(FRACTION * energy * FIRST_STEP / moved), float(Moment(sim, state)["contact_radius"])


def page(measured):
    """Text of docs/drag.md."""
    drags, found = measured["drags"], measured["found"]
    columns = [[f"{value:.3f}" for value in part] for areas_and_fronts in found.values() for part in areas_and_fronts]
    header = ["drag", *(f"{what}, mobility {m:g}" for m in found for what in ("final A, typical case", "r(0.140), soft case"))]
    rows = [[f"{drag:g}", *cells] for drag, *cells in zip(drags, *columns)]
    fronts = {mobility: front for (name, mobility), (*_, front, _) in measured["stabilised"].items() if name == NAMES[1]}
    judged = "; ".join(
        f"at a mobility of {m:g} it is {'' if abs(r - PRINTED) <= 2 * READ else 'not '}met, r = {r:.3f}" for m, r in fronts.items()
    )
    stabilised = [[name, f"{m:g}", f"{drag:.2g}", f"{first:.3f}", f"{front:.3f}", f"{area:.3f}"]
                  for (name, m), (drag, first, front, area) in measured["stabilised"].items()]  # fmt: skip
    return "\n".join([
        "# What the drag changes",
        "",
        "Written by `python plots/drag.py`. Units: length a0, time a0²/D, energy kT.",
        "",
        "Bound receptors are immobile, so that the final state depends on the way to it: drag is physics here and no numerical aid.",
        "",
        *table(header, rows),
        "",
        "## ABAQUS's automatic stabilisation",
        "",
        f"Read as the paper's damping: viscous forces that dissipate {FRACTION:g} of the strain energy of the first increment of"
        f" {FIRST_STEP:g}. The drag that this comes to, the front after the increment (without drag, receptors where they are), and a"
        " run with this drag to its end. A choice anew in each step was not run; it takes the same part of each increment's energy.",
        "",
        *table(["case", "mobility", "drag", "r after the increment", "r(0.140)", "final A"], stabilised),
        "",
        f"Fig. 9a prints r = {PRINTED:g} ± {READ:g} at t = {FIRST:.3f}: {judged}.",
        "",
    ])  # fmt: skip


def draw(measured, out=looks.OUT):
    out.mkdir(parents=True, exist_ok=True)
    text, drags = page(measured), measured["drags"]
    (PAGE if out == looks.OUT else out / PAGE.name).write_text(text)
    print(text)

    def fill(area, front):
        for (mobility, (areas, fronts)), color, marker in zip(measured["found"].items(), (DARK, RED), "os"):
            label = f"{looks.SYMBOLS['receptors.mobility']} = {mobility:g}"
            area.semilogx(drags, areas, marker=marker, color=color, label=label)
            front.semilogx(drags, fronts, marker=marker, color=color, label=label)
        area.set(xlabel=r"drag $\eta$ [$kT D^{-1} a_0^{-2}$]", ylabel="final area $A$ [$a_0^2$]", ylim=(0, None))
        front.axhspan(PRINTED - READ, PRINTED + READ, color="0.8", linewidth=0, label="printed in Fig. 9a")
        for (name, _), (drag, _, radius, _) in measured["stabilised"].items():
            if name == NAMES[1]:
                front.plot(drag, radius, "k*", markersize=8)
        front.plot([], [], "k*", label="automatic stabilisation")
        front.set(xlabel=r"drag $\eta$ [$kT D^{-1} a_0^{-2}$]", ylabel="front $r(0.140)$ [$a_0$]", ylim=(0, None))
        area.legend(loc="lower left")
        front.legend(loc="lower left")

    looks.panels(fill, "drag", out, size=(7.2, 2.8))


if __name__ == "__main__":
    looks.command_line(measure, draw)
