"""Five scenes of cloth as plain data: SI units, z points upward. No simulator is named here.

    ball       a cloth is laid on a fixed ball and comes to rest
    throw10    the same cloth is thrown at the ball at 10 m/s
    throw30    at 30 m/s
    second     a second cloth falls from 5.1 m, at 10 m/s, onto the first, which lies on the ball
    fold       the upper half of a folded strip falls on its lower half, which lies on a table

A cloth collides with itself in the last scene alone.
"""
from dataclasses import dataclass
from math import cos, pi, sin
from typing import Tuple

import numpy

FRAME = 1 / 60  # s
GRAVITY = 9.81  # m/s^2, downward
THICKNESS = 0.01  # m, between two layers of cloth; a layer keeps half of it from a ball or a table
FRICTION = 0.5  # Coulomb's coefficient of all pairs
DENSITY = 0.4  # kg/m^2
MEMBRANE = 1000.0  # N/m, stiffness of a layer: Young's modulus times thickness
BENDING = 8e-5  # N m, flexural rigidity of a layer

NODES = 31  # along a side of a cloth
WIDTH = 1.0  # m
RADIUS = 0.3  # m, of the ball, whose centre is the origin
CLEARANCE = 0.02  # m, between the surfaces of what starts near each other


class Unsupported(Exception):
    """A simulator cannot do what a scene asks for."""


@dataclass(frozen=True)
class Cloth:
    nodes: numpy.ndarray  # (n, 3), m; edges are unstretched here
    faces: numpy.ndarray  # (f, 3), indices of nodes
    mass: float  # kg; DENSITY times its area
    velocity: Tuple[float, float, float] = (0.0, 0.0, 0.0)  # m/s, of all nodes at the start


@dataclass(frozen=True)
class Scene:
    name: str
    cloths: Tuple[Cloth, ...]
    seconds: float
    ball: bool  # the ball is there
    table: bool  # a table is there; its top is the plane z = 0
    folds: bool = False  # a cloth meets itself

    @property
    def meets(self):
        """Whether cloth collides with cloth."""
        return self.folds or len(self.cloths) > 1

    @property
    def fastest(self):
        """Speed in m/s that nothing exceeds in free flight until the first contact of each cloth."""
        thrown = max(abs(cloth.velocity[2]) for cloth in self.cloths)
        drop = max(cloth.nodes[:, 2].max() for cloth in self.cloths) - (RADIUS if self.ball else 0.0)
        return (thrown**2 + 2 * GRAVITY * drop) ** 0.5

    @property
    def frames(self):
        return round(self.seconds / FRAME)

    @property
    def first_nodes(self):
        """Index of each cloth's first node, if the nodes of all cloths are numbered in turn."""
        counts = [len(cloth.nodes) for cloth in self.cloths]
        return numpy.concatenate([[0], numpy.cumsum(counts)[:-1]]).astype(int)

    @property
    def nodes(self):
        return numpy.concatenate([cloth.nodes for cloth in self.cloths])

    @property
    def faces(self):
        return numpy.concatenate([cloth.faces + first for cloth, first in zip(self.cloths, self.first_nodes)])


def edges_of(faces):
    """Returns the edges of triangles, each once."""
    sides = numpy.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    return numpy.unique(numpy.sort(sides, axis=1), axis=0)


def grid_faces(columns, rows):
    """Triangles of a grid whose node (i, j) has the index i * rows + j. Diagonals alternate."""
    faces = []
    for i in range(columns - 1):
        for j in range(rows - 1):
            a, b, c, d = i * rows + j, i * rows + j + 1, (i + 1) * rows + j, (i + 1) * rows + j + 1
            faces += [(a, c, b), (b, c, d)] if (i + j) % 2 else [(a, c, d), (a, d, b)]
    return numpy.array(faces)


def sheet(height, velocity=0.0, turned=0.0, aside=(0.0, 0.0)):
    """A level square cloth: height and aside in m, velocity in m/s downward, turned in radians."""
    line = numpy.linspace(-WIDTH / 2, WIDTH / 2, NODES)
    x, y = (axis.ravel() for axis in numpy.meshgrid(line, line, indexing="ij"))
    c, s = numpy.cos(turned), numpy.sin(turned)
    level = numpy.full(len(x), height)
    nodes = numpy.stack([c * x - s * y + aside[0], s * x + c * y + aside[1], level], axis=1)
    return Cloth(nodes, grid_faces(NODES, NODES), DENSITY * WIDTH**2, (0.0, 0.0, -velocity))


def folded_strip():
    """A strip of 15 x 48 nodes: 20 rows on the table, half a turn, and 20 rows above them."""
    columns, flat, turn = 15, 20, 9  # turn: edges of the half circle
    spacing = WIDTH / (NODES - 1)
    radius = spacing / (2 * sin(pi / (2 * turn)))  # so that all edges along the strip have the same length
    bottom = THICKNESS / 2 + CLEARANCE
    profile = [(j * spacing, bottom) for j in range(flat)]
    for k in range(1, turn):
        angle = pi * k / turn
        profile.append(((flat - 1) * spacing + radius * sin(angle), bottom + radius * (1 - cos(angle))))
    profile += [((flat - 1 - j) * spacing, bottom + 2 * radius) for j in range(flat)]
    nodes = numpy.array([(i * spacing, y, z) for i in range(columns) for y, z in profile])
    area = spacing**2 * (columns - 1) * (len(profile) - 1)
    return Cloth(nodes, grid_faces(columns, len(profile)), DENSITY * area)


def rest(seconds=2.0):
    return Scene("ball", (sheet(RADIUS + THICKNESS / 2 + CLEARANCE),), seconds, True, False)


def thrown(speed):
    """The ball, and a cloth that starts 0.3 m above it."""
    return Scene(f"throw{speed:.0f}", (sheet(2 * RADIUS, velocity=speed),), 1.0, True, False)


def second():
    """Free fall gives the second cloth its 10 m/s after 1.02 s."""
    first = sheet(RADIUS + THICKNESS / 2 + CLEARANCE)
    upper = sheet(RADIUS + 10.0**2 / (2 * GRAVITY), turned=0.5, aside=(0.02, 0.03))
    return Scene("second", (first, upper), 2.0, True, False)


def fold():
    return Scene("fold", (folded_strip(),), 1.0, False, True, folds=True)


SCENES = {scene.name: scene for scene in (rest(), thrown(10.0), thrown(30.0), second(), fold())}
