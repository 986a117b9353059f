"""The kinds of body: each gives what the others give, tells itself by its elements, and knows its topology alone."""

from types import SimpleNamespace

import numpy as np
import pytest
from measure import straight_shares

from vesdyn.body import MeshError, area_below, as_triangles, edge_conductances, set_shares_below
from vesdyn.case import Case
from vesdyn.kinds import KINDS, kind_of, topology_of
from vesdyn.meshing import check_memory

MESHES = {"mesh": {"front_edge": 0.1, "far_edge": 0.2}}


@pytest.fixture(params=sorted(KINDS))
def case(request):
    return Case(name="a", model=request.param, **MESHES)


def test_every_kind_gives_the_same_names(case):
    kind = KINDS[case.model]
    names = ("start", "topology", "mesh_error", "mesh_size", "far_edge", "LONGEST_EDGE", "CORNERS", "XDMF", "KEEPS_AXIS")
    assert [name for name in names if not hasattr(kind, name)] == []
    assert isinstance(kind.mesh_error(case.mesh, True), MeshError)
    assert kind.far_edge(0.01) == {"axisymmetric": 0.05, "surface": 0.05}[case.model]
    assert kind.far_edge(0.002) == {"axisymmetric": 0.012, "surface": 0.05}[case.model]
    assert kind.far_edge(0.03) == {"axisymmetric": 0.05, "surface": 0.09}[case.model]


def test_a_stored_shape_has_the_topology_of_its_body(case):
    """Contour, areas and conductances need no rest state and no material."""
    x, body = KINDS[case.model].start(case.mesh, case.membrane)
    topology = topology_of(body.topology.elements.astype(np.int64))  # as files hold it
    assert type(topology) is type(body.topology) and kind_of(topology.elements.shape[1]) is KINDS[case.model]
    for stored, made in zip(topology, body.topology):
        assert stored.dtype == made.dtype and np.array_equal(stored, made)
    share, conductance = np.zeros((2, len(topology.edges)))
    set_shares_below(topology, x, 0.1, share)
    assert np.all(share >= straight_shares(x, topology.edges, 0.1) - 1e-14)
    # a cap of height d has the area pi d a0; facets and cones have a little less
    assert area_below(topology, x, 0.1, share) == pytest.approx(0.1 * np.pi, rel=0.1)
    assert area_below(topology, x, np.inf, np.ones(len(share))) == pytest.approx(body.reference_area.sum(), rel=1e-13)
    assert edge_conductances(topology, x, conductance) == 0 and conductance.max() > 0.0


def test_no_kind_has_four_corners():
    with pytest.raises(ValueError, match="no kind of body has elements of 4 corners"):
        topology_of(np.zeros((5, 4)))


def test_triangles_to_draw_are_closed_and_show_the_values_of_their_node(case):
    x, body = KINDS[case.model].start(case.mesh, case.membrane)
    vertices, faces, node = as_triangles(body.topology, x)
    assert np.array_equal(vertices[:, 2], x[node, -1])
    assert np.array_equal(np.unique(node), np.arange(len(x)))
    a, b, c = np.moveaxis(vertices[faces], 1, 0)
    assert np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0 == pytest.approx(np.pi / 6.0, rel=1e-3)  # 120 sectors


def test_error_model_is_inverted():
    model = MeshError(2.0, 1.5)
    assert model.at(0.01, 0.25) == pytest.approx(2.0 * 0.04**1.5)
    assert model.edge(model.at(0.01, 0.25), 0.25) == pytest.approx(0.01)


def test_size_is_that_of_the_mesh_and_grows_with_it(case):
    kind = KINDS[case.model]
    size, finer = (kind.mesh_size(case.mesh.model_copy(update={"front_edge": edge})) for edge in (0.1, 0.02))
    assert len(kind.start(case.mesh, case.membrane)[0]) == pytest.approx(size.nodes, rel=0.05, abs=2)
    assert size.nodes < finer.nodes and size.memory < finer.memory and size.step < finer.step
    assert finer.memory == kind.BYTES * finer.nodes
    check_memory(finer.nodes, kind.BYTES)


@pytest.mark.parametrize("model, edge", [("surface", 1e-6), ("axisymmetric", 1e-14)])
def test_mesh_that_no_machine_holds_is_refused_before_it_is_made(model, edge):
    mesh = SimpleNamespace(front_edge=edge, far_edge=0.05, layout="rings", axes=(1.0, 1.0), file=None, fine_angle=80.0)
    with pytest.raises(ValueError, match=r"^mesh\.front_edge: about .* nodes would need .* GB of memory"):
        KINDS[model].start(mesh, Case(name="a").membrane)
