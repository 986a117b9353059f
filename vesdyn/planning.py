"""What `auto` decides, and what each omission is estimated to cost.

Model no more than a scene needs: a scene that keeps its axis is run as a meridian; mesh, step and tolerance
follow from one wish, the relative error of the binding area after the first hundredth of a0^2/D. The wish is
shared out (`vesdyn.budget`). A coarse meridian, the scout, is run first (about 50 nodes, a fraction of a second):
it tells the radius the mesh has to resolve and whether the free membrane comes into compression. A second scout
without bending tells what bending does; `model: auto` leaves it out only where that is little and nothing wrinkles.

What each knob costs stands in `vesdyn.budget`, what a mesh costs with the kind of body (`vesdyn.body.MeshError`).
"""
from typing import NamedTuple

import numpy as np

from vesdyn.balance import NoBalanceError
from vesdyn.budget import FIXED_STEP_ERROR, SHARES, TOLERANCE_ERROR
from vesdyn.diagnostics import Moment
from vesdyn.kinds import KINDS
from vesdyn.koiter import bending_stiffness
from vesdyn.meshing import measured_edges, read_mesh, reduced_volume, spheroid_area, triangles_area
from vesdyn.spreading import Spreading
from vesdyn.stepping import is_steady, march

SCOUT_ACCURACY = 0.02
BENDING_SHARE = 0.5  # of the wish: an effect of bending above it is computed
COMPRESSION = 0.01  # of K: free membrane below minus this tension would wrinkle


class Scout(NamedTuple):
    """What the coarse meridian saw."""

    early_radius: float  # contact radius at t = 0.01 (or the end) [a0]
    final_area: float  # [a0^2]
    final_time: float  # [a0^2/D]
    steady: bool
    tension: float  # smallest principal tension of the free membrane [kT/a0^2], where and when:
    tension_time: float
    tension_height: float
    curve: np.ndarray  # (n_steps, 2) time [a0^2/D] and binding area [a0^2]


class Plan(NamedTuple):
    """A case with body and mesh chosen, and a sentence for each decision."""

    case: object
    decisions: tuple


def needs_planning(case):
    """True where the case leaves its body or mesh to be chosen."""
    edges = (case.mesh.front_edge, case.mesh.far_edge) if case.mesh.file is None else ()
    return "auto" in (case.model, *edges)


def scout(case):
    """Run ``case`` on a coarse meridian; None where that fails (the scene itself will say why) or shows another shape."""
    if case.mesh.file is not None:
        return None
    coarse = case.model_copy(
        update={
            "model": "axisymmetric",
            "perturbation": case.perturbation.model_copy(update={"amplitude": 0.0, "front": 0.0}),
            "accuracy": SCOUT_ACCURACY,
            "ligands": case.ligands.model_copy(update={"pattern": "even"}) if case.ligands.breaks_axis else case.ligands,
            "mesh": case.mesh.model_copy(update={"front_edge": 0.02, "far_edge": 0.05}),
            "time": case.time.model_copy(update={"step": "auto", "order": 2, "stop_when_steady": True}),
            "output": case.output.model_copy(update={"frames": ()}),
        }
    )
    sim = Spreading(coarse)
    early, lowest, curve = None, (np.inf, 0.0, 0.0), []
    try:
        for state in march(sim):
            moment = Moment(sim, state)
            curve.append((moment.time, moment["binding_area"]))
            if early is None and moment.time >= 0.01:
                early = moment["contact_radius"]
            lowest = min(lowest, (moment["free_tension_min"], moment.time, moment["free_tension_min_height"]))
    except NoBalanceError:
        return None
    return Scout(
        early or moment["contact_radius"],
        moment["binding_area"],
        moment.time,
        is_steady(sim, state),
        *lowest,
        np.array(curve),
    )


def plan(case):
    """Choose what ``case`` leaves open (step and tolerance follow the accuracy as they go); return a `Plan`."""
    seen, bending = scout(case), []
    case, seen = _choose_bending(case, seen, bending)
    decisions = []
    model = _choose_body(case, decisions)
    decisions += bending
    mesh = _choose_mesh(case, model, seen, decisions)
    _tell_tolerance(case, decisions)
    _tell_step(case, seen, decisions)
    _tell_omissions(case, model, seen, decisions)
    return Plan(case.model_copy(update={"model": model, "mesh": mesh}), tuple(decisions))


def _choose_bending(case, seen, decisions):
    """Return the case, without bending where it may be left out, and what its scout saw."""
    thickness = case.membrane.thickness
    if thickness == 0.0:
        decisions.append("left out: bending (membrane.thickness is 0).")
        return case, seen
    bare = case.model_copy(update={"membrane": case.membrane.model_copy(update={"thickness": 0.0})})
    seen_bare = scout(bare)
    if seen is None or seen_bare is None:
        decisions.append(f"bending: thickness {thickness:g}.")
        return case, seen
    effect = _largest_difference(seen_bare.curve, seen.curve)
    slack = seen_bare.tension < -COMPRESSION * case.membrane.shear_modulus
    if case.model == "auto" and effect < BENDING_SHARE * case.accuracy and not slack:
        decisions.append(
            f"left out: bending; a thickness of {thickness:g} changes the binding area by {effect:.2%} at most"
            " and nothing is in compression."
        )
        return bare, seen_bare
    decisions.append(
        f"bending: thickness {thickness:g}; without it the binding area would differ by up to {effect:.1%}"
        + (" and the compressed membrane would wrinkle at the scale of the mesh." if slack else ".")
    )
    return case, seen


def _largest_difference(curve, other):
    """Largest relative difference of two curves (n, 2) of time and binding area after t = 0.01 (or its end)."""
    t = other[other[:, 0] >= min(0.01, other[-1, 0]), 0]
    return np.max(np.abs(np.interp(t, *curve.T) / np.interp(t, *other.T) - 1.0))


def _choose_body(case, decisions):
    broken = case.breaks_axis
    model = ("surface" if broken else "axisymmetric") if case.model == "auto" else case.model
    if broken:
        which = "perturbation" if case.perturbation.breaks_axis else "mesh.file" if case.mesh.file else "ligands"
        why = f"the scene is not axisymmetric ({which})"
    elif KINDS[model].KEEPS_AXIS:
        why = "nothing in the scene breaks the symmetry about z"
    else:
        why = "asked for; the scene keeps its axis, `model: auto` would run a meridian"
    decisions.append(f"body: {model}; {why}.")
    return model


def _choose_mesh(case, model, seen, decisions):
    kind, mesh = KINDS[model], case.mesh
    error = kind.mesh_error(mesh, case.membrane.thickness > 0.0)
    radius = seen.early_radius if seen and seen.early_radius > 0.05 else 0.15
    if mesh.file is not None:
        return _tell_mesh_in_file(case, kind, error, radius, decisions)
    front, far = mesh.front_edge, mesh.far_edge
    if front == "auto":
        wanted = error.edge(SHARES["mesh"] * case.accuracy, radius)
        front = float(f"{min(wanted, kind.LONGEST_EDGE, case.adhesion.cutoff / 4.0):.2g}")
        if far != "auto":
            front = min(front, far)
    if far == "auto":
        far = kind.far_edge(front)
    decisions.append(
        f"mesh: front_edge {front:g}, far_edge {far:g}; estimated error {error.at(front, radius):.1%} of the binding area"
        f" at t = 0.01, where the front is at r = {radius:.2f}, less later."
    )
    if mesh.axes[0] != mesh.axes[1]:
        decisions.append(
            "start: a spheroid of axes {:g} : {:g}, reduced volume {:.3f}; a0 is the diameter of the sphere of equal"
            " volume.".format(*mesh.axes, reduced_volume(spheroid_area(mesh.axes)))
        )
    mesh = mesh.model_copy(update={"front_edge": front, "far_edge": far})
    _tell_size(case, kind.mesh_size(mesh), seen, decisions)
    return mesh


def _tell_mesh_in_file(case, kind, error, radius, decisions):
    """Tell what the mesh in a file comes to; return the section as it is."""
    x, faces = read_mesh(case.mesh.file, case.mesh.sha256)
    front, longest = measured_edges(x, faces)
    decisions.append(
        f"mesh: {case.mesh.file}, edges of {front:.2g} near the contact and of {longest:.2g} at most; estimated error"
        f" {error.at(front, radius):.1%} of the binding area at t = 0.01, if the front is at r = {radius:.2f} then."
    )
    decisions.append(
        f"start: that mesh, reduced volume {reduced_volume(triangles_area(x, faces)):.3f}; a0 is the diameter of the"
        " sphere of equal volume."
    )
    _tell_size(case, kind.mesh_size(case.mesh), None, decisions)
    return case.mesh


def _tell_size(case, size, seen, decisions):
    told = f"size: about {size.nodes:.2g} nodes, {size.memory / 1e6:.2g} MB while the mesh is made"
    steps = 0
    if case.time.step != "auto":
        steps = case.time.end / case.time.step
    elif seen:
        steps = len(seen.curve) * (SCOUT_ACCURACY / case.accuracy) ** 0.5
    told += f"; {steps:.2g} steps take very roughly {duration(steps * size.step)}." if steps else "."
    decisions.append(told)


def duration(seconds):
    """Time in the unit that a person would use."""
    for unit, length in (("days", 86400.0), ("hours", 3600.0), ("minutes", 60.0)):
        if seconds >= 2.0 * length:
            return f"{seconds / length:.2g} {unit}"
    return f"{seconds:.2g} seconds"


def _tell_tolerance(case, decisions):
    decisions.append(
        f"tolerance: {case.tolerance:.2g}; estimated error {TOLERANCE_ERROR * case.tolerance:.2%}."
    )


def _tell_step(case, seen, decisions):
    length, order = case.time.step, case.time.order
    if length == "auto":
        decisions.append(
            f"step: adaptive, order {order}; estimated error {SHARES['step'] * case.accuracy:.2%}."
        )
    else:
        decisions.append(
            f"step: {length:g} throughout, order {order}; estimated error"
            f" {FIXED_STEP_ERROR[order] * length:.1%} once t > {10 * length:g}, more before."
        )
    if seen and seen.steady and case.time.end > seen.final_time:
        decisions.append(
            f"end: the scout is steady at t = {seen.final_time:.2f} with binding area {seen.final_area:.3f};"
            f" the rest up to {case.time.end:g} costs little."
        )


def _tell_omissions(case, model, seen, decisions):
    if KINDS[model].KEEPS_AXIS:
        decisions.append("left out: everything that depends on the azimuth; exact while the shape keeps its axis.")
    if seen is None:
        why = "found no balance" if case.mesh.file is None else "does not know the shape in the file"
        decisions.append(f"the scout {why}, so radius and compression are not known beforehand.")
        return
    where = f"{seen.tension / case.membrane.shear_modulus:.3f} K at t = {seen.tension_time:.3f}, z = {seen.tension_height:.2f}"
    if seen.tension < -COMPRESSION * case.membrane.shear_modulus:
        decisions.append(f"compression: the free membrane reaches {where}; {wrinkling(case, seen.tension)}.")
        if KINDS[model].KEEPS_AXIS:
            decisions.append("left out: these wrinkles; compare with `model: surface` where the shape early on matters.")
    else:
        decisions.append(f"compression: none that matters (smallest tension {where}).")


def wrinkling(case, tension):
    """Clause on the wrinkles of a free membrane under ``tension`` < 0 [kT/a0^2] (`vesdyn.modes`)."""
    B = bending_stiffness(case.membrane.shear_modulus, case.membrane.thickness)
    if B == 0.0:
        return "without bending it would wrinkle at the scale of the mesh"
    wavelength = 2.0 * np.pi * np.sqrt(2.0 * B / -tension)
    return (
        f"it would wrinkle with a wavelength of about {wavelength:.2g} a0, a disturbance growing e-fold in"
        f" {4.0 * B * case.drag / tension**2:.2g} a0^2/D at the fastest"
    )


def compression_note(case, history):
    """Sentence on the compression an axisymmetric run met, or None; ``history`` maps columns to arrays."""
    if not KINDS[case.model].KEEPS_AXIS or not len(history.get("time", ())):
        return None
    i = int(np.argmin(history["free_tension_min"]))
    tension = float(history["free_tension_min"][i])
    if tension >= -COMPRESSION * case.membrane.shear_modulus:
        return None
    return (
        f"the free membrane was in compression, {tension / case.membrane.shear_modulus:.3f} K at t ="
        f" {history['time'][i]:.3g}, z = {history['free_tension_min_height'][i]:.2g}: {wrinkling(case, tension)},"
        " which a meridian cannot show; compare with `--set model=surface`"
    )
