"""A vesicle spreads on a substrate, held by receptors that diffuse in its membrane to the ligands below.

Units throughout: length a0 (the initial diameter), time a0^2/D (D the receptors' diffusivity), energy kT,
receptor density c_r0 (its initial value).
"""

from importlib.metadata import PackageNotFoundError, version

try:
    __version__ = version("vesdyn")
except PackageNotFoundError:  # run from a source tree that is not installed
    __version__ = "unknown"
