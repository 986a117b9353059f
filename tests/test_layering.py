"""The plan of the package: a module imports from lower rungs only, and siblings do not import each other."""

import ast
from pathlib import Path

import pytest

LADDER = [
    {"budget", "errors", "provenance", "interrupts"},
    {"_jit", "files"},
    {"plain_yaml"},
    {"refusals"},
    {"neo_hookean", "koiter", "substrate", "receptors", "body", "meshing", "case"},
    {"case_file"},
    {"adhesion", "front", "curvature", "quantities", "emulator"},
    {"inference_file"},
    {"surface", "meridian", "balance"},
    {"kinds", "relaxation"},
    {"newton"},
    {"spreading"},
    {"stepping", "diagnostics", "modes"},
    {"planning"},
    {"storage"},
    {"pictures", "results"},
    {"run"},
    {"batch"},
    {"study"},
    {"calibration"},
    {"ensemble"},
    {"inference"},
    {"inference_report"},
    {"cli"},
    {"__main__"},
]
PACKAGE = Path(__file__).parents[1] / "vesdyn"
MODULES = sorted(file.stem for file in PACKAGE.glob("*.py") if file.stem != "__init__")


def imported_modules(source):
    """Return the names of the modules of vesdyn that the text of one imports, wherever it does."""
    modules = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "imports are absolute"
            names = [node.module, *(f"{node.module}.{alias.name}" for alias in node.names)]
        else:
            continue
        modules |= {name.split(".")[1] for name in names if name.startswith("vesdyn.")}
    return modules & set(MODULES)


def test_imports_are_found_in_each_form():
    source = "import vesdyn.case\nfrom vesdyn import run\ndef f():\n    from vesdyn.cli import main"
    assert imported_modules(source) == {"case", "run", "cli"}


@pytest.mark.parametrize("module", MODULES)
def test_module_imports_from_lower_rungs_only(module):
    (rung,) = [i for i, names in enumerate(LADDER) if module in names]
    below = set().union(*LADDER[:rung])
    assert imported_modules((PACKAGE / f"{module}.py").read_text()) <= below
