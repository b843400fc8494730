"""The documents say what the programs do: marked commands run, quoted figures, options, scenes, rooms and names are the real ones.

usage: docs_test.py BIN    BIN holds the built programs
"""
import functools
import importlib.machinery
import importlib.util
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parent.parent
BIN = pathlib.Path()
README = (ROOT / "README.md").read_text(encoding="utf-8")
SCENES = (ROOT / "proto/scenes/README.md").read_text(encoding="utf-8")
MAP = (ROOT / "common/README.md").read_text(encoding="utf-8")
STATES = (ROOT / "common/STATES.md").read_text(encoding="utf-8")
SAFETY = (ROOT / "common/SAFETY.md").read_text(encoding="utf-8")
BOX = (ROOT / "slave/README.md").read_text(encoding="utf-8")
SECURITY = (ROOT / "SECURITY.md").read_text(encoding="utf-8")
ALL = README + MAP + STATES + SAFETY + BOX + SECURITY


def run(arguments, **options):
    return subprocess.run(arguments, capture_output=True, text=True, check=False, **options)


@functools.cache
def metrics(scene):
    return json.loads(run([BIN / "farhand-lab", "run", scene, "--json", "-"]).stdout)


def rows(text, header):
    """Cells of the table whose first column is called `header`."""
    body = re.search(rf"^\| {header} \|.*\n\|[-|]+\n((?:\|.*\n)+)", text, re.MULTILINE).group(1)
    return [[cell.strip() for cell in re.split(r"(?<!\\)\|", line)[1:-1]] for line in body.splitlines()]


def agrees(quoted, value, scale=1.0):
    """As far as the quoted digits go: one unit of the last."""
    if value is None:
        return quoted == "-"
    if isinstance(value, str):
        return quoted == value
    unit = 10.0 ** -len(quoted.partition(".")[2])
    return quoted != "-" and abs(float(quoted) - scale * value) <= unit


CITED = r"\b([A-Z]\w*[a-z]\w*\.[A-Z]\w*[a-z]\w*)\b(\.\.\.)?"
NO_TEST = {"Boost.Asio"}  # written alike


def declared_tests():
    """Names of all tests, of every kind of GoogleTest and of CTest, as Suite.Name."""
    sources = "".join(file.read_text(encoding="utf-8") for file in (ROOT / "tests").rglob("*.cpp"))
    declared = re.findall(r"\bTEST(?:_P|_F)?\(\s*(\w+),\s*(\w+)\s*\)|\bTYPED_TEST(?:_P)?\(\s*(\w+),\s*(\w+)\s*\)", sources)
    own = re.findall(r"add_test\(NAME (\w+\.\w+)", (ROOT / "tests/CMakeLists.txt").read_text(encoding="utf-8"))
    return {".".join(filter(None, names)) for names in declared} | set(own)


def citations():
    """Tests that are cited in a comment of a source, in a string of the fault matrix or in a document: (place, name, whether it is cut)."""
    found = []
    for folder in ("common", "master", "slave", "netem", "tests", "proto", "scripts", ""):
        files = (ROOT / folder).rglob("*") if folder else ROOT.glob("*.md")
        for file in sorted(path for path in files if path.suffix in {".hpp", ".cpp", ".md", ".proto", ".txtpb", ".py"}):
            for number, line in enumerate(file.read_text(encoding="utf-8").splitlines(), start=1):
                comment = {".md": line, ".proto": line, ".py": line.partition("# ")[2], ".txtpb": line.partition("#")[2]}
                text = line if file.name == "fault_rows.cpp" else comment.get(file.suffix, line.partition("//")[2])
                for name, cut in re.findall(CITED, text):
                    if name not in NO_TEST:
                        found.append((f"{file.relative_to(ROOT)}:{number}", name, bool(cut)))
    return found


class Readme(unittest.TestCase):
    def test_marked_commands_run_as_written(self):
        blocks = re.findall(r"<!-- run ?(\d*) -->\n```sh\n(.*?)```", README, re.DOTALL)
        self.assertGreaterEqual(len(blocks), 4)
        self.assertEqual(len(blocks), README.count("<!-- run"))
        for code, commands in blocks:
            with self.subTest(commands), tempfile.TemporaryDirectory() as directory:
                (pathlib.Path(directory) / "proto").symlink_to(ROOT / "proto")
                commands = commands.replace("build/release/bin", str(BIN))
                done = run(["bash", "-euc", commands], cwd=directory)
                self.assertEqual(done.returncode, int(code or 0), done.stdout[-2000:] + done.stderr)

    def test_scenes_in_the_table_are_those_that_are_shipped_and_do_what_it_says(self):
        table = {row[0].strip("`"): row[1:] for row in rows(SCENES, "scene")}
        self.assertEqual(sorted(table), sorted(file.stem for file in (ROOT / "proto/scenes").glob("*.txtpb")))
        for name, (description, tracking, ratio, verdict) in table.items():
            with self.subTest(name):
                text = (ROOT / f"proto/scenes/{name}.txtpb").read_text(encoding="utf-8")
                self.assertEqual(description, re.search(r'^description: "(.*)"', text, re.MULTILINE).group(1))
                measured = metrics(name)
                self.assertTrue(agrees(tracking, measured["tracking_rms_rad"], 1e3), f"{tracking}: {measured}")
                self.assertTrue(agrees(ratio, measured["force_ratio"]), f"{ratio}: {measured}")
                self.assertEqual(verdict, measured["verdict"])

    def test_figures_of_the_demo_are_those_of_a_run(self):
        measured = metrics("demo")
        for key, virtual_time, *_ in rows(README, "metric"):
            self.assertTrue(agrees(virtual_time, measured[key.strip("`")]), f"{key} {virtual_time}: {measured}")

    def test_programs_take_the_options_that_are_listed_and_no_others(self):
        listing = re.search(r"```text\n(farhand-master .*?)```", README, re.DOTALL).group(1)
        listing = re.sub(r"\n +", " ", listing).splitlines()
        self.assertEqual({line.split()[0] for line in listing}, {f"farhand-{p}" for p in ("master", "netem", "slave", "mcu", "lab")})
        for line in listing:
            with self.subTest(line):
                command = re.match(r"farhand-\w+(?: [a-z]+)*", line).group(0).split()
                printed = run([BIN / command[0], *command[1:], "--help"])
                self.assertEqual(printed.returncode, 0)
                self.assertEqual(set(re.findall(r"--[a-z]+", line)), set(re.findall(r"--[a-z]+", printed.stdout)) - {"--help"})

    def test_subcommands_of_the_lab_are_all_listed(self):
        printed = run([BIN / "farhand-lab", "--help"]).stdout.partition("Subcommands:")[2]
        for name in re.findall(r"^  (\w+)", printed, re.MULTILINE):
            self.assertIn(f"\nfarhand-lab {name} ", README)


class Map(unittest.TestCase):
    def test_rooms_and_their_arrows_are_those_of_check_rooms(self):
        loader = importlib.machinery.SourceFileLoader("check_rooms", str(ROOT / "scripts/check_rooms"))
        check_rooms = importlib.util.module_from_spec(importlib.util.spec_from_loader("check_rooms", loader))
        loader.exec_module(check_rooms)
        listed = {row[0].strip("`"): re.findall(r"`([^`]+)`", row[1]) for row in rows(MAP, "room")}
        self.assertEqual(listed, check_rooms.ARROWS)
        self.assertEqual(set(listed), {path.name for path in (ROOT / "common").iterdir() if path.is_dir()})

    def test_states_are_those_of_the_wire(self):
        states = re.search(r"enum class StationState[^{]*\{([^}]*)\}", (ROOT / "common/link/packet.hpp").read_text()).group(1)
        self.assertEqual([(row[0].replace("-t", "T"), row[1]) for row in rows(STATES, "state")], re.findall(r"k(\w+) = (\d+)", states))

    def test_scene_fields_of_the_symbol_table_exist(self):
        schema = run([BIN / "farhand-lab", "schema"]).stdout
        fields = [field for row in rows(MAP, "symbol") for field in re.findall(r"`((?:control|axis)\.\w+)`", row[1])]
        self.assertGreater(len(fields), 10)
        for field in fields:
            self.assertRegex(schema, rf"(?m)^(master\.)?{re.escape(field)} ")


class Safety(unittest.TestCase):
    def test_every_hazard_has_its_test(self):
        hazards = rows(SAFETY, "hazard")
        self.assertGreaterEqual(len(hazards), 20)
        for hazard in hazards:
            self.assertEqual(len(hazard), 6, hazard)
            self.assertRegex(hazard[5], r"^`\w+\.\w+`$", hazard[0])


class All(unittest.TestCase):
    def test_files_that_are_named_exist(self):
        for name in re.findall(r"`((?:common|master|slave|netem|proto|tests|scripts)/[\w./*-]+)`", ALL):
            if "NAME" not in name:
                self.assertTrue(list(ROOT.glob(name.rstrip("/"))), name)

    def test_tests_that_are_named_exist(self):
        cited = citations()
        self.assertGreaterEqual(len(cited), 100)
        declared = declared_tests()
        for place, name, cut in cited:
            with self.subTest(place):
                # A table may cut a long name: NAME...
                self.assertTrue(any(test.startswith(name) for test in declared) if cut else name in declared, f"{place}: no test {name}")

    def test_a_citation_is_found_wherever_it_stands(self):
        name = re.compile(CITED)
        for text in ("// (test Dob.IsUnbiased)", "| x | `Dob.IsUnbiased` |", '{"a", "Dob.IsUnbiased"}'):
            self.assertEqual(name.findall(text), [("Dob.IsUnbiased", "")], text)
        self.assertEqual(name.findall("// Dob.Is..."), [("Dob.Is", "...")])
        self.assertEqual(name.findall("`README.md`, Boost.asio, scene::Scene, a.B"), [])

    def test_lines_are_short(self):
        for text in (README, MAP, STATES, SAFETY, BOX, SECURITY):
            for line in text.splitlines():
                self.assertLessEqual(len(line), 400 if line.startswith("|") else 140, line)


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    BIN = pathlib.Path(sys.argv.pop(1)).resolve()
    os.environ.pop("FARHAND_SCENES", None)
    sys.dont_write_bytecode = True  # scripts/ stays as it is
    unittest.main()
