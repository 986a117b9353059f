"""Writes docs/house.md, rungs, imports and what a newcomer touches, and the counts of docs/extending.md.

    python docs/house.py

The ladder stands here and nowhere else; tests/test_layering.py holds the package to it and this page to the package.
"""

import ast
import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "vesdyn"
PAGE, EXTENDING = ROOT / "docs" / "house.md", ROOT / "docs" / "extending.md"

LADDER = [  # from the bottom; a module imports from lower rungs only
    {"budget", "errors", "provenance", "interrupts"},
    {"_jit"},
    {"plain_yaml"},
    {"refusals"},
    {"units"},
    {"neo_hookean", "koiter", "substrate", "receptors", "body", "meshing", "case", "files"},
    {"case_file"},
    {"adhesion", "front", "curvature", "quantities", "emulator"},
    {"inference_file"},
    {"surface", "meridian", "balance", "scales"},
    {"kinds", "relaxation"},
    {"newton"},
    {"spreading"},
    {"stepping", "diagnostics", "modes"},
    {"planning"},
    {"storage"},
    {"pictures", "results"},
    {"run", "comparison", "movie"},
    {"batch"},
    {"study"},
    {"calibration"},
    {"ensemble"},
    {"inference"},
    {"inference_report"},
    {"cli"},
    {"__main__"},
]

BEFORE = "a50499b"  # the commit that the table of wishes calls before
WISHES = [  # what a newcomer wants; files before; files after ("+" in front: a file of their own); how, in a sentence
    (
        "a traction law",
        ["vesdyn/adhesion.py", "vesdyn/relaxation.py", "vesdyn/spreading.py", "vesdyn/case.py"],
        ["vesdyn/adhesion.py", "vesdyn/case.py"],
        "Shape, integral and steepest slope stand side by side; potential, mass bound and drift ask for them.",
    ),
    (
        "a solver of the balance",
        ["vesdyn/relaxation.py", "vesdyn/spreading.py", "vesdyn/modes.py", "vesdyn/case.py"],
        ["+vesdyn/newton.py", "vesdyn/spreading.py", "vesdyn/case.py"],
        "A function of a `Balance` and an entry of METHODS; the tests of the methods take it by themselves.",
    ),
    (
        "another substrate",
        [
            "vesdyn/contact.py", "vesdyn/adhesion.py", "vesdyn/relaxation.py", "vesdyn/spreading.py", "vesdyn/front.py",
            "vesdyn/modes.py", "vesdyn/surface.py", "vesdyn/meridian.py",
        ],
        ["vesdyn/substrate.py", "vesdyn/surface.py", "vesdyn/meridian.py"],
        "Gap, held and landed are asked for; the two bodies still cut their contour at a height.",
    ),
    (
        "binding kinetics",
        [
            "vesdyn/adhesion.py", "vesdyn/receptors.py", "vesdyn/spreading.py", "vesdyn/relaxation.py",
            "vesdyn/case.py",
        ],
        ["vesdyn/receptors.py", "vesdyn/adhesion.py", "vesdyn/spreading.py", "vesdyn/case.py"],
        "A field of `State`, which checkpoints and rejected steps then know; its rate in receptors; its load in adhesion.",
    ),
    (
        "a start mesh",
        ["vesdyn/meshing.py", "vesdyn/spreading.py", "vesdyn/case.py"],
        [],
        "`mesh: {file: cell.ply}` or `axes`; a new family of shapes: meshing and case.",
    ),
    (
        "a kind of body",
        [
            "+vesdyn/meridian.py", "vesdyn/spreading.py", "vesdyn/planning.py", "vesdyn/pictures.py", "vesdyn/storage.py",
            "vesdyn/case.py",
        ],
        ["+vesdyn/meridian.py", "vesdyn/kinds.py", "vesdyn/case.py"],
        "The kernels that body lists, and a line in kinds; drawing, storing and planning ask the kind.",
    ),
    (
        "a column of the history",
        ["vesdyn/spreading.py", "README.md"],
        [],
        "`vesdyn.Column`, an argument; for everybody: a line of COLUMNS in diagnostics.",
    ),
    (
        "a figure",
        ["+plots/thickness.py", "tests/figures/test_plots.py"],
        ["+plots/other_laws.py", "tests/figures/test_plots.py"],
        "Constants, `measure` and `draw`; make and the tests find the script, the latter want a tiny setting of it.",
    ),
    (
        "a callback",
        ["vesdyn/run.py"],
        [],
        "`on_step`, an argument, or a loop over `vesdyn.simulate`.",
    ),
]  # fmt: skip
EXTENSIONS = {  # module: functions and classes of its own, words by which another line speaks of it
    "double well": {
        "adhesion": (
            ("Piecewise", "piecewise", "piecewise_shape", "piecewise_integral", "piecewise_slope", "double_well"), "double_well",
        ),
        "case": ((), r"double_well|^    law: |^    (well|barrier|tail): |adhesion\.well"),
    },
    "ligands in patterns": {
        "adhesion": (("_even", "_disc", "_stripe", "_stripes", "_squares", "_step", "ligand_density"), r"\bligands\b|PATTERNS"),
        "balance": ((), r"\bligands\b"),
        "receptors": ((), r"\bligands\b"),
        "spreading": ((), r"\bligands\b"),
        "diagnostics": ((), r"\bligands\b|ligand_density"),
        "modes": ((), r"\bligands\b"),
        "planning": ((), r"\bligands\b"),
        "case": (("Ligands", "_pattern"), r"\bligands\b|_pattern"),
    },
}  # fmt: skip


def modules():
    """Names of the modules of the package, in the order of the alphabet."""
    return sorted(file.stem for file in PACKAGE.glob("*.py") if file.stem != "__init__")


def imported_modules(source):
    """Names of the modules of the package that the text of one imports, wherever it does."""
    found = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            if node.level:
                raise ValueError("imports are absolute")
            names = [node.module, *(f"{node.module}.{alias.name}" for alias in node.names)]
        else:
            continue
        found |= {name.split(".")[1] for name in names if name.startswith("vesdyn.")}
    return found & set(modules())


def rung(module):
    """The rung of ``module``, counted from 0 at the bottom; ValueError where it has none or two."""
    (found,) = [i for i, names in enumerate(LADDER) if module in names]
    return found


def what_lives_there(module):
    """First line of the docstring of ``module``."""
    return ast.get_docstring(ast.parse((PACKAGE / f"{module}.py").read_text())).split("\n")[0]


def page():
    """The text of docs/house.md."""
    imports = {module: imported_modules((PACKAGE / f"{module}.py").read_text()) for module in modules()}
    upward = [(a, b) for a in imports for b in imports[a] if rung(b) >= rung(a)]
    lines = [
        "# The house",
        "",
        "Written by `python docs/house.py` from the sources; `tests/test_layering.py` fails where it is not up to date.",
        "",
        "## Rungs",
        "",
        f"A module imports from lower rungs only. Measured: {len(imports)} modules on {len(LADDER)} rungs,"
        f" {sum(map(len, imports.values()))} imports, {len(upward)} upward or to the same rung.",
        "",
        "| rung | module | what lives there | imports |",
        "|---|---|---|---|",
    ]
    for module in sorted(imports, key=lambda m: (rung(m), m)):
        names = ", ".join(f"`{name}`" for name in sorted(imports[module], key=lambda m: (rung(m), m))) or "–"
        lines.append(f"| {rung(module)} | `{module}` | {what_lives_there(module)} | {names} |")
    lines += [
        "",
        "## What a newcomer touches",
        "",
        f"Before: at commit {BEFORE}. After: now. A file in italics is one of the newcomer's own, here an example that exists.",
        "",
        "| wish | before | after | how |",
        "|---|---|---|---|",
    ]
    for wish, before, after, how in WISHES:
        lines.append(f"| {wish} | {_shown(before)} | {_shown(after)} | {how} |")
    return "\n".join(lines) + "\n"


def lines_of(module, names, words):
    """Lines of ``module`` in the functions and classes ``names``, and others, no comments, that match ``words``."""
    source = (PACKAGE / f"{module}.py").read_text()
    own = set()
    for node in ast.walk(ast.parse(source)):
        if getattr(node, "name", None) in names:
            first = min([node.lineno, *(decorator.lineno for decorator in node.decorator_list)])
            own |= set(range(first, node.end_lineno + 1))
    spoken = {i for i, line in enumerate(source.splitlines(), 1) if re.search(words, line)}
    return len(own | spoken)


def counted():
    """The table of docs/extending.md, as text."""
    lines = ["| extension | lines | where |", "|---|---|---|"]
    for extension, parts in EXTENSIONS.items():
        counts = {module: lines_of(module, *what) for module, what in parts.items()}
        where = ", ".join(f"`{module}` {count}" for module, count in counts.items())
        lines.append(f"| {extension} | {sum(counts.values())} | {where} |")
    return "\n".join(lines)


def extending():
    """The text of docs/extending.md with the table as it is now."""
    before, _, rest = EXTENDING.read_text().partition("<!-- counted -->\n")
    return f"{before}<!-- counted -->\n{counted()}\n<!-- end -->{rest.partition('<!-- end -->')[2]}"


def _shown(files):
    names = ", ".join(f"*{file[1:]}*" if file.startswith("+") else file for file in files)
    return f"{len(files)}: {names}" if files else "none"


if __name__ == "__main__":
    PAGE.write_text(page())
    EXTENDING.write_text(extending())
