"""Fig. 8, measured instead of sketched: the front's radius of curvature and its spreading angle against time.

Where the membrane leaves the plane it turns within a few hundredths of a0, and then rises almost straight through the
range of the traction. So

    spreading angle     between substrate and membrane, at the height d_c / 2;
    radius of curvature  arc / angle turned, on the meridian between the heights 0.02 d_c (where membrane counts as
                         bound) and 0.2 d_c.

The angle is that of the nearly straight rise; how much it depends on the height is printed (ANGLES_AT). The radius
belongs to its arc: without bending stiffness the turn is the sharper, the closer to the plane it is looked at.
"""

import numpy as np
import paper
import study
from paper import LOOKS

CASES = ("typical-auto", "fig4-K0.603", "fig4-K3.018")
ACCURACY = 0.01
TIMES = tuple(float(f"{t:.4g}") for t in np.geomspace(0.002, 1.0, 55))
SHOWN = 0.008, 0.044, 0.128, 0.56  # nearest of the times, drawn in the first panel
ARC = 0.02, 0.2  # heights / d_c between which the membrane turns
ANGLE_AT = 0.5  # height / d_c
ANGLES_AT = 0.25, 1.0  # heights / d_c at which it is compared


def lower_side(x):
    """Height, tangent angle and arc length, rising from the plane, of a meridian ``x`` (n_nodes, 2) [a0]."""
    r, z = x.T
    last_down = np.flatnonzero(z <= z.min() + 1e-12)[-1]
    widest = np.argmax(r)
    r, z = r[last_down : widest + 1], z[last_down : widest + 1]
    arc = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(r), np.diff(z)))])
    angle = np.interp(arc, 0.5 * (arc[1:] + arc[:-1]), np.arctan2(np.diff(z), np.diff(r)))
    return z, angle, arc


def front_shape(x, cutoff):
    """Radius of curvature [a0], spreading angle [rad] and the angles at the heights ANGLES_AT of a meridian ``x``."""
    z, angle, arc = lower_side(x)
    (low, high), (start, end) = (np.interp(np.multiply(ARC, cutoff), z, values) for values in (angle, arc))
    return (end - start) / (high - low), *np.interp(np.multiply((ANGLE_AT, *ANGLES_AT), cutoff), z, angle)


def measure(name, times=TIMES, changes=None):
    """Times (n,); radius and angles (n, 4) as in `front_shape`, at ACCURACY and finer; meridians of the first."""
    wish = {"model": "axisymmetric", "output.frames": list(times), **(changes or {})}
    accuracies = ACCURACY, ACCURACY * paper.FINER
    study.prepare([(name, {**wish, "accuracy": accuracy}) for accuracy in accuracies])
    cutoff = paper.wished(name, {}).adhesion.cutoff
    frames = [study.frames(name, {**wish, "accuracy": accuracy})[1:] for accuracy in accuracies]
    shapes = [np.array([front_shape(f["position"], cutoff) for f in some]) for some in frames]
    n = min(map(len, shapes))
    t = np.array([f["time"] for f in frames[0][:n]])
    same = np.array([abs(f["time"] / time - 1) < 0.01 for f, time in zip(frames[1], t)])  # ends may differ
    return t[same], shapes[0][:n][same], shapes[1][:n][same], [f["position"] for f in frames[0][:n]]


def goes_one_way(t, values, error, sign):
    """True where ``values`` only rise (``sign`` +1) or only fall (-1) from t = 0.01, but for their ``error``."""
    late = sign * values[t >= paper.START]
    return bool(np.all(late >= np.maximum.accumulate(late) - error) and late[-1] - late[0] > error)


def draw(out=study.OUT):
    measured = {name: measure(name) for name in CASES}
    cutoff = paper.wished(CASES[0], {}).adhesion.cutoff
    for name, (t, coarse, fine, _) in measured.items():
        rows = [int(np.argmin(abs(t - time))) for time in SHOWN]
        study.table(
            f"{name}: radius of curvature [a0], spreading angle, angles at {ANGLES_AT} d_c [°]; two errors",
            ["t", "radius", "angle", "lower", "upper", "error", "error"],
            [(float(t[i]), float(coarse[i, 0]), *map(float, np.degrees(coarse[i, 1:])), *map(float, abs(fine - coarse)[i, :2] * (1, 57.3)))
             for i in rows],
        )  # fmt: skip

    def fill(shapes, radii, angles):
        t, _, _, meridians = measured[CASES[0]]
        for time, (color, line) in zip(SHOWN, LOOKS):
            x = meridians[int(np.argmin(abs(t - time)))]
            r, z = x.T
            front = r[np.flatnonzero(z <= ARC[0] * cutoff)[-1]]
            near = (z < 1.6 * cutoff) & (r > front - cutoff)
            shapes.plot(r[near] - front, z[near], color=color, linestyle=line, label=f"$t$ = {time:g}")
        for height in (*ARC, ANGLE_AT):
            shapes.axhline(height * cutoff, color="0.75", linewidth=0.5, zorder=0)
        shapes.fill_between((-0.1, 0.1), -0.012, 0.0, color="0.85", linewidth=0)
        shapes.set(
            xlabel="$r - r_\\mathrm{front}$ [$a_0$]",
            ylabel="gap $z$ [$a_0$]",
            aspect="equal",
            xlim=(-0.1, 0.1),
            ylim=(-0.012, 0.15),
        )
        shapes.legend(loc="upper left", handlelength=2.0)
        for (name, (t, coarse, fine, _)), (color, line) in zip(measured.items(), LOOKS):
            law = paper.wished(name, {})
            label = f"$K$ = {law.membrane.shear_modulus:g}, $T_\\mathrm{{max}}$ = {law.adhesion.traction:g}"
            for ax, value, error in ((radii, coarse[:, 0], abs(fine - coarse)[:, 0]),
                                     (angles, np.degrees(coarse[:, 1]), np.degrees(abs(fine - coarse)[:, 1]))):  # fmt: skip
                ax.semilogx(t, value, color=color, linestyle=line, label=label)
                ax.fill_between(t, value - error, value + error, color=color, alpha=0.25, linewidth=0)
        radii.set(xlabel=paper.TIME, ylabel="radius of curvature at the front [$a_0$]")
        angles.set(xlabel=paper.TIME, ylabel="spreading angle [°]", ylim=(0.0, 90.0))
        radii.set_ylim(0.0, 1.4 * radii.get_ylim()[1])
        for ax in (radii, angles):
            study.plain(ax.xaxis, (0.002, 0.01, 0.03, 0.1, 0.3, 1.0))
            ax.legend(loc="upper right" if ax is radii else "lower right")

    study.panels(fill, "figure8", out, size=(7.2, 2.8), shape=(1, 3))


if __name__ == "__main__":
    draw(study.command_line())
