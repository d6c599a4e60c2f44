"""Robots of URDF files that handle cloth, as examples/robots.py shows them."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("pybullet")
import lazyccd.pybullet as plugin  # noqa: E402

if not plugin._LIBRARY.exists():
    pytest.skip("the package was built without the plugin library", allow_module_level=True)

PROGRAM = Path(__file__).resolve().parents[2] / "plugin" / "python" / "examples" / "robots.py"


def run(name, *options):
    command = [sys.executable, str(PROGRAM), "--one", name, "--lazy", *options]
    output = subprocess.run(command, stdout=subprocess.PIPE, check=True, universal_newlines=True, timeout=300).stdout
    return json.loads(output.splitlines()[-1])


def test_two_fingers_of_a_urdf_take_a_cloth_and_lift_it():
    figures = run("gripper")
    assert figures["lifted"] > 0.35  # the lift rises by 0.4 m
    assert figures["in the fingers"] == 0 and figures["below the ground"] == 0
    assert figures["newtons"] > 20  # two fingers of 20 N
    assert figures["fastest node"] < 4  # m/s


def test_a_robot_presses_a_cloth_on_a_table():
    figures = run("press")
    assert figures["below the table's top"] == 0
    assert 0 < figures["hand above the table"] < 0.02  # the cloth is between
    assert figures["newtons"] > 50
    assert figures["fastest node"] < 4


def test_the_plane_of_a_urdf_has_the_contacts_of_a_plane():
    urdf, shape = run("plane"), run("shape")
    assert urdf["below the ground"] == shape["below the ground"] == 0
    assert urdf["contacts"] > 0
    assert urdf["contacts"] <= 1.1 * shape["contacts"]


def test_pictures_come_from_the_software_renderer(tmp_path):
    image_module = pytest.importorskip("PIL.Image")
    run("gripper", "--pictures", str(tmp_path))
    picture = image_module.open(tmp_path / "gripper-lazyccd.webp")
    assert picture.size == (480, 360) and len(picture.getcolors(1 << 20)) > 100
