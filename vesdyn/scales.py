"""What the numbers of a case are in SI, and the few ratios that alone decide its motion."""

from typing import NamedTuple

from vesdyn.adhesion import LAWS, integral
from vesdyn.case import UNIT_OF, Case


class Ratio(NamedTuple):
    """A number without dimension that decides how a scene moves."""

    symbol: str
    meaning: str
    value: float


def ratios(case: Case) -> tuple[Ratio, ...]:
    """The `Ratio` s of ``case``: two scenes in which they agree move alike.

    W = T_max int f is the adhesion energy of an area at the initial density, T_max d_c / 2 for the linear law (Liu et
    al. 2007, equation 1).
    """
    adhesion, membrane = case.adhesion, case.membrane
    energy = adhesion.traction * integral(LAWS[adhesion.law](adhesion), 0.0)
    reach = adhesion.traction * adhesion.cutoff
    return (
        Ratio("W/K", "adhesion energy over shear modulus: how soft the membrane is", energy / membrane.shear_modulus),
        Ratio("L W", "binding energy of a receptor [kT], drift number times W", case.drift_number * energy),
        Ratio("eta D/(T_max d_c)", "drag: how slow the membrane is against diffusion", case.drag / reach if reach else float("nan")),
        Ratio("d_c/a0", "cutoff", adhesion.cutoff),
        Ratio("h/a0", "thickness", membrane.thickness),
        Ratio("q", "ligands for each receptor", adhesion.ligand_ratio),
        Ratio("prestretch", "stretch at t = 0", membrane.prestretch),
        Ratio("axes", "equatorial over polar axis at t = 0", case.mesh.axes[0] / case.mesh.axes[1]),
    )


def told(case: Case) -> str:
    """The scales of ``case``, its keys in SI and its `ratios`, as lines of text."""
    scales, lines = case.scales, [f"{case.name}: lengths in a0, times in a0^2/D, energies in kT, densities in c_r0"]
    if scales is None:
        lines.append("  no units are given; with `units: {diameter: 10 um, diffusivity: 0.01 um^2/s}` all is told in SI, too")
    else:
        lines.append("one unit of the model is")
        for what, unit in (
            ("length", "a0"),
            ("time", "a0^2/D"),
            ("energy", "kT"),
            ("modulus", "kT/a0^2"),
            ("traction, pressure", "kT/a0^3"),
            ("drag", "kT D^-1 a0^-2"),
            ("receptor density", "c_r0"),
        ):
            lines.append(f"  {what:<20} {unit:<16} {scales.shown(1.0, unit) or 'units.receptor_density is not given'}")
        lines.append("keys of the case")
        idle = case.idle()
        for key, unit in UNIT_OF.items():
            value = case.get(key)
            if isinstance(value, (int, float)) and value and key not in idle:
                lines.append(f"  {key:<24} {f'{value:.6g} {unit}':<26} {scales.shown(value, unit) or ''}".rstrip())
    lines.append("ratios that alone decide the motion")
    lines += [f"  {ratio.symbol:<20} {ratio.value:<12.4g} {ratio.meaning}" for ratio in ratios(case)]
    lines.append("the same motion: shear_modulus, traction and drag times any number, drift_number over it")
    if scales is not None and scales.receptor_density:
        alone = 1.0 / (scales.receptor_density * scales.diameter**2)
        lines.append(
            f"a receptor that bears its own share of the traction has the drift number 1/(c_r0 a0^2) = {alone:.4g};"
            f" this case has {case.drift_number:.4g}"
        )
    return "\n".join(lines)
