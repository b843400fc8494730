"""The house scripts: check_rooms finds each kind of violation, format leaves comments alone, install asks apt-get for what is missing and for nothing else."""
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

SCRIPTS = pathlib.Path(__file__).resolve().parent.parent / "scripts"


class CheckRooms(unittest.TestCase):
    def check(self, files):
        with tempfile.TemporaryDirectory() as root:
            (pathlib.Path(root) / "common").mkdir()
            for name, text in files.items():
                path = pathlib.Path(root) / name
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_text(text)
            done = subprocess.run([sys.executable, SCRIPTS / "check_rooms", root], capture_output=True, text=True, check=False)
            return done.returncode, done.stdout

    def assert_refused(self, file, text, line, words):
        code, printed = self.check({file: text})
        self.assertEqual(code, 1, f"{file}: {text}")
        self.assertTrue(printed.startswith(f"{file}:{line}: "), printed)
        self.assertIn(words, printed)

    def assert_accepted(self, file, text):
        self.assertEqual(self.check({file: text}), (0, ""))

    def test_arrows_hold_one_way(self):
        self.assert_accepted("common/law/law.hpp", '#include "common/observer/dob.hpp"\n#include "common/law/x.hpp"\n')
        self.assert_refused("common/observer/dob.hpp", '// one\n#include "common/law/law.hpp"\n', 2, "observer may include only: signal")
        self.assert_refused("common/signal/a.hpp", '#include "common/plant/motor.hpp"\n', 1, "signal may include only: nothing")
        self.assert_refused("common/plant/a.cpp", '#  include   "proto/scene.pb.h"\n', 1, "plant")

    def test_single_files_of_a_room_may_be_let_in(self):
        self.assert_accepted("common/station/station.hpp", '#include "common/link/packet.hpp"\n')
        self.assert_refused("common/station/station.hpp", '#include "common/link/codec.hpp"\n', 1, "common/link/codec.hpp")

    def test_common_never_includes_a_program(self):
        for folder in ("master", "slave", "netem", "tests"):
            self.assert_refused("common/config/a.hpp", f'#include "{folder}/a.hpp"\n', 1, folder)
        self.assert_accepted("netem/a.hpp", '#include "common/link/packet.hpp"\n#include <vector>\n')

    def test_the_product_includes_nothing_of_tests_and_the_lab_is_at_the_end(self):
        for file in ("master/main.cpp", "slave/main.cpp", "netem/main.cpp", "netem/lab/main.cpp"):
            self.assert_refused(file, '#include "tests/support/a.hpp"\n', 1, "tests/support/a.hpp")
            self.assert_accepted(file, '#include "common/link/packet.hpp"\n')
        for file in ("master/main.cpp", "slave/mcu/emulator.cpp", "netem/shim.cpp"):
            self.assert_refused(file, '#include "netem/lab/simulation.hpp"\n', 1, "netem/lab/simulation.hpp")
        self.assert_accepted("netem/lab/a.cpp", '#include "slave/mcu/emulator.hpp"\n#include "netem/lab/simulation.hpp"\n')
        self.assert_accepted("tests/a_test.cpp", '#include "netem/lab/simulation.hpp"\n#include "tests/support/dice.hpp"\n')

    def test_a_law_knows_no_drive_and_a_station_no_architecture(self):
        self.assert_refused("common/law/a.hpp", "// one\nDirectDrive<1> drive;\n", 2, "names DirectDrive")
        self.assert_refused("common/law/a.hpp", "void f(const Station<Io>&);\n", 1, "names Station")
        self.assert_refused("common/law/a.hpp", "ReferenceIo<1> io;\n", 1, "names ReferenceIo")
        self.assert_accepted("common/law/a.hpp", "// A drive, a Station\nWish<1> wish;\n")
        self.assert_refused("common/station/a.hpp", '#include "common/law/wave.hpp"\n', 1, "common/law/wave.hpp")
        self.assert_accepted("common/station/a.hpp", '#include "common/law/law.hpp"\n')
        self.assert_refused("common/station/a.hpp", "Cdob<1> cdob;\n", 1, "names Cdob, but a station knows no architecture")
        self.assert_accepted("common/station/a.hpp", "FourChannelGains K;  // after a Mediator\n")
        self.assert_refused("common/law/a.hpp", "#include <memory>\n", 1, "<memory>")
        self.assert_accepted("common/law/architectures.hpp", "#include <memory>\n")

    def test_headers_banned_inside_a_tick(self):
        for header in ("chrono", "functional", "iostream", "map", "memory", "mutex", "string", "thread", "vector"):
            for file in ("common/signal/a.hpp", "common/station/a.cpp", "common/link/receiver.hpp"):
                self.assert_refused(file, f"#include <{header}>\n", 1, f"<{header}>")
            self.assert_accepted("common/link/udp.hpp", f"#include <{header}>\n")
        self.assert_accepted("common/signal/a.hpp", "#include <array>\n")

    def test_firmware_is_freestanding(self):
        core = "slave/mcu/orthosis_mcu"
        self.assert_accepted(f"{core}.cpp", f'#include <stdint.h>\n#include "common/device/mcu_frame.hpp"\n#include "{core}.hpp"\n')
        self.assert_accepted("slave/mcu/emulator.hpp", f'#include <cmath>\n#include "{core}.hpp"\n')
        self.assert_refused(f"{core}.hpp", "#include <cstdint>\n", 1, "firmware")
        self.assert_refused(f"{core}.hpp", '#include "slave/mcu/emulator.hpp"\n', 1, "firmware")
        self.assert_refused("common/device/mcu_frame.hpp", '#include "common/signal/joints.hpp"\n', 1, "firmware")

    def test_includes_are_written_from_the_root(self):
        self.assert_refused("common/signal/a.cpp", '#include "a.hpp"\n', 1, "from the root")
        self.assert_refused("master/a.cpp", '#include "../common/signal/a.hpp"\n', 1, "from the root")

    def test_a_new_room_needs_arrows(self):
        self.assert_refused("common/novel/a.hpp", '#include "common/signal/a.hpp"\n', 1, "no arrows yet")


class Format(unittest.TestCase):
    EQUATIONS = "//   a = b     (1)\n//   c = d + e     (2)\n// f\n"

    def format(self, text, *options):
        with tempfile.TemporaryDirectory() as folder:
            root = pathlib.Path(folder)
            (root / "scripts").mkdir()
            for name in ("scripts/format", ".clang-format"):
                shutil.copy(SCRIPTS.parent / name, root / name)
            for room in ("common", "master", "slave", "netem", "tests"):
                (root / room).mkdir()
            file = root / "common/a.hpp"
            file.write_text(text)
            done = subprocess.run([root / "scripts/format", *options], capture_output=True, text=True, check=False)
            return done, file.read_text()

    def test_leaves_equations_and_tables_as_they_are_written(self):
        done, after = self.format(self.EQUATIONS + "int  a;\n")
        self.assertEqual((done.returncode, after), (0, self.EQUATIONS + "int a;\n"), done.stderr)

    def test_names_a_comment_that_is_too_wide(self):
        for wide in ("// " + "a" * 118 + "\n", "int a;  // " + "a" * 120 + "\n"):
            done, after = self.format(self.EQUATIONS + wide, "--check")
            self.assertEqual((done.returncode, after), (1, self.EQUATIONS + wide))
            self.assertIn("common/a.hpp:4:", done.stdout)
            self.assertIn("120 columns", done.stderr)


class Install(unittest.TestCase):
    def install(self, installed, *options, apt_exit=0, tools=("npm",)):
        with tempfile.TemporaryDirectory() as folder:
            log = pathlib.Path(folder) / "log"
            log.touch()
            lines = "\n".join(f"{name} installed" for name in installed)
            fakes = {
                "dpkg-query": f"cat <<'END'\n{lines}\nEND\nexit 1",
                "apt-get": f'echo "$@" >> {log}\ncase "$*" in *install*) exit {apt_exit};; esac',
                "id": "echo 0",
                **{tool: "exit 0" for tool in tools},
            }
            for name in ("bash", "sed", "tr", "grep", "dirname", "env", "mktemp", "tail", "rm", "cat"):
                os.symlink(subprocess.check_output(["which", name], text=True).strip(), pathlib.Path(folder) / name)
            for name, body in fakes.items():
                path = pathlib.Path(folder) / name
                path.write_text(f"#!/bin/sh\n{body}\n")
                path.chmod(0o755)
            done = subprocess.run([SCRIPTS / "install", *options], env={"PATH": folder}, capture_output=True, text=True, check=False,
                                  stdin=subprocess.DEVNULL)
            return done, log.read_text()

    def packages(self, tests=True):
        lines = [line.split("#")[0].split() for line in (SCRIPTS / "packages.txt").read_text().splitlines()]
        self.assertTrue(all(line[1:] in ([], ["tests"]) for line in lines if line), lines)
        return [line[0] for line in lines if line and (tests or len(line) == 1)]

    def test_does_nothing_when_all_is_there(self):
        for options in ((), ("tests",)):
            done, asked = self.install(self.packages(), *options)
            self.assertEqual((done.returncode, done.stdout, asked), (0, "", ""), done.stderr)

    def test_a_session_needs_nothing_that_only_tests_need(self):
        product = self.packages(tests=False)
        self.assertTrue({"libgtest-dev", "libsundials-dev"}.isdisjoint(product), product)
        done, asked = self.install(product, tools=())
        self.assertEqual((done.returncode, done.stdout, asked), (0, "", ""), done.stderr)
        done, asked = self.install(product, "tests")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("libgtest-dev", asked)

    def test_installs_only_what_is_missing_and_says_so(self):
        done, asked = self.install([p for p in self.packages() if p not in ("g++", "ccache")])
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(done.stdout, "installing: ccache g++\n")
        self.assertTrue(asked.splitlines()[-1].endswith("install --no-install-recommends ccache g++"), asked)

    def test_takes_npm_from_debian_only_if_there_is_none(self):
        done, asked = self.install(self.packages(), "tests", tools=())
        self.assertIn("nodejs npm", asked)
        self.assertEqual(done.returncode, 0, done.stderr)

    def test_says_what_could_not_be_installed(self):
        done, _ = self.install([p for p in self.packages() if p != "cmake"], apt_exit=100)
        self.assertEqual(done.returncode, 1)
        self.assertIn("could not install: cmake", done.stderr)

    def test_refuses_what_it_does_not_know(self):
        self.assertEqual(self.install(self.packages(), "test")[0].returncode, 2)


if __name__ == "__main__":
    unittest.main()
