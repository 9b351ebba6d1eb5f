"""The steps of each tier, in the order in which they begin where several could.

The first tier is what a change needs. The second, `ALL=1`, adds other versions of Blender and MeshLab, the cluster,
benchmarks, and the tests that are marked or named `thorough`. The wheel as it is released is tested where releases are
made: .github/workflows/test.yml.
"""

import os
import subprocess
import sys
from pathlib import Path

import platforms

from testing import rust
from testing.graph import Step, file_name
from testing.outputs import CheckOutput, DoctestOutput, PytestOutput, RustOutput

ROOT = Path(__file__).resolve().parents[2]
FIRST, ALL = "first", "all"
# The versions of MeshLab whose pymeshlab is on the package index, and of Blender as a Python module, for which 5.2
# needs Python 3.13. The first of each is that of the first tier.
MESHLAB = ["2025.07", "2022.02", "2023.12"]
BLENDER = ["4.5", "4.2", "5.0", "5.2"]
# The version of MeshLab whose tests also drive the programs of the system, MeshLab 2020.09 and its server.
DESKTOP = "2022.02"
BUILT_EXTENSION = "Blender extension"
DESKTOP_TESTS = ["tests/meshlab/test_server.py", "tests/meshlab/test_gui.py"]
# The wheel of the development profile, packed.
DEVELOPMENT = ROOT / "out" / "tests" / "development"
FILES = DEVELOPMENT / "files"
EXTENSION = ROOT / "out" / "tests" / "extension"


class Plan:
    """The steps of a tier."""

    def __init__(self, tier, record):
        self.thorough = tier == ALL
        self.record = record
        self.built = rust.Built(rust.programs())
        # The folder or file of each step of tests in Python, by the step's name; and all of them with their tiers.
        self.steps, self.folder_of, self.folders = [], {}, [(file, (ALL,)) for file in DESKTOP_TESTS]
        self.preparing()
        self.compiling()
        self.python()
        self.rust()
        self.hosts()
        if self.thorough:
            self.second()

    def add(self, name, command, output=None, **options):
        """Adds a step."""
        given = {"output": output} if output else {}
        self.steps.append(Step(name, command, **given, **options))
        return name

    def environment(self, name):
        """Adds the step that makes a Python environment, once; its name."""
        step = f"environment {name}"
        if step not in [one.name for one in self.steps]:
            self.add(step, ["tools/venv.sh", name], cores=0, holds=("pip",), unavailable=3)
        return step

    def pytest(self, title, environment, folder, tiers=(FIRST, ALL), needs=(), env=None, ignored=(), **options):
        """Adds a folder of tests in Python."""
        self.folders.append((folder, tiers))
        self.folder_of[title] = folder
        record = self.record / f"{file_name(title)}.jsonl"
        record.unlink(missing_ok=True)

        def command():
            flags = ["-q", "-rs", "-p", "no:cacheprovider", *(f"--ignore={one}" for one in ignored)]
            return [python_of(environment), "-m", "pytest", *flags, folder]

        given = {"SURFRECON_TEST_RECORD": str(record)} | (env or {})
        needs = (self.environment(environment), *needs)
        self.add(title, command, PytestOutput(title, record), needs=needs, env=given, **options)

    def preparing(self):
        """Downloads run beside the compiler, in the order in which they are needed."""
        for name in ["lint", "build", "python", f"blender-{BLENDER[0]}", f"meshlab-{MESHLAB[0]}", "docs", "bench"]:
            self.environment(name)

    def compiling(self):
        """Everything that is compiled, once."""
        cores = os.cpu_count() or 1
        self.add("checks", ["tools/check.sh", "quick"], CheckOutput(), needs=(self.environment("lint"),))
        self.add(
            "build",
            rust.BUILD + ["--message-format=json-render-diagnostics"],
            self.built,
            holds=("cargo",),
            cores=cores,
        )
        library = rust.libraries() / "libsurfrecon_python.so"
        pack = [sys.executable, "tools/development_wheel.py", library, DEVELOPMENT]
        self.add("development wheel", pack, needs=("build", self.environment("build")))

    def rust(self):
        """The programs of tests in Rust, and what else cargo checks."""
        for program in self.built.programs.values():
            self.add(
                f"Rust: {program.name}",
                lambda program=program: [*validator(program), *rust.command(program, self.thorough)],
                RustOutput(program.name),
                env=rust.environment(program),
                folder=program.folder,
                needs=("build",),
            )
        self.add("Rust lints", ["tools/check.sh", "lints"], CheckOutput(), needs=("build",), holds=("cargo",))
        self.add(
            "Rust documentation", ["tools/check.sh", "documentation"], CheckOutput(), needs=("build",), holds=("cargo",)
        )
        examples = ["cargo", "test", "--workspace", "--doc", "--no-fail-fast"]
        self.add("Rust: examples in the documentation", examples, DoctestOutput(), needs=("build",), holds=("cargo",))
        built = {"SURFRECON_BUILT": str(rust.libraries())}
        self.add("C library installed", ["tests/c/installed.sh"], CheckOutput(), needs=("build",), env=built)

    def python(self):
        """The package, its documentation and the tools, with the wheel of the development profile."""
        wheel = {"PYTHONPATH": str(FILES), "SURFRECON_LIBRARY": str(rust.libraries() / "libsurfrecon.so")}
        needs = ("development wheel", self.environment("bench"))
        # Programs of others that read what we write are those of the benchmarks.
        self.pytest("Python", "python", "tests/python", env=wheel | peers(), needs=needs)
        self.pytest("site and examples", "docs", "tests/docs", env=wheel, needs=("development wheel",))
        self.pytest("tools", "python", "tests/tools")

    def hosts(self):
        """One Blender and one MeshLab."""
        version = BLENDER[0]
        self.meshlab(MESHLAB[0], self.plugin(f"{MESHLAB[0]}-double"))
        build = [sys.executable, "tools/build_extension.py", "--wheels", DEVELOPMENT / "wheel", "--out", EXTENSION]
        needs = ("development wheel", self.environment(f"blender-{version}"))
        self.add(BUILT_EXTENSION, build, needs=needs)
        self.blender(version)

    def blender(self, version, tiers=(FIRST, ALL)):
        """Adds the tests of the extension in a version of Blender."""
        env = {"EXTENSION_ZIP": str(EXTENSION / f"surfrecon-{platforms.version()}-{platforms.here().name}.zip")}
        if version != BLENDER[0]:
            env["SURFRECON_OTHER_VERSION"] = "1"
        self.pytest(f"Blender {version}", f"blender-{version}", "tests/blender", tiers, (BUILT_EXTENSION,), env)

    def plugin(self, build):
        """Adds the step that builds the MeshLab plugin for a version and precision; its name. It is linked with
        the tested library.
        """
        env = {"SURFRECON_BUILT": str(rust.libraries())}
        command = ["tools/build_meshlab_plugin.sh", build]
        return self.add(f"MeshLab plugin {build}", command, needs=("build",), env=env, unavailable=3)

    def meshlab(self, version, plugin, desktop=None, tiers=(FIRST, ALL)):
        """Adds the tests of the plugin in a version of MeshLab, with those of the programs of the system if their
        plugin is given.
        """
        env = {"PYTHONPATH": str(FILES), "SURFRECON_LIBRARY": str(rust.libraries() / "libsurfrecon.so")}
        env["SURFRECON_PLUGINS"] = str(built_plugin(f"{version}-double"))
        needs = [plugin, "development wheel"]
        if desktop:
            env["SURFRECON_PLUGINS_DESKTOP"] = str(built_plugin("2020.09-float"))
            needs.append(desktop)
        ignored = [] if desktop else DESKTOP_TESTS
        self.pytest(f"MeshLab {version}", f"meshlab-{version}", "tests/meshlab", tiers, needs, env, ignored)

    def second(self):
        """Steps that the second tier adds."""
        needs = {"needs": ("build",), "holds": ("cargo",)}
        for version in BLENDER[1:]:
            self.blender(version, (ALL,))
        desktop = self.plugin("2020.09-float")
        for version in MESHLAB[1:]:
            self.meshlab(version, self.plugin(f"{version}-double"), desktop if version == DESKTOP else None, (ALL,))
        env = {"PYTHONPATH": str(FILES)}
        self.pytest("merges on a cluster", "distributed", "tests/distributed", (ALL,), ("development wheel",), env)
        self.add("Rust lints without features", ["tools/check.sh", "bare"], CheckOutput(), **needs)
        bare = ["cargo", "test", "--package", "surfrecon-io", "--no-default-features", "--test", "without_las"]
        # Other features mean that everything is compiled again, for one test: without optimization.
        plain = {"CARGO_PROFILE_DEV_OPT_LEVEL": "0"}
        self.add("Rust tests without features", bare, DoctestOutput(), env=plain, **needs)
        programs = env | {"SURFRECON_PROGRAMS": str(rust.libraries())} | peers()
        needed = ("development wheel", self.environment("bench"))
        self.pytest("benchmarks on their smallest cases", "python", "tests/bench", (ALL,), needed, programs)


def python_of(environment):
    """The Python of a prepared environment."""
    made = subprocess.run([ROOT / "tools" / "venv.sh", environment], stdout=subprocess.PIPE, text=True, check=True)
    return f"{made.stdout.strip()}/bin/python"


def peers():
    """Names the Python that has the programs of others. The folder is known before it is filled."""
    asked = subprocess.run(
        [ROOT / "tools" / "venv.sh", "--where", "bench"], stdout=subprocess.PIPE, text=True, check=True
    )
    return {"SURFRECON_PEERS": f"{asked.stdout.strip()}/bin/python"}


def validator(program):
    """Names the Khronos validator of glTF for the tests that ask it; without node there is none, and they say so."""
    if program.name != "surfrecon_io":
        return []
    made = subprocess.run([ROOT / "tools" / "gltf_validator.sh"], stdout=subprocess.PIPE, text=True, check=False)
    folder = made.stdout.strip()
    return ["env", f"SURFRECON_GLTF_VALIDATOR={folder}"] if folder else []


def built_plugin(build):
    """The folder of a built MeshLab plugin."""
    return ROOT / "out" / "meshlab-plugin" / build
