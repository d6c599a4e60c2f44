"""Conan recipe. `conan create plugin/packages/conan` builds the sources of this checkout.

The option `dependencies` says where Bullet, Boost and Eigen come from: Conan's packages, or the system.
"""

from pathlib import Path

from conan import ConanFile
from conan.tools.build import check_min_cppstd
from conan.tools.cmake import CMake, CMakeDeps, CMakeToolchain, cmake_layout
from conan.tools.files import copy


class LazyCCD(ConanFile):
    name = "lazyccd"
    version = "0.2.0"
    description = "Exact continuous collision detection for Bullet's soft bodies"
    license = "Zlib"
    settings = "os", "compiler", "build_type", "arch"
    options = {
        "shared": [True, False],
        "fPIC": [True, False],
        "cuda": [True, False],
        "dependencies": ["conan", "system"],
    }
    default_options = {"shared": False, "fPIC": True, "cuda": False, "dependencies": "conan"}

    def config_options(self):
        if self.settings.os == "Windows":
            del self.options.fPIC

    def export_sources(self):
        root = str(Path(self.recipe_folder).parents[2])
        for pattern in ("CMakeLists.txt", "LICENSE", "third_party_notes.md", "cuda/*", "plugin/*"):
            copy(self, pattern, root, self.export_sources_folder, excludes=("plugin/python/*",))

    def requirements(self):
        if self.options.dependencies == "conan":
            self.requires("bullet3/3.25", transitive_headers=True, transitive_libs=True)
            self.requires("boost/1.84.0", options={"header_only": True}, visible=False)
            self.requires("eigen/3.4.0", visible=False)

    def validate(self):
        check_min_cppstd(self, 17)

    def layout(self):
        cmake_layout(self)

    def generate(self):
        CMakeDeps(self).generate()
        toolchain = CMakeToolchain(self)
        toolchain.cache_variables["LAZYCCD_CUDA"] = bool(self.options.cuda)
        toolchain.cache_variables["LAZYCCD_EXAMPLES"] = False
        toolchain.generate()

    def build(self):
        cmake = CMake(self)
        cmake.configure()
        cmake.build()

    def package(self):
        CMake(self).install()

    def package_info(self):
        # LazyCCD's own config file finds Bullet and makes the targets.
        self.cpp_info.set_property("cmake_find_mode", "none")
        self.cpp_info.builddirs = ["lib/cmake/LazyCCD"]
        self.cpp_info.libs = []
