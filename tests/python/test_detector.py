"""The detector from numpy: contacts, their memory, errors, and equality with the program lazyccd."""

import json
import os
import subprocess
import threading

import numpy as np
import pytest

import lazyccd


def grid(n, height, slope=0.0):
    """Positions and faces of a square cloth of n x n nodes."""
    x, y = np.meshgrid(np.linspace(-1, 1, n), np.linspace(-1, 1, n), indexing="ij")
    points = np.stack([x.ravel(), y.ravel(), height + slope * x.ravel()], axis=1)
    corner = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
    faces = np.concatenate(
        [
            np.stack([corner, corner + n, corner + 1], axis=1),
            np.stack([corner + 1, corner + n, corner + n + 1], axis=1),
        ]
    )
    return points, faces


def two_cloths(n=12, dtype=np.float64):
    """A cloth that falls through another one. Returns start, end, faces, bodies."""
    lower, faces = grid(n, 0.0)
    upper, more = grid(n, 0.1, slope=0.03)
    upper[:, :2] += 0.0137
    start = np.concatenate([lower, upper]).astype(dtype)
    end = start.copy()
    end[n * n :, 2] -= 0.3
    return start, end, np.concatenate([faces, more + n * n]), np.repeat([0, 1], n * n)


def detector(faces, body_of_vertex, **options):
    return lazyccd.Detector(faces, body_of_vertex=body_of_vertex, backend="cpu", **options)


def test_a_cloth_that_falls_through_another_one_has_contacts_in_order():
    start, end, faces, bodies = two_cloths()
    found = detector(faces, bodies).detect(start, end)
    assert len(found) > 100
    assert set(found["kind"]) == {lazyccd.VERTEX_FACE, lazyccd.EDGE_EDGE}
    assert (found["body_a"] != found["body_b"]).all()
    assert ((found["toi"] >= 0) & (found["toi"] <= 1)).all()
    assert np.allclose(np.linalg.norm(found["normal"], axis=1), 1, atol=1e-5)
    keys = found[["body_a", "body_b", "kind", "primitive_a", "primitive_b"]].tolist()
    assert keys == sorted(keys)


def test_the_weights_of_a_contact_close_its_gap_at_the_time_of_impact():
    start, end, faces, bodies = two_cloths()
    found = detector(faces, bodies).detect(start, end)
    toi = found["toi"][:, None, None]
    points = (1 - toi) * start[found["vertices"]] + toi * end[found["vertices"]]
    gaps = (lazyccd.weights(found)[:, :, None] * points).sum(axis=1)
    assert np.abs(gaps).max() < 1e-6


def test_bodies_of_different_worlds_do_not_meet():
    start, end, faces, body_of_vertex = two_cloths()
    both = detector(faces, body_of_vertex).detect(start, end)
    filters = lazyccd.bodies(2)
    filters["world"] = [0, 1]
    assert len(detector(faces, body_of_vertex, bodies=filters).detect(start, end)) == 0
    filters["world"] = [-1, 1]
    assert detector(faces, body_of_vertex, bodies=filters).detect(start, end).tobytes() == both.tobytes()


def test_float_positions_are_read_as_they_are():
    start, end, faces, bodies = two_cloths(dtype=np.float32)
    single = detector(faces, bodies).detect(start, end)
    double = detector(faces, bodies).detect(start.astype(np.float64), end.astype(np.float64))
    assert single.tobytes() == double.tobytes()


def test_rows_may_lie_apart_or_backwards():
    start, end, faces, bodies = two_cloths()
    expected = detector(faces, bodies).detect(start, end)
    records = np.zeros(len(start), [("x", np.float64, 3), ("mass", np.float64)])
    records["x"] = start
    for layout in (records["x"], np.asfortranarray(start), start[::-1].copy()[::-1], start.tolist()):
        assert detector(faces, bodies).detect(layout, end).tobytes() == expected.tobytes()


def test_contacts_outlive_later_detections_and_the_detector():
    start, end, faces, bodies = two_cloths()
    one = detector(faces, bodies)
    first = one.detect(start, end)
    copy = first.copy()
    for step in range(20):
        one.detect(start, end + 0.001 * step)
    assert first.tobytes() == copy.tobytes()
    del one
    assert first.tobytes() == copy.tobytes()
    assert not first.flags.owndata


def test_the_hash_is_that_of_the_contacts():
    start, end, faces, bodies = two_cloths()
    one = detector(faces, bodies)
    found = one.detect(start, end)
    assert lazyccd.contact_hash(found) == one.stats.hash
    assert lazyccd.contact_hash(found[::-1]) == one.stats.hash
    assert one.stats.contacts_vf + one.stats.contacts_ee == len(found)


def test_results_do_not_depend_on_threads_strategy_or_volume():
    start, end, faces, bodies = two_cloths(30)
    expected = detector(faces, bodies, threads=1).detect(start, end)
    for options in (dict(threads=2), dict(strategy="static_list"), dict(volume="dop18")):
        assert detector(faces, bodies, **options).detect(start, end).tobytes() == expected.tobytes()


def test_threads_of_python_run_side_by_side():
    start, end, faces, bodies = two_cloths(24)
    expected = detector(faces, bodies).detect(start, end).tobytes()
    shared = detector(faces, bodies)
    wrong = []

    def work(own):
        for _ in range(10):
            if own.detect(start, end).tobytes() != expected:
                wrong.append(own)

    workers = [threading.Thread(target=work, args=(shared,)) for _ in range(3)]
    workers.append(threading.Thread(target=work, args=(detector(faces, bodies, threads=1),)))
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join()
    assert not wrong


def test_filters_pinned_vertices_and_disabled_pairs_leave_contacts_out():
    start, end, faces, bodies = two_cloths()
    filters = lazyccd.bodies(2)
    filters["mask"][0] = 0
    assert len(detector(faces, bodies, bodies=filters).detect(start, end)) == 0
    assert len(detector(faces, bodies, disabled_pairs=[(1, 0)]).detect(start, end)) == 0
    pinned = np.zeros(len(start))
    assert len(detector(faces, bodies, inverse_mass=pinned).detect(start, end)) == 0


def test_a_separation_finds_what_comes_near():
    start, end, faces, bodies = two_cloths()
    near = start.copy()
    near[len(start) // 2 :, 2] -= 0.06
    assert len(detector(faces, bodies).detect(start, near)) == 0
    assert len(detector(faces, bodies, separation=0.02).detect(start, near)) > 0


def test_ropes_have_edges():
    rope = lazyccd.Detector([], edges=[(0, 1), (2, 3)], body_of_vertex=[0, 0, 1, 1], backend="cpu")
    start = np.array([(-1, 0, 0), (1, 0, 0), (0, -1, 1), (0, 1, 1)], float)
    end = start.copy()
    end[2:, 2] = -1
    found = rope.detect(start, end)
    assert found["toi"].tolist() == [0.5]
    assert rope.edges.tolist() == [[0, 1], [2, 3]]


def test_an_error_names_body_and_primitive():
    with pytest.raises(lazyccd.Error) as error:
        lazyccd.Detector([(0, 1, 2), (3, 4, 4)], body_of_vertex=[0, 0, 0, 1, 1])
    assert error.value.code == "degenerate_face"
    assert (error.value.body, error.value.primitive) == (1, 1)

    start, end, faces, bodies = two_cloths()
    end[200, 1] = np.nan
    one = detector(faces, bodies)
    with pytest.raises(lazyccd.Error) as error:
        one.detect(start, end)
    assert error.value.code == "non_finite_position"
    assert (error.value.body, error.value.primitive) == (1, 200)
    assert "200" in str(error.value)


@pytest.mark.parametrize(
    "arguments, kind",
    [
        (dict(faces=[(0, 1)]), ValueError),
        (dict(faces=[(0.5, 1.0, 2.0)]), TypeError),
        (dict(faces=[(0, 1, 2**40)]), ValueError),
        (dict(faces=[(0, 1, 2)], vertex_count=2), lazyccd.Error),
        (dict(faces=[(0, 1, 2)], separation=-1), lazyccd.Error),
        (dict(faces=[(0, 1, 2)], threads=-1), lazyccd.Error),
        (dict(faces=[(0, 1, 2)], backend="abacus"), lazyccd.Error),
        (dict(faces=[(0, 1, 2)], strategy="hope"), lazyccd.Error),
        (dict(faces=[(0, 1, 2)], bodies=np.zeros(1)), TypeError),
    ],
)
def test_wrong_arguments_are_refused(arguments, kind):
    with pytest.raises(kind):
        lazyccd.Detector(**arguments)


def test_wrong_positions_are_refused():
    start, end, faces, bodies = two_cloths()
    one = detector(faces, bodies)
    with pytest.raises(ValueError):
        one.detect(start[:, :2], end)
    with pytest.raises(lazyccd.Error) as error:
        one.detect(start[:-1], end[:-1])
    assert error.value.code == "size_mismatch"


def test_an_invalid_topology_keeps_the_old_one():
    start, end, faces, bodies = two_cloths()
    one = detector(faces, bodies)
    expected = one.detect(start, end).tobytes()
    with pytest.raises(lazyccd.Error):
        one.set_topology([(0, 0, 1)])
    assert one.detect(start, end).tobytes() == expected


def write_ply(path, points, faces):
    header = (
        "ply\nformat binary_little_endian 1.0\n"
        f"element vertex {len(points)}\nproperty double x\nproperty double y\nproperty double z\n"
        f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    rows = np.zeros(len(faces), [("count", "u1"), ("face", "<i4", 3)])
    rows["count"], rows["face"] = 3, faces
    path.write_bytes(header.encode() + points.astype("<f8").tobytes() + rows.tobytes())


def test_contacts_are_those_of_the_program(tmp_path):
    program = os.environ.get("LAZYCCD_PROGRAM")
    if not program:
        pytest.skip("LAZYCCD_PROGRAM does not name the program lazyccd")
    start, end, faces, _ = two_cloths(40)
    write_ply(tmp_path / "start.ply", start, faces)
    write_ply(tmp_path / "end.ply", end, faces)
    files = [str(tmp_path / name) for name in ("start.ply", "end.ply", "contacts.csv", "stats.json")]
    subprocess.run(
        [program, "detect", *files[:2], "--backend", "cpu", "--out", files[2], "--stats", files[3]],
        check=True,
        stdout=subprocess.DEVNULL,
    )
    one = lazyccd.Detector(faces, backend="cpu")
    found = one.detect(start, end)
    lines = (tmp_path / "contacts.csv").read_text().split()[1:]
    expected = [line.split(",") for line in lines]
    assert len(expected) == len(found) > 1000
    kinds = {lazyccd.VERTEX_FACE: "vf", lazyccd.EDGE_EDGE: "ee"}
    for row, contact in zip(expected, found):
        assert row[0] == kinds[contact["kind"]]
        assert [int(v) for v in row[1:5]] == contact["vertices"].tolist()
        assert float(row[5]) == contact["toi"]
    hash_text = json.loads((tmp_path / "stats.json").read_text())["hash"]
    assert int(hash_text, 16) == one.stats.hash
