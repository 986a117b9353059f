"""The error budget: how the accuracy wish is shared out, and what each knob of the numerics costs.

The wish is the relative error of the binding area after the first hundredth of a0^2/D (`accuracy` of a case). The
costs were measured on the paper's cases (T_max d_c/(2K) from 0.008 to 0.25, d_c 0.06 to 0.18, q 1.5 to 8) against
their finest solutions (README, "Accuracy"); what a mesh costs is a matter of the kind of body (`vesdyn.body.MeshError`).
"""

SHARES = {"mesh": 0.4, "step": 0.5, "tolerance": 0.1}  # of the wish
TOLERANCE_ERROR = 2.5  # of the binding area, per unit of the solver's tolerance
TOLERANCE_PER_ACCURACY = SHARES["tolerance"] / TOLERANCE_ERROR  # that `auto` takes
STEP_ERROR = 0.003  # distance [a0] of a shape from the one seen ahead, per unit of accuracy: costs the share of the step
FIXED_STEP_ERROR = {1: 25.0, 2: 9.0}  # of the binding area, per a0^2/D of a fixed step, by order, once t > 10 steps
