"""What is measured of a state: the columns of the history, each with its unit, its meaning and its function.

The header of history.csv, `vesdyn info`, the documentation and the units of `vesdyn.open_run` follow from COLUMNS. A
user's own column is one more `Column`.
"""
import difflib
from collections.abc import Callable, Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np

from vesdyn.adhesion import adhesion_traction, ligand_density
from vesdyn.body import area_below, area_facing_away, elastic_energy, principal_tensions, set_shares_below
from vesdyn.budget import FIXED_STEP_ERROR, SHARES, TOLERANCE_ERROR
from vesdyn.errors import CaseError
from vesdyn.front import BINDING_GAP, contact_radius
from vesdyn.kinds import KINDS
from vesdyn.refusals import LONGEST_VALUE, shown
from vesdyn.substrate import gaps, touches

TOUCHING = 1e-6  # of the cutoff: membrane closer than this is on the plane


class Moment:
    """A state of a scene and what can be measured of it; each value is computed when it is asked for, once.

    ``moment[name]`` is a column; ``time`` [a0^2/D], ``x`` (n_nodes, d) [a0], ``density`` (n_nodes,) [c_r0],
    ``tensions`` (n_elements, 2) [kT/a0^2] and ``state`` (`vesdyn.spreading.State`) are attributes. An unknown column is
    a CaseError.
    """

    def __init__(self, sim, state, columns=()):
        self.sim, self.state = sim, state
        self._columns = {column.name: column for column in (*COLUMNS, *columns)}
        self._values = {}

    def __getitem__(self, name: str) -> float:
        if name not in self._values:
            if name not in self._columns:
                near = difflib.get_close_matches(str(name)[:LONGEST_VALUE], self._columns, n=1)
                advice = f"did you mean {near[0]}?" if near else f"there are {', '.join(self._columns)}."
                raise CaseError(f"{shown(name)}: unknown column; {advice}")
            self._values[name] = self._columns[name].value(self)
        return self._values[name]

    def row(self) -> dict[str, float]:
        """Every column by name, in order."""
        return {name: self[name] for name in self._columns}

    @property
    def time(self) -> float:
        """Time [a0^2/D]."""
        return self.state.time

    @property
    def x(self) -> np.ndarray:
        """Positions (n_nodes, d) [a0], the height last."""
        return self.state.x

    @cached_property
    def density(self) -> np.ndarray:
        """Receptor density (n_nodes,) [c_r0]."""
        return self.state.density

    @cached_property
    def tensions(self) -> np.ndarray:
        """Principal tensions (n_elements, 2) [kT/a0^2]."""
        tension = np.zeros((len(self.sim.body.elements), 2))
        principal_tensions(self.sim.body, self.x, tension)
        return tension

    def front(self, level):
        """Membrane area below ``level`` [a0] and the mean radius of its rim: [a0^2], [a0]."""
        topology = self.sim.body.topology
        share = np.zeros(len(topology.edges))
        set_shares_below(topology, self.x, level, share)
        return area_below(topology, self.x, level, share), contact_radius(self.x, topology.edges, share)

    @cached_property
    def contact(self):
        """Area [a0^2] and radius [a0] of the bound membrane; what faces away from the substrate is not bound."""
        level = BINDING_GAP * self.sim.case.adhesion.cutoff
        area, radius = self.front(level)
        return area - area_facing_away(self.sim.body.topology, self.x, level), radius

    @cached_property
    def slackest(self):
        """Tension [kT/a0^2] and height [a0] of the free element in which a principal tension is smallest."""
        gap = gaps(self.x)[self.sim.body.elements]
        free = np.flatnonzero(~touches(gap.min(axis=1)))
        smallest = self.tensions[free].min(axis=1)
        at = free[np.argmin(smallest)]
        return smallest.min(), gap[at].mean()

    def frame(self):
        """Elements (n_elements, k), nodal arrays and element arrays to store or draw."""
        gap, density, tension = gaps(self.x).copy(), self.density, self.tensions
        ligands = ligand_density(self.sim.case.ligands, self.x)
        law = self.sim.adhesion
        traction = np.array([adhesion_traction(law, *at) for at in zip(gap, density, ligands)])
        nodal = {"position": self.x.copy(), "density": density, "gap": gap, "traction": traction}
        return self.sim.body.elements, nodal, {"tension_1": tension[:, 0], "tension_2": tension[:, 1]}


class Column(NamedTuple):
    """A number that is recorded at every coupling step: ``value(moment)``."""

    name: str
    unit: str  # "1" for a plain number
    meaning: str
    value: Callable[[Moment], float]


def own_columns(columns: Sequence[Column]) -> tuple[Column, ...]:
    """``columns`` of a user as they are recorded: as plain floats. Raises CaseError for what cannot be a column."""
    names = {column.name for column in COLUMNS}
    for column in columns:
        if not isinstance(column, Column):
            raise CaseError(f"columns: {shown(column)} is none; write vesdyn.Column(name, unit, meaning, function).")
        if not (isinstance(column.name, str) and column.name.isidentifier()):
            raise CaseError(f"columns: {shown(column.name)} cannot name a column; use letters, digits and '_'.")
        if column.name in names:
            raise CaseError(f"columns: {column.name} is there already; choose another name.")
        names.add(column.name)
    return tuple(column._replace(value=_number_of(column)) for column in columns)


def _number_of(column):
    def value(moment):
        found = column.value(moment)
        try:
            return float(found)
        except (TypeError, ValueError):
            raise CaseError(f"columns: {column.name} gives {shown(found)}, which is no number; return one.") from None

    return value


def believed_error(case, radius):
    """Relative error of the binding area that a run of ``case`` believes to have with the front at ``radius`` [a0].

    What mesh, step and tolerance are estimated to cost, added (`vesdyn.budget`, `vesdyn.body.MeshError`); the mesh by the
    difference of two scouts of the scene where edges were left to be chosen. NaN for a mesh from a file, whose error
    nobody has measured, and before contact.
    """
    if case.mesh.file is not None or radius <= 0.0:
        return np.nan
    error = KINDS[case.model].mesh_error(case.mesh, case.membrane.thickness > 0.0)
    mesh = case.mesh.difficulty * error.at(case.mesh.front_edge, radius)
    fixed = case.time.step != "auto"
    step = FIXED_STEP_ERROR[case.time.order] * case.time.step if fixed else SHARES["step"] * case.accuracy
    return min(1.0, mesh + step + TOLERANCE_ERROR * case.tolerance)


def _lost_receptors(m):
    return 0.0 if m.sim.adhesion.frozen else m.state.number.sum() / m.sim.number_0 - 1.0


COLUMNS = (
    Column("time", "a0^2/D", "time", lambda m: m.state.time),
    Column("binding_area", "a0^2", "area of the membrane closer to the substrate than 0.02 d_c", lambda m: m.contact[0]),
    Column("contact_radius", "a0", "mean radius of its rim", lambda m: m.contact[1]),
    Column("pressure", "kT/a0^3", "pressure of the enclosed fluid", lambda m: m.state.pressure),
    Column("volume_error", "1", "V/V0 - 1", lambda m: m.state.volume / m.sim.volume_0 - 1.0),
    Column("receptor_number_error", "1", "N/N0 - 1", _lost_receptors),
    Column("density_min", "c_r0", "smallest receptor density", lambda m: m.density.min()),
    Column("density_max", "c_r0", "largest receptor density", lambda m: m.density.max()),
    Column("membrane_area", "a0^2", "area of the whole membrane", lambda m: m.state.area.sum()),
    Column("height", "a0", "height of the vesicle", lambda m: gaps(m.x).max()),
    Column("elastic_energy", "kT", "strain and bending energy", lambda m: elastic_energy(m.sim.body, m.x)),
    Column("adhesion_work", "kT", "work of the adhesion since t = 0", lambda m: m.state.adhesion_work),
    Column("dissipation", "kT", "work against the drag since t = 0", lambda m: m.state.dissipation),
    Column("iterations", "1", "iterations of the balance", lambda m: m.state.iterations),
    Column("residual", "1", "largest out-of-balance force of a node, scaled", lambda m: m.state.residual),
    Column("gap_min", "a0", "smallest gap; never negative", lambda m: gaps(m.x).min()),
    Column("centre_gap", "a0", "gap in the middle of the contact", lambda m: gaps(m.x)[m.sim.lowest]),
    Column("tension_min", "kT/a0^2", "smallest principal tension", lambda m: m.tensions.min()),
    Column("free_tension_min", "kT/a0^2", "smallest principal tension of free membrane", lambda m: m.slackest[0]),
    Column("free_tension_min_height", "a0", "height at which it is met", lambda m: m.slackest[1]),
    Column(
        "folded_area",
        "a0^2",
        "area within the cutoff that faces away from the substrate",
        lambda m: area_facing_away(m.sim.body.topology, m.x, m.sim.case.adhesion.cutoff),
    ),
    Column(
        "near_area",
        "a0^2",
        "part of the binding area that touches nothing: membrane that is near and not bound",
        lambda m: m.contact[0] - m.front(TOUCHING * m.sim.case.adhesion.cutoff)[0],
    ),
    Column("clipped_edges", "1", "edges whose negative conductance is set to zero", lambda m: m.state.clipped_edges),
    Column("step_error", "1", "relative difference of the state from the one seen ahead", lambda m: m.state.step_error),
    Column(
        "area_error",
        "1",
        "believed relative error of the binding area",
        lambda m: believed_error(m.sim.case, m.contact[1]),
    ),
)
