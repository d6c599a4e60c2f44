"""A small software renderer: triangles with a depth buffer, in numpy.

matplotlib's 3D axes sort whole triangles by depth, which hides just what these pictures are to show:
cloth that sticks through cloth.
"""

import numpy as np


def read_ply(path):
    """Vertices (n x 3) and triangles of a binary little-endian PLY as `lazyccd simulate` writes it."""
    with open(path, "rb") as file:
        data = file.read()
    end = data.index(b"end_header\n") + len(b"end_header\n")
    header = data[:end].decode()
    if "format binary_little_endian" not in header:
        raise ValueError(f"{path}: not a binary little-endian PLY")
    count = {}
    for line in header.splitlines():
        if line.startswith("element"):
            count[line.split()[1]] = int(line.split()[2])
    scalar = "<f8" if "property double x" in header or "property float64 x" in header else "<f4"
    vertices = np.frombuffer(data, scalar, 3 * count["vertex"], end).reshape(-1, 3)
    face = np.dtype([("count", "u1"), ("vertices", "<i4", 3)])
    faces = np.frombuffer(data, face, count["face"], end + vertices.nbytes)
    if not (faces["count"] == 3).all():
        raise ValueError(f"{path}: a face that is not a triangle")
    return vertices.astype(float), faces["vertices"].copy()


def components(vertex_count, faces):
    """Number of the connected component of each vertex, from 0 in the order of first vertices."""
    label = np.arange(vertex_count)
    while True:
        smallest = label[faces].min(axis=1)
        new = label.copy()
        for corner in range(3):
            np.minimum.at(new, faces[:, corner], smallest)
        new = new[new]
        if (new == label).all():
            return np.unique(label, return_inverse=True)[1]
        label = new


def sphere(centre, radius, rings=48):
    u, v = np.meshgrid(np.linspace(0, 2 * np.pi, 2 * rings + 1), np.linspace(0, np.pi, rings + 1))
    points = np.stack([np.cos(u) * np.sin(v), np.cos(v), np.sin(u) * np.sin(v)], -1).reshape(-1, 3)
    index = np.arange((rings + 1) * (2 * rings + 1)).reshape(rings + 1, 2 * rings + 1)
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]
    faces = np.concatenate([np.stack([a, b, c], -1).reshape(-1, 3), np.stack([a, c, d], -1).reshape(-1, 3)])
    return np.asarray(centre) + radius * points, faces


def box(low, high):
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    points, faces = [], []
    for quad in quads:  # no shared vertices: edges stay sharp
        first = len(points)
        points += [np.asarray(low) + corners[i] * (np.asarray(high) - np.asarray(low)) for i in quad]
        faces += [(first, first + 1, first + 2), (first, first + 2, first + 3)]
    return np.array(points), np.array(faces)


class Camera:
    def __init__(self, eye, target, width, height, field=0.6):
        self.eye = np.asarray(eye, float)
        back = self.eye - np.asarray(target, float)
        back /= np.linalg.norm(back)
        right = np.cross([0, 1, 0], back)
        right /= np.linalg.norm(right)
        self.axes = np.stack([right, np.cross(back, right), back])
        self.width, self.height = width, height
        self.scale = 0.5 * height / np.tan(0.5 * field)

    def project(self, points):
        """Pixel x, pixel y and 1 / depth of each point."""
        local = (points - self.eye) @ self.axes.T
        inverse = -1 / local[:, 2]
        x = 0.5 * self.width + self.scale * local[:, 0] * inverse
        y = 0.5 * self.height - self.scale * local[:, 1] * inverse
        return x, y, inverse


class Picture:
    """An image and its depths (as 1 / depth, so larger is nearer)."""

    def __init__(self, camera, background=(1.0, 1.0, 1.0)):
        self.camera = camera
        self.image = np.tile(np.asarray(background, float), (camera.height, camera.width, 1))
        self.nearness = np.zeros((camera.height, camera.width))

    def draw(self, points, faces, colour, light=(0.45, 0.8, 0.4), front_only=False):
        """Smooth shading, both sides lit; `colour` once, or a pair for the two sides."""
        light = np.asarray(light) / np.linalg.norm(light)
        colours = np.broadcast_to(np.asarray(colour, float), (2, 3))
        a, b, c = (points[faces[:, k]] for k in range(3))
        flat = np.cross(b - a, c - a)
        normals = np.zeros_like(points)
        for corner in range(3):
            np.add.at(normals, faces[:, corner], flat)
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
        x, y, inverse = self.camera.project(points)
        towards = np.einsum("ij,ij->i", flat, self.camera.eye - a)
        for face, facing in zip(faces, towards):
            if front_only and facing <= 0:
                continue
            self._fill(face, x, y, inverse, normals * (1 if facing > 0 else -1),
                       colours[0 if facing > 0 else 1], light)

    def _fill(self, face, x, y, inverse, normals, colour, light):
        px, py, pw = x[face], y[face], inverse[face]
        x0, x1 = max(0, int(np.floor(px.min()))), min(self.camera.width - 1, int(np.ceil(px.max())))
        y0, y1 = max(0, int(np.floor(py.min()))), min(self.camera.height - 1, int(np.ceil(py.max())))
        area = (px[1] - px[0]) * (py[2] - py[0]) - (px[2] - px[0]) * (py[1] - py[0])
        if x0 > x1 or y0 > y1 or area == 0 or (pw <= 0).any():
            return
        gx, gy = np.meshgrid(np.arange(x0, x1 + 1) + 0.5, np.arange(y0, y1 + 1) + 0.5)
        w0 = ((px[1] - gx) * (py[2] - gy) - (px[2] - gx) * (py[1] - gy)) / area
        w1 = ((px[2] - gx) * (py[0] - gy) - (px[0] - gx) * (py[2] - gy)) / area
        w2 = 1 - w0 - w1
        nearness = w0 * pw[0] + w1 * pw[1] + w2 * pw[2]
        region = self.nearness[y0:y1 + 1, x0:x1 + 1]
        seen = (w0 >= 0) & (w1 >= 0) & (w2 >= 0) & (nearness > region)
        if not seen.any():
            return
        n = (w0[seen, None] * normals[face[0]] + w1[seen, None] * normals[face[1]] +
             w2[seen, None] * normals[face[2]])
        n /= np.maximum(np.linalg.norm(n, axis=1, keepdims=True), 1e-30)
        cosine = n @ light
        # Half of the light wraps around, as from a bright sky.
        shade = 0.30 + 0.25 * (0.5 + 0.5 * n[:, 1]) + 0.5 * np.maximum(cosine, 0)
        region[seen] = nearness[seen]
        self.image[y0:y1 + 1, x0:x1 + 1][seen] = np.clip(shade[:, None] * colour, 0, 1)

    def mark(self, points, colour, radius, slack):
        """Discs at points that are not hidden by more than `slack` metres."""
        if len(points) == 0:
            return
        x, y, inverse = self.camera.project(np.asarray(points, float))
        rows, columns = np.mgrid[0:self.camera.height, 0:self.camera.width]
        for cx, cy, w in zip(x, y, inverse):
            i0, i1 = max(0, int(cy - radius)), min(self.camera.height, int(cy + radius) + 2)
            j0, j1 = max(0, int(cx - radius)), min(self.camera.width, int(cx + radius) + 2)
            if i0 >= i1 or j0 >= j1 or w <= 0:
                continue
            near = 1 / w - slack <= 1 / np.maximum(self.nearness[i0:i1, j0:j1], 1e-9)
            disc = (rows[i0:i1, j0:j1] + 0.5 - cy) ** 2 + (columns[i0:i1, j0:j1] + 0.5 - cx) ** 2
            self.image[i0:i1, j0:j1][near & (disc <= radius * radius)] = colour

    def reduced(self, factor):
        """The image averaged over factor x factor pixels."""
        h, w = self.camera.height // factor, self.camera.width // factor
        return self.image[:h * factor, :w * factor].reshape(h, factor, w, factor, 3).mean(axis=(1, 3))
