"""The mutations that `make mutate` tries: by kind and file, what is broken, the text, its replacement, and the tests.

The text must stand exactly once in the file. Of the tests (arguments of pytest, paths from tests/ on, separated by
spaces) those under `verify` are left out; they should be few and fast. A mutation of a kernel compiles all that its tests
use anew: where that takes longer than the tests themselves, they are interpreted (PY). Where a text has changed, put the new one here; `tests/test_mutate.py` says which.
"""

PY = "NUMBA_DISABLE_JIT=1 "
BODIES = PY + "test_bodies.py::"
FREELY = "faults/test_damage.py::test_run_goes_on_to_the_same_bits_or_says_how_to_begin_anew"
LOCKS = "faults/test_neighbours.py::test_run_without_locks_of_the_file_system"
STALE_LOCKS = "faults/test_neighbours.py::test_lock_file_of_a_dead_owner_is_taken_over"
OTHERS_CACHE = "faults/test_foreign.py::test_cache_where_others_may_write_is_refused"
GRADIENT = BODIES + "test_elastic_force_is_the_gradient_of_the_energy_to_second_order"
START_STATE = BODIES + "test_start_state_is_the_reference_stretched_uniformly"
FLUID_BOUND = BODIES + "test_bound_of_the_fluid_alone"
BENDING_BOUND = BODIES + "test_bound_of_bending_alone[axisymmetric-rings-start-0.0]"
NO_CASE = "test_case_file.py::test_files_that_are_no_case"
GIVE_WAY = "test_case_file.py::test_less_specific_keys_give_way"
YAML_NUMBERS = "test_case_file.py::test_numbers_are_those_of_yaml_1_2"
CONTINUED = "test_case.py::test_what_may_change_when_a_run_goes_on"
DISK_FULL = "faults/test_write_errors.py::test_disk_full_at_any_call"
SAME_BITS = "test_run.py::test_interrupted_run_goes_on_to_the_same_bits"
VOLUME = PY + "test_relaxation.py::test_one_iteration_closes_the_volume_to_first_order"
LEDGER = "test_scheme.py::test_energy_is_balanced"
INSIDE = "stability/test_fictitious_mass.py::test_just_inside_the_critical_mass[axisymmetric-membrane-viscous]"
SYNCS = "test_files.py"
NOTES = "test_run.py::test_mesh_step_and_belief_that_missed_the_wish_are_told_after_a_run"

TABLE = {
    "Membrane": {
        "neo_hookean.py": [
            ("the stretch of the thickness has no energy", "(I1 + l3 * l3 - 3.0)", "(I1 - 2.0)", "test_neo_hookean.py"),
            ("the pressure in the material has the other sign", "return -K * l3 * l3 * l3", "return K * l3 * l3 * l3",
             "test_neo_hookean.py"),
            ("the second derivative lacks its factor", "3.0 * K * (l3 * l3)", "K * (l3 * l3)", "test_neo_hookean.py"),
            ("tension per reference length", "(stretch * stretch - l3 * l3) * l3", "(stretch * stretch - l3 * l3)",
             "test_neo_hookean.py"),
        ],
        "koiter.py": [
            ("stiffness of a material without Poisson's ratio", "thickness**2 / 3.0", "thickness**2 / 4.0", PY + "test_koiter.py"),
            ("the mixed term of bending is dropped", "rho_22 * rho_22 + rho_11 * rho_22", "rho_22 * rho_22", PY + "test_koiter.py"),
            ("twice the twisting moment", ", B * rho_12", ", 2.0 * B * rho_12", PY + "test_koiter.py"),
        ],
        "meridian.py": [
            ("the azimuthal tension is dropped", "meridional * dr - hoop", "meridional * dr", GRADIENT),
            ("the hoop term of the curvature is dropped", "-x[i, 0] * g[1] / G * per_RR if", "0.0 if", GRADIENT),
            ("the moment has the other sign", "C[0] * f - D[0] * m1", "C[0] * f + D[0] * m1", GRADIENT),
            ("the moments along the tangent are dropped", "f = (m1 * (h[0]", "f = 0.0 * (m1 * (h[0]", GRADIENT),
            ("half the gradient of the volume", "nodal[b, 3] += disc", "nodal[b, 3] += 0.5 * disc",
             BODIES + "test_volume_gradient_is_that_of_the_volume_to_second_order"),
            ("wrong nodal areas", "nodal[a, 4] += np.pi / 3.0 * l * (2.0 * ra + rb)", "nodal[a, 4] += np.pi / 3.0 * l * (ra + rb)",
             BODIES + "test_nodal_areas_sum_to_the_area"),
            ("the prestretch is forgotten", "np.linalg.norm(np.diff(x, axis=0), axis=1) / prestretch",
             "np.linalg.norm(np.diff(x, axis=0), axis=1)", START_STATE),
            ("the reference area forgets the prestretch", "nodal[:, 4] / prestretch**2", "nodal[:, 4]", START_STATE),
            ("a meridian across its axis passes for a shape", "return np.nan if inverted else volume", "return volume",
             BODIES + "test_a_meridian_across_its_axis_is_no_shape"),
            ("the poles leave the axis", "nodal[pole, 0] = nodal[pole, 2] = 0.0", "pass", BODIES + "test_nothing_moves_the_poles_of_a_meridian_off_the_axis"),
            ("the bound of the stiffness forgets the fluid", "abs(pressure) * 2.0 * np.pi", "0.0 * np.pi", FLUID_BOUND),
            ("the bound of bending is half", "(s * all_s + m * all_c", "(0.5 * s * all_s + m * all_c", BENDING_BOUND),
            ("receptors in contact move", "if x[a, 1] <= 0.0 and x[b, 1] <= 0.0:", "if False:",
             BODIES + "test_an_element_conducts_nothing_when_all_its_nodes_touch"),
            ("twice the conductance", "= np.pi * (x[a, 0] + x[b, 0]) / np.hypot(", "= 2.0 * np.pi * (x[a, 0] + x[b, 0]) / np.hypot(",
             BODIES + "test_cone_conductances_are_area_over_squared_length"),
            ("the kink at the front is straight", "curvature = 2.0 * (slope_2 - slope) / (length_1 + length_2)", "curvature = 0.0",
             BODIES + "test_curvature_beyond_the_kink_of_a_meridian_counts"),
            ("the area below a level is that of a cylinder", "+ share[e] * (x[b, 0] - x[a, 0]))", ")",
             BODIES + "test_cone_area_below_a_level_against_fine_strips"),
            ("the membrane that folds is the other one", "and x[b, 0] < x[a, 0]", "and x[b, 0] > x[a, 0]", PY + "test_folding.py::test_pleat_is_found_with_its_area"),
        ],
        "surface.py": [
            ("twice the tension of the area", "g = 0.5 * per_A", "g = per_A", GRADIENT),
            ("wrong nodal areas", "np.repeat(area / 3.0, 3)", "np.repeat(area / 2.0, 3)", START_STATE),
            ("one corner has no area", "nodal[c, 6] += A", "nodal[c, 6] += 0.0", BODIES + "test_nodal_areas_sum_to_the_area"),
            ("the prestretch is forgotten", "mesh.area_faces / prestretch**2", "mesh.area_faces", START_STATE),
            ("half the gradient of the volume", "nodal[c, 5] += Sz", "nodal[c, 5] += 0.5 * Sz",
             BODIES + "test_volume_gradient_is_that_of_the_volume_to_second_order"),
            ("receptors in contact move", "if x[a, 2] <= 0.0 and x[b, 2] <= 0.0 and x[c, 2] <= 0.0:", "if False:",
             BODIES + "test_an_element_conducts_nothing_when_all_its_nodes_touch"),
            ("clipped conductances are not counted", "clipped += conductance[i] < -1e-9", "clipped += 0", BODIES + "test_triangle_conductances_against_the_angles_facing_each_edge"),
            ("negative conductances stay", "conductance[i] = 0.0", "pass", BODIES + "test_triangle_conductances_against_the_angles_facing_each_edge"),
            ("both principal tensions are the larger", "principal_tension(body.shear_modulus, smaller, l3)",
             "principal_tension(body.shear_modulus, larger, l3)",
             BODIES + "test_triangle_tensions_against_the_singular_values_of_the_deformation_gradient"),
            ("the area of a triangle with two corners below", "A * (1.0 - (1.0 - first) * (1.0 - second))", "A * 0.5 * (first + second)",
             BODIES + "test_triangle_area_below_a_level_against_clipped_polygons"),
            ("the membrane that folds is the other one", "if S[2] > 0.0:", "if S[2] < 0.0:", PY + "test_folding.py::test_pleat_is_found_with_its_area"),
            ("the bound of the stiffness forgets the fluid", "0.5 * abs(pressure) * np.sqrt(max(la, lb, lc))", "0.0", FLUID_BOUND),
        ],
        "curvature.py": [
            ("the moment has the other sign", "- w[k, 2] * m11 - w[k, 3] * m22", "+ w[k, 2] * m11 - w[k, 3] * m22", GRADIENT),
            ("the reaction of bending is dropped", "kept += force", "kept += 0.0", BODIES + "test_no_net_force_and_no_net_torque"),
            ("the start shape is not free of moments", "dot(n, h11) - rest[0]", "dot(n, h11)",
             BODIES + "test_start_state_is_free_of_moments"),
            ("constant moments do not balance", "second += _balancing(", "second += 0.0 * _balancing(",
             PY + "test_curvature.py::test_constant_moments_balance_much_better_than_in_plain_least_squares"),
            ("the bound of bending forgets the turning normal", "+ m[k] * all_c + c[k] * all_m", "", PY + "test_curvature.py::test_bounds_are_those_of_the_plain_form"),
        ],
        "meshing.py": [
            ("a mesh is not scaled to its volume", "np.array(mesh.vertices) * (volume / mesh.volume) ** (1.0 / 3.0)", "np.array(mesh.vertices)",
             "test_meshing.py::test_sphere_is_closed_outward_and_of_exact_volume"),
            ("an inside-out mesh passes", "if not mesh.volume > 0.0:", "if False:", "test_meshing.py::test_bad_meshes_are_refused_with_the_reason"),
            ("edges do not grow away from the front", "front_edge + GROWTH * (arc - fine)", "front_edge + 0.0 * (arc - fine)", "test_meshing.py::test_edges_grow_by_a_quarter_of_the_way_from_the_fine_zone"),
            ("another mesh in the file passes for that of the case", "if digest is not None and hashlib", "if False and hashlib", "test_start_shape.py::test_content_of_the_mesh_decides_the_case_and_not_its_path test_start_shape.py::test_run_stores_the_digest_of_its_mesh"),
        ],
    },
    "Adhesion and contact": {
        "adhesion.py": [
            ("saturation is ignored in the traction", "bound = min(density, adhesion.ligand_ratio * ligands)", "bound = density",
             PY + "test_adhesion.py::test_traction_separation_law"),
            ("saturation is ignored in the load", "else min(number, adhesion.ligand_ratio * ligands * area)", "else number",
             PY + "test_adhesion.py"),
            ("frozen receptors follow the membrane", "pulling = area if adhesion.frozen else", "pulling = number if adhesion.frozen else",
             PY + "test_adhesion.py::test_frozen_receptors_pull_on_the_current_area_whatever_their_number"),
            ("twice the integral of the linear law", "0.5 * law.cutoff * near * near", "law.cutoff * near * near", PY + "test_adhesion.py"),
            ("the double well's integral ends with its piece", "return law.beyond[k + 1] + 0.5", "return 0.5", PY + "test_adhesion.py"),
            ("the barrier attracts", "-section.barrier", "section.barrier",
             PY + "test_adhesion.py::test_double_well_attracts_repels_and_attracts"),
            ("the steepest slope is the steepest rise", "np.max(np.abs(law.slope))", "np.max(law.slope)", PY + "test_adhesion.py"),
            ("the potential has the other sign", "return -full_load(", "return full_load(", PY + "test_adhesion.py"),
            ("half the adhesion work", "work += 0.5 * (before + after)", "work += 0.25 * (before + after)", PY + "test_adhesion.py"),
            ("the drift has the other sign", "exponent[i] = drift_number", "exponent[i] = -drift_number",
             PY + "test_adhesion.py"),
            ("the drift does not see the ligands", "adhesion.traction * ligands[i] * integral", "adhesion.traction * integral",
             PY + "test_adhesion.py"),
            ("the law reaches beyond its cutoff", "return max(0.0, 1.0 - max(gap, 0.0) / law.cutoff)", "return 1.0 - max(gap, 0.0) / law.cutoff",
             PY + "test_adhesion.py"),
            ("the border of a pattern lies inside it", "np.clip(0.5 + inside / section.blur", "np.clip(inside / section.blur",
             PY + "test_adhesion.py::test_border_is_straight_across_the_blur"),
            ("a repulsed receptor counts as released", "number[i] * abs(shape(", "number[i] * (shape(", PY + "test_adhesion.py"),
        ],
        "substrate.py": [
            ("contact pulls", "return touches(gap) and load <= 0.0", "return touches(gap)", PY + "test_substrate.py"),
            ("nodes pass the plane", "if gap + move < 0.0:", "if gap + move < -1.0:", PY + "test_substrate.py"),
            ("nodes on the plane are looked ahead off it", "np.where(touches(gaps(x)), 0.0, np.maximum(ahead, 0.0))", "np.maximum(ahead, 0.0)",
             PY + "test_substrate.py"),
        ],
        "body.py": [
            ("the membrane is not extended over its last edge", "max(straight, 1.0 - distance / length)", "straight",
             BODIES + "test_kink_of_a_meridian_is_found_inside_its_edge"),
        ],
        "front.py": [
            ("a displaced front turns triangles over", "np.clip(share, -most, most)", "share", "test_perturbation.py::test_rim_of_the_contact_moves_along_its_radius_and_nothing_else"),
            ("a front is displaced outwards only", "rng.uniform(-largest, largest", "rng.uniform(0.0, largest",
             "test_perturbation.py::test_shares_are_uniform_and_follow_the_seed"),
            ("the angle of spreading is that of the contact", "np.multiply((ANGLE_AT, *ANGLES_AT), cutoff)", "np.multiply((0.0, *ANGLES_AT), cutoff)",
             PY + "test_front.py::test_front_shape_of_a_circular_turn"),
        ],
    },
    "Receptors": {
        "receptors.py": [
            ("the drift has the other sign", "(scratch.exponent[i] - scratch.exponent[j])", "(scratch.exponent[j] - scratch.exponent[i])",
             "test_receptors.py::test_zero_flux_state_is_nodally_exact"),
            ("the saturation of the drift is ignored", "bound = 1.0 if mean <= ligand_ratio * below else ligand_ratio * below / mean", "bound = 1.0",
             "test_receptors.py::test_saturated_zero_flux_state_has_the_slope_of_the_ligands"),
            ("the series of Bernoulli's function has a wrong sign", "1.0 - 0.5 * u + u * u / 12.0", "1.0 + 0.5 * u + u * u / 12.0",
             PY + "test_receptors.py::test_bernoulli_against_forty_digits"),
            ("receptors are lost on the way", "number[j] += flux", "number[j] += 0.999 * flux", "test_receptors.py::test_number_is_conserved_to_round_off"),
            ("what leaves a node arrives nowhere", "out[j] -= flux", "out[j] -= 0.0", "test_receptors.py::test_one_step_agrees_with_a_sparse_direct_solution"),
            ("the elimination along a meridian is wrong", "own[i] = area[i] + back * own[i - 1] / pivot", "own[i] = area[i] + back",
             "test_receptors.py::test_one_step_agrees_with_a_sparse_direct_solution"),
            ("saturation is not iterated", "if not saturated or largest(before)", "if True or largest(before)",
             PY + "stability/test_receptor_limits.py::test_a_saturated_step_solves_the_equation_of_its_own_end"),
            ("a failing solution passes", "return np.isfinite(c[0])", "return True", PY + "stability/test_receptor_limits.py::test_what_is_not_a_number_is_reported"),
            ("nodes go empty", "if number[i] <= 0.0:  # rounding", "if False:  # rounding", "test_receptors.py::test_density_stays_positive_at_any_cell_peclet_number_and_step"),
        ],
    },
    "Balance": {
        "balance.py": [
            ("the drag is missing", "nodal[i, k] -= drag * (x[i, k]", "nodal[i, k] -= 0.0 * drag * (x[i, k]",
             PY + "test_balance.py::test_tangent_is_the_second_derivative_of_the_potential"),
            ("adhesion pushes", "nodal[i, z] -= adhesion_load(", "nodal[i, z] += adhesion_load(",
             PY + "test_balance.py::test_tangent_is_the_second_derivative_of_the_potential"),
            ("the drag has twice its potential", "potential += 0.5 * balance.viscosity", "potential += balance.viscosity",
             PY + "test_balance.py::test_tangent_is_the_second_derivative_of_the_potential"),
            ("the mass forgets the drag", "bound[i] = bound[i] + balance.viscosity * body.reference_area[i] + softening",
             "bound[i] = bound[i] + softening", PY + "test_balance.py::test_mass_is_above_the_stiffness_of_drag_and_adhesion"),
            ("the mass forgets the adhesion", "+ balance.viscosity * body.reference_area[i] + softening", "+ balance.viscosity * body.reference_area[i]",
             PY + "test_balance.py::test_mass_is_above_the_stiffness_of_drag_and_adhesion"),
            ("the tolerance follows the membrane's stiffness", "return balance.adhesion.traction if", "return balance.adhesion.traction + balance.body.shear_modulus if",
             PY + "test_balance.py::test_residuals_are_measured_against_the_traction"),
            ("the tangent forgets the pressure", "change += side * (scratch.nodal[:, :d] + pressure * scratch", "change += side * (scratch.nodal[:, :d] + 0.0 * scratch",
             PY + "test_balance.py::test_tangent_against_dense_differences[axisymmetric-membrane-held]"),
        ],
        "relaxation.py": [
            ("half the pressure closes the volume", "return (missing_volume - flow) / mobility", "return 0.5 * (missing_volume - flow) / mobility", VOLUME),
            ("half the pressure moves the nodes", "force = nodal[i, k] + pressure * nodal[i, d + k]", "force = nodal[i, k] + 0.5 * pressure * nodal[i, d + k]", VOLUME),
            ("the volume after the last move is not asked for", "and not has_volume(balance, x, scratch)", "and False", PY + "test_relaxation.py::test_a_solution_has_its_volume_however_loose_the_tolerance"),
            ("a stall passes for a balance", "status = STALLED if last", "status = CONVERGED if last", PY + "stability/test_fictitious_mass.py::test_one_iteration_too_few_is_a_stall[axisymmetric]"),
            ("an explosion is not noticed", "if runs_away or not (residual < _EXPLODED and np.isfinite(volume)):", "if False:", PY + "test_relaxation.py::test_not_a_number_is_a_divergence_at_once[axisymmetric]"),
            ("too light a mass", "scratch.mass[:] *= 0.25", "scratch.mass[:] *= 0.1", PY + INSIDE),
            ("the damping is not centred in time", "keep, gain = (2.0 - damping) / (2.0 + damping), 2.0 / (2.0 + damping)", "keep, gain = 1.0 - damping, 1.0", PY + INSIDE),
            ("a failed relaxation is not tried with more mass", "_HEAVIER = (1.0, 4.0, 16.0)", "_HEAVIER = (1.0,)", PY + "test_relaxation.py::test_a_relaxation_that_fails_is_tried_with_more_mass"),
        ],
        "newton.py": [
            ("the tangent is twice as stiff", "/ (2.0 * nudge[i])", "/ nudge[i]", PY + "test_balance.py::test_banded_tangent_of_a_meridian_is_the_same"),
        ],
    },
    "Coupling step": {
        "spreading.py": [
            ("the dissipation has the other sign", "return worked, np.sum(", "return worked, -np.sum(", LEDGER),
            ("half the adhesion work", "state.adhesion_work + worked", "state.adhesion_work + 0.5 * worked", LEDGER),
            ("the dissipation is that of the last step", "dissipation=state.dissipation + dissipated", "dissipation=dissipated", LEDGER),
            ("order 2 is order 1", "self.case.time.order == 2 and started", "False", "test_scheme.py::test_second_order_is_nearer_to_short_steps"),
            ("steps of unequal length are taken for equal", "w = dt / dt_before", "w = 1.0", "test_scheme.py::test_backward_differences_are_exact_for_polynomials_of_their_order"),
            ("the receptors move on the membrane of before", "ahead if second_order else state.x", "state.x", "test_scheme.py::test_receptors_of_order_2_move_on_the_membrane_seen_ahead"),
            ("the drag forgets the length of the step", "self.case.drag / rate.step,", "self.case.drag,", LEDGER),
            ("the density is uneven in no mode", "amplitude * np.cos(self.case.perturbation.mode * angle)", "amplitude * np.cos(angle)", "test_scheme.py::test_uneven_density_has_its_mode"),
            ("frozen receptors thin out", "number=area if self.adhesion.frozen else number", "number=number", "test_scheme.py::test_frozen_receptors_keep_their_density"),
            ("a landing with the inner side down passes", "if area_facing_away(self.body.topology, solution.x, 0.0) > 0.0:", "if False:", "test_scheme.py::test_a_landing_with_the_inner_side_down_is_no_balance"),
            ("the step is blind to the receptors", "abs(seen / came - 1.0) if came > 0.0 else 0.0", "0.0", "test_scheme.py::test_the_step_is_controlled_by_the_receptors_in_reach"),
            ("negative densities are stepped from", "if number.min() <= 0.0:", "if False:", "stability/test_coupling_step.py::test_second_order_falls_back_to_first_where_it_would_go_negative"),
            ("clipped conductances are not told", "clipped_edges=clipped", "clipped_edges=0", "test_scheme.py::test_clipped_conductances_are_told"),
            ("a displaced front goes on with order 2", "volume=volume, steps=0)", "volume=volume)", "test_perturbation.py::test_motion_begins_anew_and_receptors_stay"),
            ("a state of another mesh is taken", 'stored.pop("mesh", None) != self.mesh_checksum or', 'stored.pop("mesh", None) and', "test_run.py::test_state_of_another_mesh_is_refused_with_the_remedy"),
            ("folded membrane is that beyond the cutoff", "BINDING_GAP * self.case.adhesion.cutoff)", "0.0)", "test_scheme.py::test_folded_membrane_is_what_is_bound_upside_down"),
        ],
    },
    "Steps, events and steadiness": {
        "stepping.py": [
            ("steady is what one of shape and receptors is", "max(sim.progress_rates(state)) <", "min(sim.progress_rates(state)) <", "test_stepping.py"),
            ("a step too long is not taken again", "if new.step_error > _TOO_FAR * limit and", "if False and", "test_stepping.py"),
            ("a step without a balance is not taken shorter", "if dt <= _SHORTEST * first:", "if True:", "test_stepping.py"),
            ("a step cut short by a mark shrinks the next one", "wanted if factor >= 1.0 else 0.0", "0.0", "test_stepping.py"),
            ("steps grow without bound", "wanted = max(min(wanted, max(LONGEST_STEP * until, first)), shortest)", "pass", "test_stepping.py"),
            ("folds are not looked for", "        _check_fold(sim, state)\n        yield", "        yield", "test_stepping.py"),
            ("a steady scene does not wait for its displacement", "state.time <= case.perturbation.at:", "False:", "test_perturbation.py::test_steady_scene_waits_for_its_displacement"),
            ("a motion never begins anew", "return sim.restart(state) if", "return state if", "test_perturbation.py::test_motion_begins_anew_and_receptors_stay"),
            ("steps miss the frames", "return mark if steps <= 1 else", "return time + (mark - time) * 0.999 if steps <= 1 else", "test_stepping.py"),
            ("the advice shortens steps that are auto", '"shorter steps did not help" if adaptive', '"reduce time.step" if adaptive', "test_stepping.py"),
        ],
    },
    "Ledgers and columns": {
        "diagnostics.py": [
            ("the volume error is always 0", "lambda m: m.state.volume / m.sim.volume_0 - 1.0", "lambda m: 0.0", "test_diagnostics.py"),
            ("the error of the receptors' number is always 0", "return 0.0 if m.sim.adhesion.frozen else", "return 0.0 if True else", "test_diagnostics.py"),
            ("the unit of the pressure", '"pressure", "kT/a0^3"', '"pressure", "kT/a0^2"', "test_diagnostics.py"),
            ("the unit of the time", '"time", "a0^2/D"', '"time", "s"', "test_diagnostics.py"),
            ("all within the cutoff is bound", "level = BINDING_GAP * self.sim.case.adhesion.cutoff", "level = self.sim.case.adhesion.cutoff", "test_diagnostics.py"),
            ("what folds is bound", "return area - area_facing_away(self.sim.body.topology, self.x, level), radius", "return area, radius", "test_diagnostics.py::test_membrane_that_is_folded_is_not_bound"),
            ("the believed error forgets the mesh", "min(1.0, mesh + step", "min(1.0, step", "test_diagnostics.py"),
            ("the believed error forgets the scouts", "mesh = case.mesh.difficulty * error", "mesh = error", "test_diagnostics.py"),
            ("bound membrane counts as free", "np.flatnonzero(~touches(gap.min(axis=1)))", "np.arange(len(gap))", "test_diagnostics.py"),
            ("the smallest density is the largest", "lambda m: m.density.min()", "lambda m: m.density.max()", "test_diagnostics.py"),
            ("the smallest gap is the largest", "lambda m: gaps(m.x).min()", "lambda m: gaps(m.x).max()", "test_diagnostics.py"),
            ("the tensions of a frame are exchanged", '{"tension_1": tension[:, 0], "tension_2": tension[:, 1]}', '{"tension_1": tension[:, 1], "tension_2": tension[:, 0]}', "test_diagnostics.py"),
            ("the residual is not recorded", "lambda m: m.state.residual", "lambda m: 0.0", "test_diagnostics.py"),
            ("the energy is that of the start", "lambda m: elastic_energy(m.sim.body, m.x)", "lambda m: m.sim.elastic_energy_0", LEDGER),
        ],
        "quantities.py": [
            ("twice the local exponent", "/ (2.0 * np.log(SLOPE_FACTOR))", "/ np.log(SLOPE_FACTOR)", "test_inference.py::test_quantities_of_a_power_law"),
        ],
    },
    "Planning": {
        "budget.py": [
            ("the shares of mesh and step are exchanged", '"mesh": 0.4, "step": 0.5', '"mesh": 0.5, "step": 0.4', "test_planning.py::test_the_wish_is_shared_out"),
            ("the tolerance is ten times looser", "/ TOLERANCE_ERROR  #", "/ TOLERANCE_ERROR * 10.0  #", "test_planning.py::test_the_wish_is_shared_out"),
        ],
        "planning.py": [
            ("scouts are not repeated finer", "edge <= resolves * REFINEMENT", "True", "test_planning.py::test_scouts_resolve_cutoff_and_front_and_come_in_pairs"),
            ("scouts are coarser than the cutoff", "case.adhesion.cutoff / EDGES_A_CUTOFF), case", "case.adhesion.cutoff), case", "test_planning.py::test_scouts_resolve_cutoff_and_front_and_come_in_pairs"),
            ("a scout that fails is given up", "if failures == _FAILURES:", "if True:", "test_planning.py::test_a_scout_without_a_balance_is_repeated_finer"),
            ("bending is left out under compression", "< BENDING_SHARE * case.accuracy and not slack", "< BENDING_SHARE * case.accuracy", "test_planning.py::test_bending_stays_where_the_pure_membrane_is_slack"),
            ("bending is left out whatever its effect", "if effect < BENDING_SHARE * case.accuracy", "if True", "test_planning.py::test_bending_is_kept_where_its_effect_exceeds_the_wish"),
            ("a meridian says nothing of compression", "if tension >= -COMPRESSION * case.membrane.shear_modulus:", "if True:", "test_planning.py::test_only_a_meridian_under_compression_notes_it"),
            ("a scene without axis is run as a meridian", 'model = ("surface" if broken else "axisymmetric")', 'model = ("axisymmetric")', "test_perturbation.py::test_auto_takes_a_surface"),
        ],
    },
    "Write errors": {
        "files.py": [
            ("a file is moved before it has reached the disk", "                sync(handle)\n", "", SYNCS),
            ("the directory is not synced", "        sync_directory(file.parent)\n", "", SYNCS),
            ("a file is written in its place", "handle = os.open(part, os.O_WRONLY", "handle = os.open(file, os.O_WRONLY", DISK_FULL),
            ("half a file is left behind", "with suppress(OSError):\n                os.unlink(part)", "pass", SYNCS),
            ("half a write passes for a whole one", "left = left[os.write(handle, left) :]", "left = left[os.write(handle, left) + len(left) :]", SYNCS),
            ("an error of a sync is passed over", "if error.errno not in (errno.EINVAL, errno.ENOSYS, errno.ENOTSUP):", "if False:", DISK_FULL + " " + SYNCS),
            ("an error of a directory's sync is passed over", "if error.errno not in _CANNOT_SYNC:", "if False:", DISK_FULL + " " + SYNCS),
            ("a full disk has another name", '("the disk is full", "make room")', '("the disk fails", "make room")', DISK_FULL),
        ],
        "run.py": [
            ("a run ends finished after a write error", "            settle(\"failed\", str(error))\n        raise\n    except Exception", "            settle(\"finished\", str(error))\n    except Exception", DISK_FULL),
        ],
        "storage.py": [
            ("an error of the history is passed over", "        except OSError as error:\n            raise files.write_error(self.path, self.history_file.name, error) from None\n        digest", "        except OSError as error:\n            pass\n        digest", DISK_FULL),
            ("a checkpoint is ahead of its history", "files.sync(self._history[0])", "pass", SYNCS),
        ],
    },
    "Damage": {
        "files.py": [
            ("a damaged image is read", "if content[:_MARK_LINE] != _MARK", "if False and content[:_MARK_LINE] != _MARK", "test_storage.py::test_damaged_checkpoint_gives_way_to_the_one_before"),
        ],
        "storage.py": [
            ("the checksum of the history is not compared", "if files.checksum(content[: marks.history_size]) != marks.history_checksum:", "if False:", "faults/test_damage.py::test_one_changed_digit_before_the_checkpoint_is_seen"),
            ("the checksums of the frames are not compared", "if _frames_checksum(self._written) != marks.frames_checksum:", "if False:", FREELY + " faults/test_damage.py::test_swapped_and_damaged_parts_of_a_finished_run_are_seen"),
            ("the status is believed without its checksum", 'if files.checksum(body.encode()) + "\\n" != last:', "if False:", "test_storage.py " + FREELY),
            ("no earlier checkpoint is kept", "kept_as=self.checkpoint_previous.name", "kept_as=None", "test_storage.py::test_damaged_checkpoint_gives_way_to_the_one_before"),
            ("history after the checkpoint stays", "self.history_file.name, content[: marks.history_size])\n        self._remove", "self.history_file.name, content)\n        self._remove", SAME_BITS + " test_storage.py"),
            ("frames after the checkpoint stay", "self._remove_frames(marks.frames)\n        self._indexed", "self._indexed", "test_storage.py " + SAME_BITS),
            ("half a row is read", "if len(values) != len(columns):\n                break", "if False:\n                break", "test_storage.py::test_half_a_row_is_passed_over_and_dropped"),
            ("numbers of the history are rounded", "repr(int(v) if isinstance(v, (int, np.integer)) else float(v))", "f'{float(v):.12g}'", "test_storage.py::test_history_reads_back_to_the_same_bits"),
            ("a frame of another mesh is stored", "if self._written and files.checksum(connectivity.tobytes()) != self._written[0].mesh:", "if False:", "test_storage.py::test_frame_of_another_mesh_is_refused_and_leaves_the_file_as_it_was"),
            ("a damaged picture stays", "files.remove_file(self.path, self.summary_file.name)\n", "pass\n", FREELY + " faults/test_damage.py::test_swapped_and_damaged_parts_of_a_finished_run_are_seen"),
            ("series of a finished run are not mended", "if not _holds(file, content):", "if False:", FREELY + " faults/test_damage.py::test_swapped_and_damaged_parts_of_a_finished_run_are_seen"),
        ],
        "run.py": [
            ("a finished run is not verified", "directory.verify(directory.finished_marks())", "directory._written = directory._read_frames(None)", FREELY + " faults/test_damage.py::test_swapped_and_damaged_parts_of_a_finished_run_are_seen"),
        ],
        "batch.py": [
            ("a batch gives a damaged run up", "return run(restart=True)", "raise", "faults/test_damage.py::test_a_batch_computes_anew_what_cannot_go_on"),
        ],
    },
    "Checkpoints and the end of a run": {
        "run.py": [
            ("the last state is no frame", "if state.time in case.output.frames or done:", "if state.time in case.output.frames:", "faults/test_foreign.py::test_last_state_is_always_a_frame"),
            ("no checkpoint at the end", "        directory.write_checkpoint(sim.stored(state))\n        if failure:", "        if failure:", SAME_BITS),
            ("checkpoints by the hour", "60 * case.output.checkpoint_minutes", "3600 * (1 + case.output.checkpoint_minutes)", "test_run.py::test_checkpoints_are_written_on_the_way"),
            ("an interrupted run is called finished", "elif reason:\n            settle(\"interrupted\"", "elif False:\n            settle(\"interrupted\"", "test_run.py::test_interrupted_run_goes_on_to_the_same_bits"),
            ("a run without a balance is called finished", "        if failure:\n            settle", "        if False:\n            settle", "test_run.py::test_failed_relaxation_is_an_outcome_with_the_last_good_state_kept"),
            ("frames after the rest are missing", "    for t in left:\n", "    for t in []:\n", "faults/test_foreign.py::test_resting_state_stands_for_the_frames_after_it"),
            ("the largest volume error is the last one", "np.max(np.abs(history[column]))", "abs(history[column][-1])", "test_run.py::test_outcome_tells_the_figures_of_the_history"),
            ("a checkpoint is not gone on from", "    if checkpoint is None:\n", "    if True:\n", SAME_BITS),
            ("a wish that is missed is not told before the run", "for sentence in [*case.warnings(), *missed_wish(case)]:", "for sentence in case.warnings():", "test_run.py::test_mesh_and_step_that_cannot_keep_the_wish_are_told_before_a_run"),
            ("a wish that is missed is not told after the run", "notes += missed_wish(case, history)", "pass", NOTES),
            ("a believed error above the wish is not told", "if believed > case.accuracy * _ROUNDED:", "if False:", NOTES),
        ],
    },
    "Stale or foreign": {
        "_jit.py": [
            ("NUMBA_CACHE_DIR is not named by the sources", "return str(Path(parent).absolute() / name)", "return str(Path(parent).absolute())", "faults/test_foreign.py::test_sources_name_the_cache_in_numba_cache_dir_too"),
            ("a cache of another user is used", "if status.st_uid != os.geteuid():\n        return f\"{directory}", "if False:\n        return f\"{directory}", "faults/test_foreign.py::test_cache_of_another_user_is_refused"),
            ("a cache in which others may write is used", "if status.st_mode & (stat.S_IWGRP | stat.S_IWOTH):", "if False:", OTHERS_CACHE),
            ("a cache below a folder of others is used", "if others and not status.st_mode & stat.S_ISVTX:", "if False:", OTHERS_CACHE),
            ("planted files are not seen", "if inside.lstat().st_uid != os.geteuid():", "if False:", "faults/test_foreign.py::test_a_file_planted_by_another_user_is_seen"),
            ("others may read and write the cache", "directory.mkdir(mode=0o700, exist_ok=True)", "directory.mkdir(mode=0o777, exist_ok=True)", "faults/test_foreign.py::test_cache_is_made_for_the_user_alone"),
            ("laws from outside are kept in the cache", "return any(name in str(sig) for name in _FOREIGN)", "return False", "test_jit.py::test_a_law_from_outside_is_never_met_in_an_old_form"),
        ],
        "provenance.py": [
            ("the hash is of names and sizes", "digest.update(content)", "pass", "faults/test_foreign.py::test_any_edit_of_a_deciding_module_changes_the_hash"),
            ("a module that decides numbers counts for none", '"storage", "study",', '"storage", "stepping", "study",', "faults/test_foreign.py::test_no_module_that_decides_numbers_is_left_out_of_the_hash"),
            ("kernels of other modules do not count", "wanted += _imports(sources[name])", "pass", "test_jit.py"),
            ("cores are counted as on Linux", 'if hasattr(os, "sched_getaffinity"):', "if True:", "faults/test_neighbours.py::test_cores_without_sched_getaffinity"),
        ],
        "storage.py": [
            ("a checkpoint is not bound to its case", "self._check_case(file, checkpoint, case)", "pass", "faults/test_damage.py::test_a_checkpoint_of_another_run_is_refused"),
            ("a run of another case goes on", "if conflicts := continuation_conflicts(stored, case, reached):", "if conflicts := []:", "test_storage.py::test_directory_of_another_case_is_refused_with_the_difference"),
            ("a finished run of other sources is not told", 'if last.get("sources") != sources_hash():', "if False:", "faults/test_foreign.py::test_finished_run_of_other_sources_is_said"),
            ("going on with other sources is not noted", "if others or changes:", "if changes:", "faults/test_foreign.py::test_going_on_with_other_sources_is_said_and_noted"),
            ("files of somebody else are written over", "if os.path.exists(self.path) and not self.holds_run() and any(self._foreign()):", "if False:", "test_storage.py::test_directory_with_files_of_something_else_is_left_alone"),
            ("--restart removes nothing", "if restart or not self.holds_run():", "if not self.holds_run():", "test_storage.py::test_restart_removes_the_earlier_run_but_no_other_file"),
        ],
        "batch.py": [
            ("workers of other sources compute", 'for part in ("vesdyn", "sources"):', 'for part in ("vesdyn",):', "faults/test_foreign.py::test_worker_of_another_version_is_refused_by_name"),
            ("a worker that came later does not ask", "if _named(identity()) != _named(wanted):", "if False:", "faults/test_foreign.py::test_worker_that_came_later_refuses_by_itself"),
            ("a batch keeps the run of other sources", "if _named(part) != _named(identity())]", "if False]", "faults/test_foreign.py::test_batch_computes_the_run_of_other_sources_anew"),
            ("other libraries are not told", "            if others:\n                warnings", "            if False:\n                warnings", "faults/test_foreign.py::test_worker_of_other_libraries_is_told"),
        ],
        "case.py": [
            ("a run goes on under other physics", "if key not in free and there.get(key) != here.get(key)", "if False", CONTINUED),
            ("a run goes on to an end that has passed", "if wanted.time.end < time and not", "if False and not", CONTINUED),
            ("a run goes on with other frames behind it", "if len(passed) != len(wished) or", "if False and", CONTINUED),
            ("the hash forgets the drag", '"solver.max_iterations", "receptors.mobility")', '"solver.max_iterations", "receptors.mobility", "drag")', "test_case.py::test_the_hash_is_of_what_decides_the_numbers"),
            ("the hash asks for the name", '*("name", "mesh.file", "output', '*("mesh.file", "output', "test_case.py::test_the_hash_is_of_what_decides_the_numbers"),
        ],
    },
    "Interrupts": {
        "run.py": [
            ("retries are deaf", "        if reason := interruption():\n            raise", "        if False:\n            raise", "faults/test_interrupts.py::test_retries_hear_an_interrupt"),
            ("a run is deaf between its steps", "reason = None if done else interruption() or _in_words(reason)", "reason = None if done else _in_words(reason)", SAME_BITS + " test_run.py::test_stop_is_asked_after_each_step"),
        ],
        "interrupts.py": [
            ("a loop that does not ask goes on", "        self._timer.start()\n", "", "faults/test_interrupts.py::test_loop_that_does_not_ask_gets_a_keyboard_interrupt"),
            ("a loop that asks is interrupted all the same", "            self._timer.cancel()\n        return", "        return", "faults/test_interrupts.py::test_loop_that_asks_is_left_alone"),
            ("a second interrupt is not heard", "            _heard.set()\n            _raise()", "            _heard.set()\n            return", "test_run.py::test_second_interrupt_stops_within_the_step"),
            ("handlers are not put back", "            signal.signal(number, handler)", "            pass", SAME_BITS),
            ("a process in a library is deaf", "elif _heard.wait(PATIENCE + 0.4):", "elif True:", "faults/test_interrupts.py::test_process_that_never_comes_to_its_turn_is_ended"),
        ],
        "batch.py": [
            ("a stopped batch begins another case", "    if reason := stop():\n", "    if reason := None:\n", "test_batch.py::test_a_stopped_batch_begins_nothing"),
            ("workers go on without their batch", 'return "the end of its batch"', "return None", "test_batch.py::test_the_end_of_a_batch_stops_its_workers"),
            ("a scheduler without workers is not told", "if time.monotonic() < self._next_look:", "if True:", "faults/test_interrupts.py::test_scheduler_without_workers_is_told_and_hears_an_interrupt"),
            ("a worker that died is not replaced", "                    worker.renew()\n", "", "test_batch.py::test_case_whose_process_dies_again_and_again_is_given_up"),
        ],
    },
    "Precedence": {
        "case_file.py": [
            ("a base goes over its file", "for file, keys in reversed(files):", "for file, keys in files:", "test_case_file.py::test_keys_of_a_base_are_defaults_through_a_chain_and_section_by_section"),
            ("a file goes over --set", 'levels.append(_Level("--set ", _together(sets, warn=True)))', 'levels.insert(0, _Level("--set ", _together(sets, warn=True)))', "test_case_file.py::test_overrides_replace_add_and_are_read_as_yaml"),
            ("what gave way is not told", "    for key, sentence in notes:\n", "    for key, sentence in []:\n", GIVE_WAY),
            ("a stored case forgets its defaults", "if scene.defaults is not None else case", "if False else case", "test_case_file.py::test_a_stored_case_keeps_the_defaults_it_was_stored_with"),
            ("a sweep ignores --set", "levels = [*below, one, *above]", "levels = [*below, one]", "test_batch.py::test_files_and_their_sweeps_become_cases test_case_file.py::test_a_sweep_is_every_combination"),
        ],
        "case.py": [
            ("the less specific of mobility and drift number wins", "drop(min(mobility, drift_number, key=rank))", "drop(max(mobility, drift_number, key=rank))", "test_case_file.py::test_of_mobility_and_drift_number_the_more_specific_wins"),
            ("default frames refuse an earlier end", "        if not frames_given:\n", "        if False:\n", "test_case.py::test_defaults_give_way"),
            ("a meridian takes the edges of a surface", 'front if front_given else "auto", far if far_given else "auto"', "front, far", "test_case.py::test_on_a_meridian_edges_and_step_not_given_are_auto"),
            ("times within a rounding are two", "return abs(a - b) <= SAME_TIME * max(abs(a), abs(b))", "return a == b", "test_case.py::test_times_within_a_rounding_are_one"),
            ("keys that decide nothing are not told", "            if self.given(key) and not agrees", "            if False and not agrees", "test_case.py::test_doubtful_and_idle_keys_are_warned_of"),
            ("a mesh and step that miss the wish are not told", 'value != "auto" and error > wish:', "False:", "test_case.py::test_a_given_mesh_and_step_that_miss_the_given_wish_are_told"),
            ("what is changed does not win", "keys, notes = merged([given, in_full(changes)])", "keys, notes = merged([in_full(changes), given])", "test_case.py::test_changed_validates_keeps_the_given_and_wins"),
        ],
    },
    "Input": {
        "plain_yaml.py": [
            ("010 is a number", '_INTEGER = re.compile(r"[-+]?(0|[1-9][0-9]{0,399})")', '_INTEGER = re.compile(r"[-+]?[0-9]{1,399}")', YAML_NUMBERS),
            ("the second of two keys wins", "if key.value in mapping:", "if False:", NO_CASE),
            ("errors of the reader pass through", "except Exception as error:  # PyYAML", "except ZeroDivisionError as error:  # PyYAML", NO_CASE + " faults/test_case_inputs.py::test_every_file_that_is_none"),
            ("aliases are expanded without end", "if values > MOST_VALUES:", "if values > 10**6:", "test_case_file.py::test_tags_and_very_many_values_are_refused"),
            ("tags are passed over", "        if node.tag != _UNTAGGED:\n", "        if False:\n", "test_case_file.py::test_tags_and_very_many_values_are_refused"),
        ],
        "case.py": [
            ("unknown keys are passed over", 'extra="forbid"', 'extra="ignore"', "test_case_file.py::test_refusals_name_file_key_value_and_remedy"),
            ("not a number is a number", "allow_inf_nan=False, validate_default=True", "allow_inf_nan=True, validate_default=True", "test_case_file.py::test_refusals_name_file_key_value_and_remedy"),
            ("numbers may be so small that they vanish", "if 0 < value < least:", "if False:", "test_case.py::test_limits_of_either_side"),
            ("a modulus has no upper limit", "1.81, le=1e12,", "1.81,", "test_case.py::test_limits_of_either_side"),
        ],
        "case_file.py": [
            ("huge files are read", "if status.st_size > LARGEST_FILE:", "if False:", "test_case_file.py::test_endless_and_huge_files_are_refused_at_once"),
            ("bases in a circle are followed", "if any(os.path.realpath(path) == os.path.realpath(file) for file in above):", "if False:", "test_case_file.py::test_refusals_name_the_file_of_the_fault"),
            ("bases are followed without end", "if len(above) > MOST_BASES:", "if False:", "test_case_file.py::test_many_faults_bases_frames_and_cases_make_few_sentences"),
            ("a sweep that is swept over is not told", "if _is_set(level) and _holding(level.keys)(key)", "if False and _holds(level.keys, key)", "test_case_file.py::test_refused_sweeps"),
        ],
        "refusals.py": [
            ("control characters reach the terminal", 'text = "".join(c if c.isprintable() else ascii(c)[1:-1] for c in text[: longest + 1])', "text = text[: longest + 1]",
             "test_case_file.py::test_what_the_user_wrote_is_cut_and_its_control_characters_shown"),
            ("a thousand faults make a thousand sentences", "if len(kept) > MOST_SENTENCES:", "if False:", "test_case.py::test_at_most_twenty_sentences"),
        ],
        "cli.py": [
            ("a case that cannot be used has status 0", "        return _refuse(error, 2)\n", "        return _refuse(error, 0)\n", "test_cli.py::test_bad_input_is_a_sentence_and_status_2"),
            ("a failed batch has status 0", '1 if counts["failed"] else 0', "0", "test_batch.py::test_failure_of_one_case_is_told_in_the_end_and_stops_no_other"),
        ],
    },
    "Locks, neighbours and streams": {
        "storage.py": [
            ("two processes run in one directory", "            if not held:\n", "            if False:\n", "test_storage.py::test_directory_in_use_is_refused"),
            ("a failing lock is taken for held", "                    yield held\n                return", "                    yield True\n                return", LOCKS),
            ("the lock file of a killed process stays", "        if (began := _began(pid)) is None:\n            return True", "        if (began := _began(pid)) is None:\n            return False", STALE_LOCKS),
            ("the lock file of a live neighbour is taken", "return untouched > _LOCK_IS_STALE", "return True", STALE_LOCKS),
            ("a lock file is made by several at once", "os.O_WRONLY | os.O_CREAT | os.O_EXCL", "os.O_WRONLY | os.O_CREAT", LOCKS + " faults/test_neighbours.py::test_of_many_one_gets_the_lock"),
            ("a lock file is left behind", "                file.unlink()\n", "                pass\n", LOCKS),
        ],
        "files.py": [
            ("an --out that is a file is not noticed", "        if not is_directory:\n", "        if False:\n", "faults/test_neighbours.py::test_out_that_is_a_file_is_told_before_anything_else"),
        ],
        "batch.py": [
            ("what another batch computes has failed", 'outcome = Outcome("elsewhere", "another', 'outcome = Outcome("failed", "another', "test_batch.py::test_what_another_process_computes_is_elsewhere"),
            ("two cases of a batch share a directory", "        if len(paths) > 1\n", "        if False\n", "test_batch.py::test_every_fault_is_told_before_anything_runs"),
        ],
        "interrupts.py": [
            ("a closed stream is asked for its terminal", "return stream is not None and stream.isatty()", "return stream.isatty()", "faults/test_neighbours.py::test_stream_that_is_no_terminal"),
            ("closed streams stay closed", "        if getattr(sys, name) is None:\n", "        if False:\n", "faults/test_neighbours.py::test_streams_that_are_closed"),
        ],
        "cli.py": [
            ("a broken pipe is an error", "if fault and fault.errno not in (errno.EPIPE, errno.EIO):", "if fault:", "faults/test_neighbours.py::test_broken_pipe_is_no_error"),
        ],
    },
}
