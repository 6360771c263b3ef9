"""A user's own mesh: what is read, what is refused, and that it gives the same gravity as the body it was made from."""

import math

import numpy as np
import pytest

from flight_graph.errors import FlightError
from flight_graph.graphs.scenario import load
from flight_graph.graphs.source import available
from sim_nodes.gravity import bodies, mesh

TETRAHEDRON = """# a comment
v 0 0 0
v 1 0 0
v 0 1 0
v 0 0 1
f 1 3 2
f 1 2 4
f 1/5/6 4//6 3/1
f -3 -2 -1
"""


def write(path, vertices, faces):
    lines = [f"v {x:.17g} {y:.17g} {z:.17g}" for x, y, z in vertices]
    lines += [f"f {i + 1} {j + 1} {k + 1}" for i, j, k in faces]
    path.write_text("\n".join(lines))
    return str(path)


def refused(tmp_path, vertices, faces):
    with pytest.raises(FlightError) as error:
        mesh.load_obj(write(tmp_path / "body.obj", vertices, faces))
    return str(error.value)


@pytest.fixture
def sphere():
    vertices, faces = mesh.icosphere(3)
    return 250.0 * vertices, faces.copy()


def test_obj_forms(tmp_path):
    (tmp_path / "t.obj").write_text(TETRAHEDRON)
    vertices, faces = mesh.load_obj(tmp_path / "t.obj", scale=2.0)
    assert mesh.volume(vertices, faces) == pytest.approx(8.0 / 6.0)
    np.testing.assert_allclose(mesh.centroid(vertices, faces), [0.5, 0.5, 0.5])


def test_a_polygon_is_cut_into_triangles(tmp_path):
    corners = [f"v {i} {j} {k}" for i in (0, 1) for j in (0, 1) for k in (0, 1)]
    quads = ["f 1 2 4 3", "f 5 7 8 6", "f 1 5 6 2", "f 3 4 8 7", "f 1 3 7 5", "f 2 6 8 4"]
    (tmp_path / "cube.obj").write_text("\n".join(corners + quads))
    vertices, faces = mesh.load_obj(tmp_path / "cube.obj")
    assert (len(faces), mesh.volume(vertices, faces)) == (12, pytest.approx(1.0))


def test_a_hole(tmp_path, sphere):
    text = refused(tmp_path, sphere[0], sphere[1][1:])
    assert "body.obj: the mesh has a hole: 3 edges belong to one face only, the first one joins vertices" in text


def test_vertices_that_are_not_welded(tmp_path, sphere):
    text = refused(tmp_path, sphere[0][sphere[1]].reshape(-1, 3), np.arange(3 * len(sphere[1])).reshape(-1, 3))
    assert "a hole" in text
    assert text.endswith("some vertices coincide, weld them")


def test_an_inverted_mesh(tmp_path, sphere):
    assert "inside out (its volume is -" in refused(tmp_path, sphere[0], sphere[1][:, ::-1])


def test_one_inverted_face(tmp_path, sphere):
    sphere[1][7] = sphere[1][7][::-1]
    assert "wound against each other at 3 edges" in refused(tmp_path, *sphere)


def test_a_degenerate_face(tmp_path, sphere):
    faces = np.vstack([sphere[1], [[4, 4, 9]]])
    assert f"1 degenerate faces without an area, the first one is face {len(faces)} (vertices 5, 5, 10)" in refused(
        tmp_path, sphere[0], faces)


def test_an_edge_of_four_faces(tmp_path):
    vertices = np.array([[0, 0, 0], [0, 0, 1], [1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0]], float)
    one = [(0, 2, 3), (0, 3, 1), (0, 1, 2), (1, 3, 2)]
    two = [(0, 4, 5), (0, 5, 1), (0, 1, 4), (1, 5, 4)]
    assert "1 edges belong to more than two faces, the first one joins vertices 1, 2" in refused(
        tmp_path, vertices, np.array(one + two)[:, ::-1])


@pytest.mark.parametrize(("text", "sentence"), [
    ("v 0 0\nf 1 2 3", "line 1: 'v 0 0' is no vertex"),
    ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 x", "line 4: 'f 1 2 x' is no"),
    ("v 0 0 0", "has no faces"), ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4", "a face names a vertex that is not there")])
def test_a_file_that_is_no_mesh(tmp_path, text, sentence):
    (tmp_path / "bad.obj").write_text(text)
    with pytest.raises(FlightError, match=sentence):
        mesh.load_obj(tmp_path / "bad.obj")


def test_scenario_with_a_mesh(tmp_path, sphere):
    """Bennu's own mesh from a file beside the scenario: gravity as from the body; the slope is that of a flat face."""
    write(tmp_path / "bennu.obj", *bodies.bennu().shape.mesh(16))
    scenario = tmp_path / "mine.yaml"
    scenario.write_text(available()["cubli_bennu"].read_text())
    own = {"plant.gravity_model": "mesh", "plant.mesh": "bennu.obj"}
    mine = load(str(scenario), own).graph.nodes["plant"].values
    built_in = load("cubli_bennu").graph.nodes["plant"].values
    assert mine["gravity"] == pytest.approx(built_in["gravity"], rel=5e-3)
    assert mine["tilt"] == pytest.approx(built_in["tilt"], abs=math.radians(1.0))
    assert mine["mesh"] == str(tmp_path / "bennu.obj")
    write(tmp_path / "bennu.obj", sphere[0], sphere[1][1:])
    with pytest.raises(FlightError, match=r"components.plant.parameters.mesh: .*bennu.obj: the mesh has a hole"):
        load(str(scenario), own)
    with pytest.raises(FlightError, match="plant.parameters.mesh: there is no mesh file"):
        load(str(scenario), {**own, "plant.mesh": "missing.obj"})


def test_an_origin_outside_the_mesh(tmp_path, sphere):
    body = bodies.from_obj(write(tmp_path / "off.obj", sphere[0] + np.array([0.0, 0.0, 900.0]), sphere[1]), 4.89)
    with pytest.raises(FlightError, match="there is no surface at latitude 0, longitude 0 rad"):
        body.surface(0.0, 0.0)
