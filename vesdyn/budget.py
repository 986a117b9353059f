"""The error budget: how the accuracy wish is shared out, and what each knob of the numerics costs.

The wish is the relative error of the binding area once this has passed a tenth of its final value (`accuracy` of a
case). The costs were measured on the paper's cases (T_max d_c/(2K) from 0.008 to 0.25, d_c 0.06 to 0.18, q 1.5 to 8)
and on random scenes (docs/promise.md) against finer solutions; what a mesh costs is a matter of the kind of body (`vesdyn.body.MeshError`).
"""

SHARES = {"mesh": 0.4, "step": 0.5, "tolerance": 0.1}  # of the wish
TOLERANCE_ERROR = 2.5  # of the binding area, per unit of the solver's tolerance
TOLERANCE_PER_ACCURACY = SHARES["tolerance"] / TOLERANCE_ERROR  # that `auto` takes
WISHED_FROM = 0.1  # of the final binding area: the wish holds once this is reached
STEP_ERROR = 0.05  # relative difference of a state from the one seen ahead, per unit of accuracy: costs the step's share
FIXED_STEP_ERROR = {1: 25.0, 2: 9.0}  # of the binding area, per a0^2/D of a fixed step, by order, once t > 10 steps
