"""Elementary tests from numpy, many at once."""

import numpy as np
import pytest

import lazyccd


def falling_vertices(heights):
    """A vertex at each height above one triangle; it falls by 1."""
    start = np.tile(np.array([(0.2, 0.2, 0), (0, 0, 0), (1, 0, 0), (0, 1, 0)], float), (len(heights), 1, 1))
    start[:, 0, 2] = heights
    end = start.copy()
    end[:, 0, 2] -= 1
    return start, end


def test_a_vertex_hits_a_face_when_it_reaches_it():
    hit, toi = lazyccd.queries.vertex_face(*falling_vertices([0.25, 0.5, 1.0, 1.25]))
    assert hit.dtype == np.bool_
    assert hit.tolist() == [True, True, True, False]
    assert toi.tolist() == [0.25, 0.5, 1.0, 0.0]


def test_edges_hit_when_they_cross():
    start = np.array([[(-1, 0, 0), (1, 0, 0), (0, -1, 1), (0, 1, 1)]], float)
    end = start.copy()
    end[0, 2:, 2] = -3
    assert lazyccd.queries.edge_edge(start, end).toi.tolist() == [0.25]
    start[0, 2:, 0] = end[0, 2:, 0] = 2
    assert lazyccd.queries.edge_edge(start, end).hit.tolist() == [False]


def test_a_separation_is_reached_earlier():
    start, end = falling_vertices([0.5])
    result = lazyccd.queries.vertex_face(start, end, separation=0.25)
    assert result.hit.all() and abs(result.toi[0] - 0.25) < 1e-6 and result.toi[0] <= 0.25


def test_answers_do_not_depend_on_threads():
    random = np.random.default_rng(1)
    start, end = random.normal(size=(2, 5000, 4, 3))
    for decide in (lazyccd.queries.vertex_face, lazyccd.queries.edge_edge):
        one = decide(start, end, threads=1)
        many = decide(start, end, threads=4)
        assert 0 < one.hit.sum() < 5000
        assert (one.hit == many.hit).all() and (one.toi == many.toi).all()


def test_the_detector_decides_alike():
    random = np.random.default_rng(2)
    start, end = random.normal(size=(2, 300, 4, 3))
    hit, toi = lazyccd.queries.vertex_face(start, end)
    for query in range(300):
        one = lazyccd.Detector(
            [(1, 2, 3)], edges=[(0, 4)], body_of_vertex=[1, 0, 0, 0, 1], edge_edge=False, threads=1,
            backend="cpu",
        )
        ends = [np.concatenate([p[query], p[query, :1] + 100]) for p in (start, end)]
        found = one.detect(*ends)
        found = found[(found["primitive_a"] == 0)]
        assert len(found) == hit[query]
        if hit[query]:
            assert found["toi"][0] == toi[query]


def test_no_queries_have_no_answers():
    hit, toi = lazyccd.queries.vertex_face(np.zeros((0, 4, 3)), np.zeros((0, 4, 3)))
    assert len(hit) == len(toi) == 0


def test_wrong_points_are_refused():
    start, end = falling_vertices([0.5])
    with pytest.raises(ValueError):
        lazyccd.queries.vertex_face(start[0], end[0])
    with pytest.raises(ValueError):
        lazyccd.queries.vertex_face(start, end[:0])
    end[0, 0, 0] = np.inf
    with pytest.raises(lazyccd.Error) as error:
        lazyccd.queries.vertex_face(start, end)
    assert error.value.code == "non_finite_position"
    with pytest.raises(lazyccd.Error):
        lazyccd.queries.vertex_face(start, start, separation=-1)
