"""A run as a movie: the stored shapes one after the other, coloured by receptor density, beside the binding area."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path

import matplotlib.style
import numpy as np
from matplotlib.animation import FFMpegWriter, PillowWriter
from matplotlib.figure import Figure

from vesdyn.errors import CaseError
from vesdyn.files import replace_file, write_error
from vesdyn.kinds import topology_of
from vesdyn.pictures import (
    ABOVE,
    BINDING_AREA,
    DARK,
    LOOKS,
    MIDDLE,
    TIME,
    add_color_bar,
    color_scale,
    draw_substrate,
    draw_vesicle,
    project,
    shape_of,
)
from vesdyn.refusals import printable_path
from vesdyn.results import Run
from vesdyn.units import beside

FEWEST = 2  # shapes that make a movie
_DOTS = 110  # an inch


def default_name() -> str:
    """Name of the file of a movie: MP4 where the program ffmpeg is found, else GIF."""
    return "movie.mp4" if FFMpegWriter.isAvailable() else "movie.gif"


def write_movie(
    run: Run, file: str | Path, seconds: float = 6.0, elevation: float = ABOVE, turn: float = 0.0, told: Callable = iter
) -> Path:
    """Write the stored shapes of ``run`` as a movie of ``seconds`` [s] to ``file`` (.mp4 by ffmpeg, or .gif); return it.

    The camera looks from ``elevation`` [degrees] above the substrate, -90 from below, with the vesicle turned by
    ``turn`` [degrees] about the axis. ``told`` wraps the sequence of shapes, as a progress bar does.

    Raises CaseError where the run holds fewer than two shapes, ``seconds`` are none or the file cannot be made so, and
    vesdyn.files.WriteError where it cannot be written.
    """
    file, frames = Path(file), run.frames
    if len(frames) < FEWEST:
        raise CaseError(
            f"{printable_path(run.path)}: holds {len(frames)} stored shape{'s' * (len(frames) != 1)}, too few for a movie; ask for more,"
            " such as output.frames: {count: 50}."
        )
    if file.suffix not in (".mp4", ".gif"):
        raise CaseError(f"{printable_path(file)}: is neither .mp4 nor .gif; give a name that ends in one of them.")
    if file.suffix == ".mp4" and not FFMpegWriter.isAvailable():
        raise CaseError(f"{printable_path(file)}: MP4 is made by the program ffmpeg, which is not here; install it, or write a .gif.")
    if not seconds > 0.0:
        raise CaseError(f"seconds: {seconds:g} is not a duration; give one greater than 0.")
    topology = topology_of(frames[0].connectivity)
    shapes = [_turned(shape_of(frame, topology), turn) for frame in frames]
    history, scales = run.history, run.case.scales
    writer = (FFMpegWriter if file.suffix == ".mp4" else PillowWriter)(fps=max(1.0, len(shapes) / seconds))
    try:
        with tempfile.TemporaryDirectory(prefix=".movie-", dir=file.parent) as folder, matplotlib.style.context(["default", LOOKS]):
            figure = Figure(figsize=(8.0, 4.0), dpi=_DOTS)
            norm = color_scale(shapes)
            width = 1.12 * max(np.abs(shape.vertices[:, :2]).max() for shape in shapes)
            ends = [project(shape.vertices, elevation)[1] for shape in shapes]
            low, high = min(end.min() for end in ends), max(end.max() for end in ends)
            margin = width * abs(np.sin(np.radians(elevation)))
            scene = figure.add_axes((0.01, 0.02, 0.5, 0.86), aspect="equal")
            add_color_bar(figure, norm, (0.53, 0.2, 0.013, 0.6))
            axes = figure.add_axes((0.68, 0.17, 0.3, 0.68), xlabel=TIME, ylabel=BINDING_AREA)
            axes.plot(history["time"], history["binding_area"], color=DARK)
            axes.set_xlim(left=0.0)
            axes.set_ylim(bottom=0.0)
            (now,) = axes.plot([], [], "o", color=MIDDLE, clip_on=False)
            with writer.saving(figure, Path(folder, file.name), _DOTS):
                for shape in told(shapes):
                    scene.clear()
                    scene.set_axis_off()
                    scene.set(xlim=(-width, width), ylim=(min(low, -margin), max(high, margin)))
                    draw_substrate(scene, width, elevation)
                    draw_vesicle(scene, shape, norm, elevation)
                    time = f"$t$ = {shape.time:.4g} $a_0^2/D$" + beside(shape.time, "a0^2/D", scales)
                    scene.set_title(time, loc="center", weight="normal", size=11)
                    now.set_data([shape.time], [np.interp(shape.time, history["time"], history["binding_area"], left=0.0)])
                    writer.grab_frame()
            replace_file(file.parent, file.name, Path(folder, file.name).read_bytes())
    except OSError as error:
        raise write_error(file.parent, file.name, error) from None
    return file


def _turned(shape, degrees):
    """The ``shape`` turned about the z axis."""
    cosine, sine = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    x, y, z = shape.vertices.T
    return shape._replace(vertices=np.stack([cosine * x - sine * y, sine * x + cosine * y, z], axis=1))
