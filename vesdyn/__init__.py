"""A vesicle spreads on a substrate, held by receptors that diffuse in its membrane to the ligands below.

Units throughout: length a0 (the initial diameter), time a0^2/D (D the receptors' diffusivity), energy kT,
receptor density c_r0 (its initial value).

    case = vesdyn.load_case("typical", model="axisymmetric")
    for moment in vesdyn.simulate(case):
        print(moment.time, moment["binding_area"])

`load_case` reads a case, `Case` makes one, `plan` chooses what it leaves open, `simulate` computes it step by step,
`run_case` and `run_batch` keep what is computed, `open_run` reads it again. `CaseError` says why an input cannot be
used, `RunError` why a run cannot go on.
"""

from importlib import import_module
from importlib.metadata import PackageNotFoundError, version
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from vesdyn.batch import run_batch
    from vesdyn.case import Case
    from vesdyn.case_file import load_case
    from vesdyn.diagnostics import Column, Moment
    from vesdyn.errors import CaseError, RunError
    from vesdyn.planning import plan
    from vesdyn.results import open_run
    from vesdyn.run import run_case, simulate

try:
    __version__ = version("vesdyn")
except PackageNotFoundError:  # run from a source tree that is not installed
    __version__ = "unknown"

_HOME = {  # public name: the module it comes from, imported when first asked for, so that each use waits for its own
    "Case": "case",
    "CaseError": "errors",
    "Column": "diagnostics",
    "Moment": "diagnostics",
    "RunError": "errors",
    "load_case": "case_file",
    "open_run": "results",
    "plan": "planning",
    "run_batch": "batch",
    "run_case": "run",
    "simulate": "run",
}
__all__ = sorted(_HOME)


def __getattr__(name):
    if name in _HOME:
        return getattr(import_module(f"vesdyn.{_HOME[name]}"), name)
    raise AttributeError(f"module 'vesdyn' has no attribute {name!r}")


def __dir__():
    return sorted([*globals(), *_HOME])
