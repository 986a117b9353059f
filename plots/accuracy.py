"""Speed against accuracy: what an error of the binding area costs, and whether the wish is kept.

The error is the largest relative one over all coupling steps after t = 0.01, against a meridian resolved far more
finely; the cost is the CPU time of the coupling steps, without planning, start-up and storage. Thanks to bending,
surfaces converge to the meridian although the free membrane is in hoop compression early on.
"""

import looks
import numpy as np
from looks import DARK, LIGHT, RED

from vesdyn.study import START, area_at, area_error

SCENES = ("typical", "fig9-base")
FINEST = {
    "model": "axisymmetric", "mesh.front_edge": 0.0012, "mesh.far_edge": 0.0072, "time.step": "auto",
    "accuracy": 0.0005, "solver.tolerance": 2e-5,
}  # fmt: skip
MERIDIAN = tuple({"model": "axisymmetric", "mesh": "auto", "time.step": "auto", "accuracy": wish}
                 for wish in (0.04, 0.02, 0.01, 0.005, 0.003, 0.001))  # fmt: skip
SURFACE = tuple({"mesh.front_edge": edge, "mesh.far_edge": max(0.05, 3 * edge), "time.step": "auto"}
                for edge in (0.03, 0.02, 0.015, 0.0125))  # fmt: skip
FIXED = tuple({"mesh.front_edge": 0.015, "mesh.far_edge": 0.05, "time.step": step, "solver.tolerance": 1e-4}
              for step in (0.004, 0.002, 0.001))  # fmt: skip
WISHED = tuple({"model": "surface", "mesh": "auto", "time.step": "auto", "accuracy": wish} for wish in (0.04, 0.02))
FAMILIES = {
    "axisymmetric, wish 4 % to 0.1 %": (MERIDIAN, DARK, "o", "-"),
    "surface, front edge 0.03 to 0.0125, adaptive step": (SURFACE, RED, "s", "--"),
    "surface, front edge 0.015, step 0.004 to 0.001": (FIXED, LIGHT, "^", ":"),
    "surface, wish 4 %, 2 %": (WISHED, RED, "D", "-."),
}
CHECK = {**FINEST, "mesh.front_edge": 0.0025, "mesh.far_edge": 0.015, "accuracy": 0.001, "solver.tolerance": 1e-4}


def measure(study, scenes=SCENES, families=FAMILIES, finest=FINEST, check=CHECK):
    """By scene: areas beside the independent ones, the error of the check, and by family what each run comes to."""
    measured = {}
    for scene in scenes:
        stops = stops_of(study, scene)
        exact = study.history(scene, stops | finest)
        times, areas = (
            values[looks.independent_areas(scene)[0] <= exact["time"][-1]]
            for values in looks.independent_areas(scene)
        )
        study.prepare([(scene, stops | changes) for runs, *_ in families.values() for changes in runs])
        measured[scene] = {
            "independent": [
                (float(t), float(a), float(b), float(b / a - 1.0))
                for t, a, b in zip(times, area_at(exact, times), areas)
            ],
            "check": float(area_error(study.history(scene, stops | check), exact)) if check else np.nan,
            "families": {
                family: [measure_run(study, scene, stops | changes, exact) for changes in runs]
                for family, (runs, *_) in families.items()
            },
        }
    return measured


def stops_of(study, scene):
    """The change by which a run of ``scene`` stops at the times of the independent computation."""
    end = study.case(scene).time.end
    return {"output.frames": [float(t) for t in looks.independent_areas(scene)[0] if t <= end]}


def measure_run(study, scene, changes, finest):
    """Errors over all steps and at the times of the independent computation; what the run took."""
    rows = study.history(scene, changes)
    times = [t for t in changes["output.frames"] if START <= t <= min(rows["time"][-1], finest["time"][-1])]
    edge, nodes = study.resolution(scene, changes)
    return {
        "wish": changes.get("accuracy"),
        "step": changes["time.step"],
        "edge": edge,
        "nodes": nodes,
        "steps": len(rows["time"]),
        "iterations": int(rows["iterations"].sum()),
        "seconds": study.cpu_time(scene, changes),
        "error": float(area_error(rows, finest)),
        "listed": float(max(abs(area_at(rows, times) / area_at(finest, times) - 1.0))),
    }


def draw(measured, out=looks.OUT, families=FAMILIES):
    for scene, found in measured.items():
        looks.table(
            f"{looks.TITLE[scene]}: the finest solution against the independent one of a pure membrane, relative",
            ["t", "A finest", "independent", "difference"],
            found["independent"],
        )
        print(f"  the same on a mesh and step 2 times coarser: {found['check']:.2e}")
        for family, runs in found["families"].items():
            looks.table(
                f"{looks.TITLE[scene]}, {family}",
                ["wish", "step", "front edge", "nodes", "steps", "iterations", "CPU [s]", "error", "at listed times"],
                [(run["wish"] or "-", *list(run.values())[1:]) for run in runs],
            )

    def fill(cost, kept):
        for number, (scene, found) in enumerate(measured.items()):
            for family, runs in found["families"].items():
                _, color, marker, line = families[family]
                look = {
                    "color": color,
                    "marker": marker,
                    "linestyle": line,
                    "markerfacecolor": "white" if number else color,
                }
                errors = [run["error"] for run in runs]
                wishes = [run["wish"] for run in runs]
                if None not in wishes:
                    kept.loglog(wishes, errors, **look, label=f"{family.split(',')[0]}, {looks.TITLE[scene]}")
                cost.loglog([run["seconds"] for run in runs], errors, **look, label=None if number else family)
        wishes = [8e-4, 0.05]
        kept.loglog(wishes, wishes, "--", color="0.4", linewidth=0.9, label="error = wish")
        kept.set(xlabel=r"accuracy wish", ylabel="largest relative error of $A(t)$, $t \\geq 0.01$")
        cost.set(
            xlabel="CPU time of the coupling steps [s]", ylabel="largest relative error of $A(t)$, $t \\geq 0.01$"
        )
        looks.legend_below(cost, "filled: typical case; open: soft case of Fig. 9")
        looks.legend_below(kept)
        for axis in (cost.yaxis, kept.yaxis, kept.xaxis):
            looks.as_percent(axis)

    looks.panels(fill, "accuracy", out, size=(7.2, 4.3))


if __name__ == "__main__":
    looks.command_line(measure, draw, every=looks.INDEPENDENT)
