"""Detection of arrays in device memory. Skipped without a GPU or without PyTorch or CuPy."""

import numpy as np
import pytest

import lazyccd


def sheets(n=20):
    """Two sheets of n x n quads, the upper of which falls through the lower one: faces, bodies, both ends."""
    x, z = np.meshgrid(np.arange(n + 1) / n, np.arange(n + 1) / n, indexing="ij")
    corner = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    one = np.concatenate([np.stack([corner, corner + 1, corner + n + 1], 1),
                          np.stack([corner + 1, corner + n + 2, corner + n + 1], 1)])
    count = (n + 1) ** 2
    sheet = np.stack([x.ravel(), 0.02 * np.sin(7 * x + 5 * z).ravel(), z.ravel()], 1)
    start = np.concatenate([sheet, sheet + [0.013, 0.02, 0.017]])
    end = start - np.repeat([[0, 0, 0], [0, 0.04, 0]], count, 0)
    return np.concatenate([one, one + count]), np.repeat([0, 1], count), start, end


def detector(**options):
    faces, body, _, _ = sheets()
    made = lazyccd.Detector(faces, body_of_vertex=body, backend="cuda", **options)
    if made.status != "cuda":
        pytest.skip(made.status)
    return made


def compare(found, contacts, to_numpy):
    count = int(to_numpy(found.status)[2])
    assert count == len(contacts) > 0 and int(to_numpy(found.status)[3]) == 0
    for name in ("kind", "vertices", "normal", "toi"):
        assert np.array_equal(to_numpy(getattr(found, name))[:count], contacts[name])
    assert np.array_equal(to_numpy(found.bodies)[:count, 0], contacts["body_a"])
    assert np.array_equal(to_numpy(found.primitives)[:count, 1], contacts["primitive_b"])
    assert np.array_equal(to_numpy(found.uv)[:count, 1], contacts["v"])


@pytest.mark.parametrize("kind", [np.float32, np.float64])
def test_tensors_of_pytorch_are_read_where_they_are(kind):
    torch = pytest.importorskip("torch")
    d = detector()
    _, _, start, end = (a.astype(kind) if a.dtype.kind == "f" else a for a in sheets())
    expected = d.detect(start, end)
    a, b = torch.from_numpy(start).cuda(), torch.from_numpy(end).cuda()
    stream = torch.cuda.current_stream().cuda_stream
    compare(d.detect_async(a, b, stream=stream), expected, lambda x: torch.from_dlpack(x).cpu().numpy())
    compare(d.synchronize(), expected, lambda x: torch.from_dlpack(x).cpu().numpy())
    assert np.array_equal(d.download_contacts(), expected)
    wide = torch.zeros((len(start), 5), dtype=a.dtype, device="cuda")
    wide[:, :3] = a
    d.detect_async(wide[:, :3], b, stream=stream)
    assert np.array_equal(d.download_contacts(), expected)


def test_arrays_of_cupy_are_read_where_they_are():
    cupy = pytest.importorskip("cupy")
    d = detector()
    _, _, start, end = sheets()
    expected = d.detect(start, end)
    stream = cupy.cuda.get_current_stream().ptr
    compare(d.detect_async(cupy.asarray(start), cupy.asarray(end), stream=stream), expected,
            lambda x: cupy.asnumpy(cupy.asarray(x)))


def test_a_mask_leaves_worlds_out():
    torch = pytest.importorskip("torch")
    d = detector()
    _, _, start, end = sheets()
    a, b = torch.from_numpy(start).cuda(), torch.from_numpy(end).cuda()
    for on in (False, True):
        d.detect_async(a, b, world_mask=torch.tensor([on], device="cuda"))
        assert (len(d.download_contacts()) > 0) == on


class OnTheHost:
    """Pretends to be in device memory."""

    def __init__(self, shape, typestr, strides=None):
        self.__cuda_array_interface__ = {
            "shape": shape, "typestr": typestr, "strides": strides, "data": (0, False), "version": 3}


def test_wrong_arrays_are_refused():
    faces, body, start, end = sheets()
    d = lazyccd.Detector(faces, body_of_vertex=body, backend="cpu")
    with pytest.raises(TypeError):
        d.detect_async(start, end)
    good = OnTheHost((882, 3), "<f4")
    for bad in (OnTheHost((882, 2), "<f4"), OnTheHost((882, 3), "<f8"), OnTheHost((882, 3), "<f4", (4, 3528))):
        with pytest.raises(ValueError):
            d.detect_async(good, bad)
    with pytest.raises(TypeError):
        d.detect_async(good, OnTheHost((882, 3), "<i4"))
    with pytest.raises(TypeError):
        d.detect_async(good, good, world_mask=OnTheHost((1,), "<i4"))
    bodies = lazyccd.bodies(2)
    bodies["world"] = [0, 1]
    two = lazyccd.Detector(faces, body_of_vertex=body, bodies=bodies, backend="cpu")
    with pytest.raises(ValueError, match="2 are needed"):
        two.detect_async(good, good, world_mask=OnTheHost((1,), "|u1"))
    with pytest.raises(lazyccd.Error):
        two.detect_async(good, good, world_mask=OnTheHost((2,), "|u1"))
    with pytest.raises(lazyccd.Error):
        d.detect_async(good, good)  # there is no GPU backend
