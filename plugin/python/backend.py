"""Build backend: scikit-build-core's, with the C++ sources of the checkout added to source distributions.

In a checkout the sources lie two folders up. A source distribution carries them in its folder source/.
"""

import os
import shutil
import tempfile
from pathlib import Path

from scikit_build_core import build as _build
from scikit_build_core.build import *  # noqa: F401,F403

_here = Path(__file__).resolve().parent
_checkout = _here.parent.parent
# pip names this backend to its child process in the environment. CMake runs another pip, which must not inherit that.
for _name in [n for n in os.environ if n.startswith(("_PYPROJECT_HOOKS_", "PEP517_"))]:
    del os.environ[_name]
_sources = ("CMakeLists.txt", "LICENSE", "third_party_notes.md", "cuda", "plugin")


def build_sdist(sdist_directory, config_settings=None):
    """Makes a source distribution in `sdist_directory` and returns its name."""
    if (_here / "source").exists():  # this is one already
        return _build.build_sdist(sdist_directory, config_settings)
    directory = os.path.abspath(sdist_directory)
    before = os.getcwd()
    with tempfile.TemporaryDirectory() as temporary:
        stage = Path(temporary) / "lazyccd"
        ignored = shutil.ignore_patterns("build", "dist", "__pycache__", "*.egg-info")
        shutil.copytree(_here, stage, ignore=ignored)
        (stage / "source").mkdir()
        for name in _sources:
            if (_checkout / name).is_dir():
                ignored = shutil.ignore_patterns("python", "javascript", "__pycache__", "*.svg")
                shutil.copytree(_checkout / name, stage / "source" / name, ignore=ignored)
            else:
                shutil.copy(_checkout / name, stage / "source" / name)
        os.chdir(stage)
        try:
            return _build.build_sdist(directory, config_settings)
        finally:
            os.chdir(before)
