"""Real vesicles and cells that spread: their shapes on the way, and A(t) with the error that each run states.

A red cell from its flat shape (reduced volume 0.6) and as a sphere, a giant vesicle with an actin shell, a white cell:
`configs/real/`, where each number has its source. Time in seconds and lengths in micrometres by SCENES. Beside the
picture a page is written, docs/real.md.
"""

from pathlib import Path

import looks
import numpy as np
from looks import DARK, GREEN, LIGHT, RED

SCENES = {  # case: name, a0 [um], a0^2/D [s]
    "real/red-cell": ("red cell", 5.64, 3180.0),
    "real/red-cell-sphere": ("red cell, a sphere", 5.64, 3180.0),
    "real/giant-vesicle": ("giant vesicle with a shell", 14.0, 196.0),
    "real/white-cell": ("white cell", 8.5, 3610.0),
}
COLORS = ((DARK, "-"), (LIGHT, "--"), (GREEN, "-."), (RED, ":"))
CLOSER = 0.5  # wish of the run by which the error that is stated is tried, over that of the case


def measure(study, scenes=SCENES):
    """By scene: A(t), the stated error and that found by a run at half the wish, time, shapes."""
    closer = {name: {"accuracy": CLOSER * study.case(name).accuracy} for name in scenes}
    study.prepare([run for name in scenes for run in ((name, {}), (name, closer[name]))])
    measured = {}
    for name in scenes:
        history, finer = study.history(name), study.history(name, closer[name])
        edge, nodes = study.resolution(name)
        measured[name] = {
            "scene": scenes[name],
            "time": history["time"],
            "area": history["binding_area"],
            "stated": history["area_error"],
            "radius": history["contact_radius"][-1],
            "height": history["height"][-1],
            "membrane": history["membrane_area"][-1] / history["membrane_area"][0] - 1.0,
            "found": disagreement(history, finer),
            "edge": edge,
            "nodes": nodes,
            "seconds": study.cpu_time(name),
            "shapes": [frame["position"] for frame in study.frames(name)],
        }
    return measured


def disagreement(history, finer):
    """Largest relative difference of the binding areas once it has passed a tenth of its final value."""
    t, area = history["time"], history["binding_area"]
    late = (area >= 0.1 * area[-1]) & (t <= finer["time"][-1])
    there = np.exp(np.interp(np.log(t[late]), np.log(finer["time"]), np.log(finer["binding_area"])))
    return float(np.max(np.abs(area[late] / there - 1.0)))


def draw(measured, out=looks.OUT):
    looks.table(
        "real scenes: areas in a0^2; error stated at the end, and found by a run at half the wish",
        ["case", "nodes", "front edge", "steps", "CPU [s]", "final A", "r", "height", "membrane", "stated", "found"],
        [
            (name, m["nodes"], m["edge"], len(m["time"]), m["seconds"], m["area"][-1], m["radius"], m["height"],
             m["membrane"], m["stated"][-1], m["found"])
            for name, m in measured.items()
        ],
    )  # fmt: skip

    def fill(figure):
        panels = figure.subplot_mosaic([["areas"] * len(measured), list(measured)], height_ratios=(1.2, 1.0))
        for (name, m), (color, line) in zip(measured.items(), COLORS):
            title, a0, unit = m["scene"]
            seconds, area, error = m["time"] * unit, m["area"] * a0**2, m["stated"]
            panels["areas"].loglog(seconds, area, color=color, linestyle=line, label=title)
            panels["areas"].fill_between(
                seconds, area * (1 - error), area * (1 + error), color=color, alpha=0.25, linewidth=0
            )
            draw_shapes(panels[name], m["shapes"], a0, color)
            panels[name].set_title(title)
        panels["areas"].set(xlabel="time [s]", ylabel="binding area [$\\mu$m$^2$]")
        panels["areas"].legend(loc="lower right")

    looks.picture(fill, "real", out, size=(7.2, 4.8))
    (Path(out) / "real.md").write_text("\n".join(page(measured)) + "\n", encoding="utf-8")


def page(measured):
    """Lines of docs/real.md."""
    yield from (
        "# Real vesicles and cells",
        "",
        "Written by `make real` (`plots/real.py`): change it there. The scenes are shipped as `configs/real/`.",
        "",
        "![Binding area against time, and shapes](real.png)",
        "",
        "A(t) in the band of the error that each run states; below the shapes at the start, at the frames and at the end,"
        " the later the darker. A run says what error it believes to have; how far it is off is told by a run at"
        f" half its wish ({len(measured)} scenes, all at the wish that stands in their file).",
        "",
        "| scene | nodes | shortest edge [um] | steps | CPU [s] | final area [um2] | contact radius [um] | height [um] |"
        " membrane stretched by | 95 % of the final area after [s] | error stated, largest | error found, largest |",
        "|" + "---|" * 12,
    )
    for m in measured.values():
        title, a0, unit = m["scene"]
        done = unit * m["time"][np.argmax(m["area"] >= 0.95 * m["area"][-1])]
        late = m["area"] >= 0.1 * m["area"][-1]
        yield (
            f"| {title} | {m['nodes']} | {a0 * m['edge']:.2g} | {len(m['time'])} | {m['seconds']:.2g} |"
            f" {a0**2 * m['area'][-1]:.3g} | {a0 * m['radius']:.2f} | {a0 * m['height']:.2f} | {m['membrane']:.1%} |"
            f" {done:.2g} | {np.max(m['stated'][late]):.1%} | {m['found']:.1%} |"
        )
    yield from ("", "Errors count once a tenth of the final area is bound, as the wish does.", "")
    yield from ("## Where the numbers come from", "")
    for name in measured:
        yield from (f"`{name}`:", "", "```", *sources(name), "```", "")


def sources(name):
    """Comment at the head of the file of a shipped case."""
    for line in (looks.ROOT / "configs" / f"{name}.yaml").read_text(encoding="utf-8").splitlines():
        if not line.startswith("#"):
            return
        yield line.removeprefix("#").removeprefix(" ").rstrip()


def draw_shapes(ax, shapes, a0, color):
    """Meridians [um] on both sides of the axis, the later the darker."""
    for number, x in enumerate(shapes):
        r, z = a0 * x[:, [0, -1]].T
        shade = 0.3 + 0.7 * number / max(1, len(shapes) - 1)
        ax.plot(np.concatenate([-r[::-1], r]), np.concatenate([z[::-1], z]), color=color, alpha=shade, linewidth=0.8)
    ax.axhline(0.0, color="0.4", linewidth=0.8)
    ax.set(aspect="equal", xlabel="$x$ [$\\mu$m]", ylabel="$z$ [$\\mu$m]")
    ax.set_anchor("S")


if __name__ == "__main__":
    looks.command_line(measure, draw, out=looks.ROOT / "docs")
