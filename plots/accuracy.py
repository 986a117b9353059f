"""Speed against accuracy: what an error of the binding area costs, and whether the wish is kept.

The error is the largest relative one over all coupling steps after t = 0.01, against a meridian resolved far more
finely; the cost is the CPU time of the coupling steps, without planning, start-up and storage. Thanks to bending,
surfaces converge to the meridian although the free membrane is in hoop compression early on.
"""
import study
from study import DARK, LIGHT, RED

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


def measure(scene, changes, finest):
    """Errors over all steps and at the listed times; what the run took."""
    rows = study.history(scene, changes)
    times = [t for t in study.listed(scene)[0] if 0.01 <= t <= min(rows["time"][-1], finest["time"][-1])]
    at_listed = max(abs(study.area_at(rows, times) / study.area_at(finest, times) - 1.0))
    edge, nodes = study.mesh_of(scene, changes)
    return {
        "error": study.area_error(rows, finest),
        "listed": at_listed,
        "seconds": study.seconds(scene, changes),
        "edge": edge,
        "nodes": nodes,
        "steps": len(rows["time"]),
        "iterations": int(rows["iterations"].sum()),
    }


def main(out=study.OUT, scenes=("typical", "fig9-base"), families=FAMILIES, finest=FINEST, check=CHECK):
    figures = {}
    for scene in scenes:
        exact = study.history(scene, finest)
        times, areas = (values[study.listed(scene)[0] <= exact["time"][-1]] for values in study.listed(scene))
        study.table(
            f"{study.TITLE[scene]}: the finest solution against the independent one of a pure membrane, relative",
            ["t", "A finest", "independent", "difference"],
            [(t, float(a), b, float(b / a - 1.0)) for t, a, b in zip(times, study.area_at(exact, times), areas)],
        )
        if check:
            print(f"  the same on a mesh and step 2 times coarser: {study.area_error(study.history(scene, check), exact):.2e}")
        for family, (runs, *_) in families.items():
            figures[scene, family] = [measure(scene, changes, exact) for changes in runs]
            study.table(
                f"{study.TITLE[scene]}, {family}",
                ["wish", "step", "front edge", "nodes", "steps", "iterations", "CPU [s]", "error", "at listed times"],
                [
                    (c.get("accuracy", "-"), c["time.step"], *(m[k] for k in ("edge", "nodes", "steps", "iterations", "seconds", "error", "listed")))
                    for c, m in zip(runs, figures[scene, family])
                ],
            )

    def draw(cost, kept):
        for (scene, family), measured in figures.items():
            runs, color, marker, line = families[family]
            fill = color if scene == scenes[0] else "white"
            look = {"color": color, "marker": marker, "linestyle": line, "markerfacecolor": fill}
            errors = [m["error"] for m in measured]
            wishes = [c.get("accuracy") for c in runs]
            if None not in wishes:
                kept.loglog(wishes, errors, **look, label=f"{family.split(',')[0]}, {study.TITLE[scene]}")
            cost.loglog([m["seconds"] for m in measured], errors, **look, label=family if scene == scenes[0] else None)
        wishes = [8e-4, 0.05]
        kept.loglog(wishes, wishes, "--", color="0.4", linewidth=0.9, label="error = wish")
        kept.set(xlabel=r"accuracy wish", ylabel="largest relative error of $A(t)$, $t \\geq 0.01$")
        cost.set(xlabel="CPU time of the coupling steps [s]", ylabel="largest relative error of $A(t)$, $t \\geq 0.01$")
        study.legend_below(cost, "filled: typical case; open: soft case of Fig. 9")
        study.legend_below(kept)
        for axis in (cost.yaxis, kept.yaxis, kept.xaxis):
            study.as_percent(axis)

    study.panels(draw, "accuracy", out, size=(7.2, 4.3))


if __name__ == "__main__":
    main(study.command_line())
