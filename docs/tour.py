# %% [markdown]
# # A tour of the Python door
#
# Cells of a notebook (`# %%`), read in order by editors that know them; `python docs/tour.py` runs them all in half a
# minute and leaves `tour/tour.png`. Units throughout: length a0 (the initial diameter), time a0²/D, energy kT, density c_r0.

# %%
import matplotlib
import numpy as np

import vesdyn

matplotlib.use("Agg")  # leave this out to see pictures on the screen
import matplotlib.pyplot as plt

# %% [markdown]
# ## Load
# A shipped case by its name, or a file of your own. It is frozen and knows what was given and what is a default.

# %%
typical = vesdyn.load_case("typical-auto")
print(typical.name, typical.membrane.shear_modulus, typical.adhesion.traction)

# %% [markdown]
# ## Change
# A change makes another case. What cannot be is one sentence, with the key and what to do.

# %%
case = typical.changed(name="softer", accuracy=0.03, **{"membrane.shear_modulus": 1.2, "output.frames": [0.02]})
try:
    typical.changed(**{"adhesion.tracton": 3.0})
except vesdyn.CaseError as error:
    print(error)

# %% [markdown]
# What will be computed, and what that leaves out:

# %%
plan = vesdyn.plan(case)
print(*plan.decisions, sep="\n")

# %% [markdown]
# ## Simulate
# Step by step, nothing stored. Each moment knows its time, its shape `x`, the receptors' `density`, and every column of
# the history by name; a column of your own is one more. Stop whenever you have seen enough.

# %%
gathered = vesdyn.Column(
    "gathered",
    "1",
    "share of the receptors in the contact",
    lambda m: m.state.number[m.x[:, -1] == 0].sum() / m.sim.number_0,
)
for moment in vesdyn.simulate(plan.case, columns=[gathered]):
    if moment["binding_area"] > 0.3:
        break
print(f"t = {moment.time:.4f}: A = {moment['binding_area']:.3f} holds {moment['gathered']:.0%} of the receptors")

# %% [markdown]
# ## Run, with a callback
# The same, kept in a directory. What the callback returns, if anything, is the reason to stop. Given again, the same
# command goes on from there, to the same bits as if it had never stopped.


# %%
def enough(moment):
    """Stop once the binding area has reached 0.3 a0²."""
    return "A = 0.3" if moment["binding_area"] > 0.3 else None


outcome = vesdyn.run_case(plan.case, "tour/softer", on_step=enough, columns=[gathered], progress=False)
print(outcome.state, "-", outcome.reason, f"A = {outcome.binding_area:.3f} after {outcome.steps} steps")

# %%
outcome = vesdyn.run_case(plan.case, "tour/softer", columns=[gathered], progress=False)
print(outcome.state, f"- A = {outcome.binding_area:.3f} at t = {outcome.time:.2f}")

# %% [markdown]
# ## Open
# At any time, also while it is still running somewhere else.

# %%
run = vesdyn.open_run("tour/softer")
print(run, *(f"{time:g}" for time in run.times))
history, early, late = run.history, run.profile(0.02), run.profile(run.times[-1])
print("units:", {name: history.units[name] for name in ("time", "binding_area", "pressure", "gathered")})

# %% [markdown]
# ## Plot
# A(t) with the moment of the stop, and the density along the membrane early and late.

# %%
figure, (left, right) = plt.subplots(1, 2, figsize=(7.2, 3.0), layout="constrained")
left.plot(history["time"], history["binding_area"], color="#12355b")
left.plot(moment.time, moment["binding_area"], "o", color="#b5382a", label="stopped, and gone on")
left.set(xlabel="time $t$ [$a_0^2/D$]", ylabel="binding area $A$ [$a_0^2$]", xlim=(0, 1), ylim=(0, None))
left.legend(frameon=False, loc="lower right")
for profile, time, look in ((early, 0.02, "--"), (late, run.times[-1], "-")):
    right.plot(profile.arc, profile.density, look, color="#12355b", label=f"$t$ = {time:.2g}")
right.axhline(1.0, color="0.7", linewidth=0.7)
right.set(xlabel="arc from the middle of the contact [$a_0$]", ylabel="receptor density $c$ [$c_{r0}$]")
right.set(xlim=(0, 1.2), ylim=(0, None))
right.legend(frameon=False)
figure.savefig("tour/tour.png", dpi=200)
print("densest", f"{np.max(early.density):.2f}", "at r =", f"{early.radius[np.argmax(early.density)]:.2f}")
