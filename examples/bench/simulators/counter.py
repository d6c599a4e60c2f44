"""The judge of all simulators: it sees nothing but positions of nodes before and after a step."""
import lazyccd
import lazyccd.queries
import numpy

from scenes import FRAME, RADIUS, edges_of

DEEP = 0.001  # m; a node counts as inside if it is deeper


class Counter:
    """Counts what goes wrong in a run.

    A step is the straight motion of all nodes between two states of the simulator, one substep apart. Over a
    whole frame it would cut corners that the simulator did not cut.
    """

    def __init__(self, scene):
        self.scene = scene
        self.faces = scene.faces
        self.edges = edges_of(self.faces)
        self.rest_lengths = self.lengths(scene.nodes)
        self.body = numpy.repeat(range(len(scene.cloths)), [len(cloth.nodes) for cloth in scene.cloths])
        filters = lazyccd.bodies(len(scene.cloths))
        filters["self_collision"] = scene.folds
        self.detector = lazyccd.Detector(self.faces, vertex_count=len(self.body), body_of_vertex=self.body,
                                         bodies=filters, backend="cpu", threads=1)
        self.finite = True
        self.pass_throughs = 0  # pairs of vertex and face, or of two edges, that met, over all steps
        self.inside_worst = 0  # nodes inside of the ball or the table, largest number at a time
        self.deepest = 0.0  # m, of these
        self.stretch_worst = 1.0  # longest edge over its rest length
        self.last_frame = self.before_last = scene.nodes

    def lengths(self, nodes):
        return numpy.linalg.norm(nodes[self.edges[:, 0]] - nodes[self.edges[:, 1]], axis=1)

    def stretch(self, nodes):
        return float((self.lengths(nodes) / self.rest_lengths).max())

    def depths(self, before, after):
        """How deep each node is inside of the ball or below the table at the end of its step, in m.

        A node whose straight path comes nearer to the ball's centre than half of the radius went through. A
        path that only cuts off a piece of the ball may belong to a node that slides around it.
        """
        if self.scene.table:
            return -after[:, 2]
        depth = RADIUS - numpy.linalg.norm(after, axis=1)
        motion = after - before
        squared = numpy.maximum((motion**2).sum(axis=1), 1e-30)
        nearest = numpy.clip(-(before * motion).sum(axis=1) / squared, 0, 1)  # part of the step
        deepest = RADIUS - numpy.linalg.norm(before + nearest[:, None] * motion, axis=1)
        return numpy.where(deepest > RADIUS / 2, deepest, depth)

    def step(self, before, after):
        """Counts one step of the simulator. Returns whether the run can go on."""
        if not (numpy.isfinite(after).all() and numpy.abs(after).max() < 1e4):
            self.finite = False
            return False
        self.pass_throughs += len(self.detector.detect(before, after))
        depth = self.depths(before, after)
        self.inside_worst = max(self.inside_worst, int((depth > DEEP).sum()))
        self.deepest = max(self.deepest, float(depth.max()))
        self.stretch_worst = max(self.stretch_worst, self.stretch(after))
        return True

    def frame(self, nodes):
        """Takes the state at the end of a frame."""
        self.before_last, self.last_frame = self.last_frame, nodes

    def result(self):
        """Returns all figures as a table of names and values."""
        end, speeds = self.last_frame, self.last_frame - self.before_last
        return {
            "finite": self.finite,
            "inside_worst": self.inside_worst,
            "inside_end": int((self.depths(end, end) > DEEP).sum()),
            "deepest_mm": 1e3 * max(self.deepest, 0.0),
            "pass_throughs": self.pass_throughs,
            "intersections_end": self.intersections(end),
            "stretch_worst": self.stretch_worst,
            "stretch_end": self.stretch(end),
            "height_end_m": float(end[:, 2].mean()),
            "fastest_end_m_s": float(numpy.linalg.norm(speeds, axis=1).max()) / FRAME,
        }

    def intersections(self, nodes):
        """Number of pairs of an edge and a face that cut each other.

        Pairs that share a node are left out; in scenes without folds also those of one cloth.
        """
        low, high = (nodes[self.faces].min(axis=1), nodes[self.faces].max(axis=1))
        found = 0
        for some in numpy.array_split(self.edges, max(1, len(self.edges) // 256)):
            edge_low, edge_high = nodes[some].min(axis=1), nodes[some].max(axis=1)
            near = ((edge_low[:, None] <= high[None]) & (edge_high[:, None] >= low[None])).all(axis=2)
            edge, face = numpy.nonzero(near)
            apart = ~(some[edge][:, :, None] == self.faces[face][:, None, :]).any(axis=(1, 2))
            if not self.scene.folds:
                apart &= self.body[some[edge, 0]] != self.body[self.faces[face, 0]]
            edge, face = edge[apart], face[apart]
            # A point that runs along the edge meets the face exactly if the edge cuts it.
            corners = nodes[self.faces[face]]
            start = numpy.concatenate([nodes[some[edge, :1]], corners], axis=1)
            end = numpy.concatenate([nodes[some[edge, 1:]], corners], axis=1)
            found += int(lazyccd.queries.vertex_face(start, end, threads=1).hit.sum())
        return found
