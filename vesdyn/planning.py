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
from vesdyn.budget import FIXED_STEP_ERROR, SHARES, TOLERANCE_ERROR, WISHED_FROM
from vesdyn.case import Case, check_is_case
from vesdyn.diagnostics import Moment
from vesdyn.errors import CaseError
from vesdyn.kinds import KINDS
from vesdyn.koiter import bending_stiffness
from vesdyn.meshing import machine_memory, measured_edges, read_mesh, reduced_volume, spheroid_area, triangles_area
from vesdyn.spreading import Spreading, method_of
from vesdyn.stepping import FoldError, is_steady, march
from vesdyn.substrate import gaps

SCOUT_ACCURACY = 0.02
SCOUT_ITERATIONS = 4000  # of a relaxation where Newton's method fails: a scout that needs more is repeated finer
LONGEST_SCOUT_EDGE = 0.02  # [a0]
EDGES_A_CUTOFF = 4  # at least: the snap-in zone is resolved
EDGES_A_RADIUS = 6  # at least, of a scout when the wish begins to count
REFINEMENT = 1.6  # from scout to scout
MESH_ORDER = 2.0  # in the edge: what the difference of two scouts is read by
TRUST = 0.5, 50.0  # the measured error of a mesh is taken within these multiples of that of the model
MARGIN, MORE_ANGLE = 1.15, 10.0  # the fine zone against the slope that the front reaches [1, degrees]
MORE_ZONE = 1.5  # times as far: the fine zone of the next scout after a front that left it
SAME_FOLD = 0.2  # relative difference of the times at which two scouts fold, at most
_SCOUTS, _FAILURES = 7, 3  # at most
BENDING_SHARE = 0.5  # of the wish: an effect of bending above it is computed
COMPRESSION = 0.01  # of K: free membrane below minus this tension would wrinkle


class Scout(NamedTuple):
    """What a coarse meridian saw."""

    front_edge: float  # of its mesh [a0]
    fine_angle: float  # of its mesh [degrees]
    early_radius: float  # contact radius when the wish begins to count, at WISHED_FROM of the final area [a0]
    reach: float  # slope of the start shape up to where it has come within the cutoff [degrees]
    final_area: float  # [a0^2]
    final_time: float  # [a0^2/D]
    steady: bool
    bends: bool
    folded: str | None  # what the run said where the membrane folded over itself
    tension: float  # smallest principal tension of the free membrane [kT/a0^2], where and when:
    tension_time: float
    tension_height: float
    curve: np.ndarray  # (n_steps, 2) time [a0^2/D] and binding area [a0^2]

    def counts(self):
        """Times (n,) of its steps for which the wish holds."""
        t, area = self.curve.T
        return t[area >= WISHED_FROM * self.final_area]


class Plan(NamedTuple):
    """A case with body and mesh chosen, and a sentence for each decision."""

    case: object
    decisions: tuple


def needs_planning(case):
    """True where the case leaves its body or mesh to be chosen."""
    edges = (case.mesh.front_edge, case.mesh.far_edge) if case.mesh.file is None else ()
    return "auto" in (case.model, *edges)


def scout(case, front_edge, fine_angle):
    """Run ``case`` on a meridian of these edges as far as its fine zone goes; None where it finds no balance."""
    coarse = case.model_copy(
        update={
            "model": "axisymmetric",
            "perturbation": case.perturbation.model_copy(update={"amplitude": 0.0, "front": 0.0, "restart": False}),
            "accuracy": SCOUT_ACCURACY,
            "ligands": case.ligands.model_copy(update={"pattern": "even"}) if case.ligands.breaks_axis else case.ligands,
            "mesh": case.mesh.model_copy(
                update={"front_edge": front_edge, "far_edge": max(0.05, front_edge), "fine_angle": fine_angle}
            ),
            "time": case.time.model_copy(update={"step": "auto", "order": 2, "stop_when_steady": True}),
            "output": case.output.model_copy(update={"frames": ()}),
            "solver": case.solver.model_copy(
                update={"method": "newton", "tolerance": "auto", "max_iterations": SCOUT_ITERATIONS}
            ),
        }
    )
    sim = Spreading(coarse)
    lowest, rows, reach, folded = (np.inf, 0.0, 0.0), [], 0.0, None
    try:
        for state in march(sim):
            moment = Moment(sim, state)
            rows.append((moment.time, moment["binding_area"], moment["contact_radius"]))
            lowest = min(lowest, (moment["free_tension_min"], moment.time, moment["free_tension_min_height"]))
            reach = max(reach, _reach(sim, state))
            if leaves_zone(reach, fine_angle):
                break
    except FoldError as fold:
        folded = str(fold)
    except NoBalanceError:
        return None
    if not rows:
        return None
    t, area, radius = np.array(rows).T
    early = radius[np.argmax(area >= WISHED_FROM * area[-1])]
    end = moment["binding_area"], moment.time, is_steady(sim, state), case.membrane.thickness > 0.0
    return Scout(front_edge, fine_angle, early, reach, *end, folded, *lowest, np.stack([t, area], axis=1))


def _reach(sim, state):
    """Slope [degrees] of the start shape at the farthest node of the meridian that is within the cutoff."""
    near = np.flatnonzero(gaps(state.x) < sim.case.adhesion.cutoff)
    low = near[near < np.argmax(state.x[:, 0])]  # not the top of a flat vesicle
    last = low.max(initial=1)
    dr, dz = sim.x_start[last] - sim.x_start[last - 1]
    return float(np.degrees(np.arctan2(dz, dr)))


def leaves_zone(reach, fine_angle):
    """Whether a front at ``reach`` comes close to the end of the fine zone at ``fine_angle`` [degrees].

    Beyond are elements many times longer, which hold it up or fold under.
    """
    return MARGIN * reach >= fine_angle < 180.0


def agree_on_fold(coarser, finer):
    """Whether two scouts fold at about the same time, or neither does."""
    if coarser.folded and finer.folded:
        return abs(finer.final_time - coarser.final_time) <= SAME_FOLD * finer.final_time
    return not coarser.folded and not finer.folded


def survey(case):
    """Two scouts of ``case``, coarse and finer, that resolve what matters; None where the scene has no meridian.

    A scout that finds no balance, or whose mesh is too coarse for the cutoff or for the front when the wish begins to
    count, is repeated finer; one whose front left the fine zone of its mesh, with the zone extended. A fold counts where
    two scouts meet it at about the same time: a coarse mesh folds where the membrane does not.
    """
    if case.mesh.file is not None:
        return None
    edge, fine, seen = min(LONGEST_SCOUT_EDGE, case.adhesion.cutoff / EDGES_A_CUTOFF), case.mesh.fine_angle, None
    coarser, failures = None, 0
    for _ in range(_SCOUTS):
        found = scout(case, edge, fine)
        if found is None:
            failures += 1
            if failures == _FAILURES:
                return None
            edge, fine = edge / REFINEMENT, min(180.0, MORE_ZONE * fine)
            continue
        if leaves_zone(found.reach, fine):
            fine = min(180.0, MORE_ZONE * fine)
            continue
        coarser, seen = seen, found
        resolves = seen.early_radius / EDGES_A_RADIUS
        if coarser and edge <= resolves * REFINEMENT and agree_on_fold(coarser, seen):
            return coarser, seen
        edge = min(edge / REFINEMENT, resolves)
    return (coarser, seen) if coarser and seen else None


def plan(case: Case) -> Plan:
    """Choose what ``case`` leaves open (step and tolerance follow the accuracy as they go); return a `Plan`.

    Raises CaseError for a case that cannot be used.
    """
    check_is_case(case)
    scouts, bending = survey(case), []
    case, scouts = _choose_bending(case, scouts, bending)
    decisions = []
    model = _choose_body(case, decisions)
    decisions += bending
    mesh = _choose_mesh(case, model, scouts, decisions)
    seen = scouts[1] if scouts else None
    _tell_tolerance(case, decisions)
    _tell_step(case, seen, decisions)
    _tell_omissions(case, model, seen, decisions)
    case = case.model_copy(update={"model": model, "mesh": mesh})
    decisions.append(f"method: {method_of(case)}.")
    return Plan(case, tuple(decisions))


def _choose_bending(case, scouts, decisions):
    """Return the case, without bending where it may be left out, and its scouts."""
    thickness = case.membrane.thickness
    if thickness == 0.0:
        decisions.append("left out: bending (membrane.thickness is 0).")
        return case, scouts
    if scouts and scouts[1].tension < -COMPRESSION * case.membrane.shear_modulus:
        decisions.append(
            f"bending: thickness {thickness:g}; without it the compressed membrane would wrinkle at the scale of the mesh."
        )
        return case, scouts
    if case.model != "auto":
        decisions.append(f"bending: thickness {thickness:g}.")
        return case, scouts
    bare = case.model_copy(update={"membrane": case.membrane.model_copy(update={"thickness": 0.0})})
    seen_bare = scouts and scout(bare, scouts[1].front_edge, scouts[1].fine_angle)
    if not seen_bare:
        decisions.append(f"bending: thickness {thickness:g}.")
        return case, scouts
    seen = scouts[1]
    effect = _largest_difference(seen_bare, seen)
    slack = seen_bare.tension < -COMPRESSION * case.membrane.shear_modulus
    if effect < BENDING_SHARE * case.accuracy and not slack:
        decisions.append(
            f"left out: bending; a thickness of {thickness:g} changes the binding area by {effect:.2%} at most"
            " and nothing is in compression."
        )
        return bare, (scouts[0], seen_bare)
    decisions.append(
        f"bending: thickness {thickness:g}; without it the binding area would differ by up to {effect:.1%}"
        + (" and the compressed membrane would wrinkle at the scale of the mesh." if slack else ".")
    )
    return case, scouts


def _largest_difference(one, other):
    """Largest relative difference of the areas of two scouts at the times for which the wish holds."""
    t = other.counts()
    return np.max(np.abs(np.interp(t, *one.curve.T) / np.interp(t, *other.curve.T) - 1.0))


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


def _choose_mesh(case, model, scouts, decisions):
    kind, mesh = KINDS[model], case.mesh
    error = kind.mesh_error(mesh, case.membrane.thickness > 0.0)
    if mesh.file is not None:
        return _tell_mesh_in_file(case, kind, error, decisions)
    if scouts:
        mesh = mesh.model_copy(update={"difficulty": _difficulty(scouts)})
    error = error._replace(constant=error.constant * mesh.difficulty)
    front, far, fine = mesh.front_edge, mesh.far_edge, mesh.fine_angle
    if "auto" in (front, far) and not scouts:
        raise CaseError(
            f"{case.name}: mesh: no scout found a balance, so edges cannot be chosen; give mesh.front_edge and far_edge,"
            " or check that the numbers of the scene belong together (`vesdyn explain`)."
        )
    if front == "auto":
        if not case.given("mesh.fine_angle"):
            fine = float(f"{min(180.0, MARGIN * scouts[1].reach + MORE_ANGLE):.2g}")
        wanted = error.edge(SHARES["mesh"] * case.accuracy, scouts[1].early_radius)
        front = float(f"{min(wanted, kind.LONGEST_EDGE, case.adhesion.cutoff / EDGES_A_CUTOFF):.2g}")
        if far != "auto":
            front = min(front, far)
    if far == "auto":
        far = kind.far_edge(front)
    told = f"mesh: front_edge {front:g} up to a slope of {fine:g}°, far_edge {far:g}"
    if scouts:
        told += (
            f"; estimated error {error.at(front, scouts[1].early_radius):.1%} of the binding area when the front is at"
            f" r = {scouts[1].early_radius:.2g}, less later"
        )
    decisions.append(f"{told}.")
    if mesh.axes[0] != mesh.axes[1]:
        decisions.append(
            "start: a spheroid of axes {:g} : {:g}, reduced volume {:.3f}; a0 is the diameter of the sphere of equal"
            " volume.".format(*mesh.axes, reduced_volume(spheroid_area(mesh.axes)))
        )
    mesh = mesh.model_copy(update={"front_edge": front, "far_edge": far, "fine_angle": fine})
    _tell_size(case, kind.mesh_size(mesh), scouts[1] if scouts else None, decisions)
    return mesh


def _difficulty(scouts):
    """Error of a mesh in this scene against that of the model, as the difference of two scouts tells, within TRUST."""
    coarser, finer = scouts
    measured = _largest_difference(coarser, finer) / ((coarser.front_edge / finer.front_edge) ** MESH_ORDER - 1.0)
    by_model = KINDS["axisymmetric"].mesh_error(None, finer.bends).at(finer.front_edge, finer.early_radius)
    return float(f"{np.clip(measured / by_model, *TRUST):.3g}")


def _tell_mesh_in_file(case, kind, error, decisions):
    """Tell what the mesh in a file comes to; return the section as it is."""
    x, faces = read_mesh(case.mesh.file, case.mesh.sha256)
    front, longest = measured_edges(x, faces)
    decisions.append(
        f"mesh: {case.mesh.file}, edges of {front:.2g} near the contact and of {longest:.2g} at most; its error"
        f" depends on how far the front is: {error.at(front, 0.2):.1%} of the binding area at r = 0.2."
    )
    decisions.append(
        f"start: that mesh, reduced volume {reduced_volume(triangles_area(x, faces)):.3f}; a0 is the diameter of the"
        " sphere of equal volume."
    )
    _tell_size(case, kind.mesh_size(case.mesh), None, decisions)
    return case.mesh


def _tell_size(case, size, seen, decisions):
    told = f"size: about {_rounded(size.nodes)} nodes, {in_units(size.memory, _BYTES)} of memory while the mesh is made"
    if size.memory > (held := machine_memory()):
        decisions.append(f"{told}; this machine has {in_units(held, _BYTES)}, so the run would be refused.")
        return
    steps = 0
    if case.time.step != "auto":
        steps = case.time.end / case.time.step
    elif seen:
        steps = len(seen.curve) * (SCOUT_ACCURACY / case.accuracy) ** 0.5
    if steps:
        told += f"; {_rounded(steps)} steps take very roughly {in_units(steps * size.step, _SECONDS)}"
    decisions.append(f"{told}.")


_BYTES = {"TB": 1e12, "GB": 1e9, "MB": 1e6, "kB": 1e3}
_SECONDS = {"days": 86400.0, "hours": 3600.0, "minutes": 60.0, "seconds": 1.0}


def _rounded(number):
    return f"{float(f'{number:.2g}'):,.0f}"


def in_units(amount, units):
    """The ``amount`` in the largest of ``units`` (name to size) of which it has two, in two digits."""
    name, size = next(((n, s) for n, s in units.items() if amount >= 2.0 * s), list(units.items())[-1])
    return f"{float(f'{amount / size:.2g}'):,g} {name}"


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
            f"end: the scout is steady at t = {seen.final_time:.2f} with binding area {seen.final_area:.3f}, on its coarse mesh;"
            f" the rest up to {case.time.end:g} costs little."
        )


def _tell_omissions(case, model, seen, decisions):
    if KINDS[model].KEEPS_AXIS:
        decisions.append("left out: everything that depends on the azimuth; exact while the shape keeps its axis.")
    if seen is None:
        why = "found no balance" if case.mesh.file is None else "does not know the shape in the file"
        decisions.append(f"the scout {why}, so radius and compression are not known beforehand.")
        return
    if seen.folded:
        decisions.append(f"fold: {seen.folded}.")
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
