#!/usr/bin/env python3
"""The recipe of common/README.md for a new architecture, followed in a copy of the tree: few files, and everything shows it.

usage: tests/recipe_test.py        needs what scripts/install installs; takes some minutes
"""
import csv
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parent.parent
MOST_FILES = 9
CLOSED_ROOMS = ("common/station/", "common/runtime/", "common/record/", "common/judge/", "common/show/", "netem/lab/")

LAW = """// A spring and a damper between the sides, an account of what goes through them, and the master's alone shows its torque.
#pragma once

#include "common/law/row.hpp"

namespace farhand {

inline constexpr LawBlock kToySpringBlock{
    .name = "toy spring",
    .why = "holds the sides together",
    .without = "no toy holds the sides together",
    .bytes = sizeof(ToyParams),
    .settings = {"control.toy_K_nm_per_rad", "control.toy_B_nms_per_rad"},
    .run = [](const LawParams& p, const FourChannelGains& /*K*/, double /*dt_s*/, std::span<const LawInputs<1>> seen) {
      return sum_over(seen, [&](const LawInputs<1>& in) { return p.toy.K * (in.received.x[0] - in.local.x[0]); });
    }};

template <int N, bool kShows>
class Toy : public Law<N> {
 public:
  static constexpr std::array kBlocks{kToySpringBlock};

  Toy(const LawParams& p, const FourChannelGains& /*K*/, double /*dt_s*/) : Law<N>({.account = true}), p_(p.toy) {}

  void start(const LawInputs<N>& /*in*/) noexcept override {}

  Wish<N> step(const LawInputs<N>& in) noexcept override {
    energy_ += (in.account.torque * in.account.moved).sum();
    Wish<N> wish{.tell = Told<N>::motion(in.local), .energy = energy_};
    if (!in.engaged) return wish;
    torque_ = p_.K * (in.received.x - in.local.x) - p_.B * in.local.v;
    wish = Wish<N>::torque(torque_, in.local);
    wish.energy = energy_;
    return wish;
  }

  LawSignals signals() const noexcept override {
    LawSignals all;
    if constexpr (kShows) all.own[0] = torque_[0];
    return all;
  }

 private:
  ToyParams p_;
  Joints<N> torque_ = Joints<N>::Zero();
  double energy_ = 0.0;
};

template <int N>
class ToyMaster final : public Toy<N, true> {
 public:
  static constexpr std::array kSignals{LawSignal{"toy_torque_nm", "N m", "torque of the toy's spring"}};
  using Toy<N, true>::Toy;
};

template <int N>
class ToySlave final : public Toy<N, false> {
 public:
  using Toy<N, false>::Toy;
};

}  // namespace farhand
"""


def run(*command, code=0, cwd=None):
    done = subprocess.run([str(c) for c in command], cwd=cwd, capture_output=True, text=True)
    if done.returncode != code:
        raise AssertionError(f"{command} ended with {done.returncode}:\n{done.stdout}\n{done.stderr}")
    return done.stdout + done.stderr


def changed(text, old, new):
    if text.count(old) != 1:
        raise AssertionError(f"{text.count(old)} places like {old!r}")
    return text.replace(old, new)


class Recipe(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.place = tempfile.TemporaryDirectory()
        cls.tree = pathlib.Path(cls.place.name) / "tree"
        files = run("git", "ls-files", cwd=ROOT).split("\n")
        for name in filter(None, files):
            to = cls.tree / name
            to.parent.mkdir(parents=True, exist_ok=True)
            to.write_bytes((ROOT / name).read_bytes())
            to.chmod((ROOT / name).stat().st_mode)
        run("git", "init", "-q", cwd=cls.tree)
        run("git", "add", "-A", cwd=cls.tree)
        run("git", "-c", "user.name=n", "-c", "user.email=e", "commit", "-qm", "as it was", cwd=cls.tree)
        cls.follow()
        run("cmake", "-S", cls.tree, "-B", cls.tree / "build/recipe", "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release",
            "-DFARHAND_TESTS=OFF", *(["-DCMAKE_CXX_COMPILER_LAUNCHER=ccache"] if pathlib.Path("/usr/bin/ccache").exists() else []))
        run("cmake", "--build", cls.tree / "build/recipe", "--target", "farhand-lab", "-j", str(os.cpu_count()))
        cls.lab = cls.tree / "build/recipe/bin/farhand-lab"

    @classmethod
    def tearDownClass(cls):
        cls.place.cleanup()

    @classmethod
    def edit(cls, name, *changes):
        text = (cls.tree / name).read_text()
        for old, new in changes:
            text = changed(text, old, new)
        (cls.tree / name).write_text(text)

    @classmethod
    def follow(cls):
        (cls.tree / "common/law/toy.hpp").write_text(LAW)
        cls.edit("common/law/architectures.cpp",
                 ('#include "common/law/two_channel.hpp"\n', '#include "common/law/toy.hpp"\n#include "common/law/two_channel.hpp"\n'),
                 ('    Architecture{"WAVE",', '    Architecture{"TOY", "nobody, never", maker<ToyMaster>(), maker<ToySlave>()},\n'
                                             '    Architecture{"WAVE",'))
        cls.edit("common/law/params.hpp", ("struct LawParams {", "struct ToyParams {\n  double K = 5.0, B = 0.1;\n};\n\nstruct LawParams {"),
                 ("  TankParams tank;\n", "  TankParams tank;\n  ToyParams toy;\n"))
        cls.edit("proto/scene.proto",
                 ("  TWO_CHANNEL_PO_PC = 8;", "  TOY = 10;\n  TWO_CHANNEL_PO_PC = 8;"),
                 ("  optional bool sdcv_from_patient = 26",
                  '  optional double toy_K_nm_per_rad = 27 [(info) = {unit: "N m/rad" min: 0 max: 100 default_text: "5" meaning: '
                  '"toy: its spring"}];\n'
                  '  optional double toy_B_nms_per_rad = 28 [(info) = {unit: "N m s/rad" min: 0 max: 10 default_text: "0.1" meaning: '
                  '"toy: its damper"}];\n'
                  "  optional bool sdcv_from_patient = 26"))
        cls.edit("common/config/station_params.cpp",
                 ("  p.control.law.tank = {", "  p.control.law.toy = {.K = c.toy_k_nm_per_rad(), .B = c.toy_b_nms_per_rad()};\n"
                                              "  p.control.law.tank = {"))
        scene = (cls.tree / "proto/scenes/two_channel.txtpb").read_text()
        scene = re.sub(r'description: ".*"', 'description: "toy"', changed(scene, "architecture: TWO_CHANNEL", "architecture: TOY"))
        (cls.tree / "proto/scenes/toy.txtpb").write_text(changed(scene, "architecture: TOY\n", "architecture: TOY\ncontrol { toy_K_nm_per_rad: 6 }\n"))
        cls.edit("proto/scenes/README.md", ("| `wave` |", "| `toy` | toy | - | - | ok |\n| `wave` |"))

    def test_few_files_change_and_none_in_a_room_that_knows_no_architecture(self):
        run("git", "add", "-A", cwd=self.tree)
        names = run("git", "diff", "--cached", "--name-only", cwd=self.tree).split()
        print(run("git", "diff", "--cached", "--stat", cwd=self.tree))
        self.assertLessEqual(len(names), MOST_FILES)
        self.assertEqual([name for name in names if name.startswith(CLOSED_ROOMS)], [])
        run(self.tree / "scripts/check_rooms", self.tree)

    def test_everything_shows_it(self):
        out = pathlib.Path(self.place.name) / "out"
        out.mkdir()
        explained = run(self.lab, "explain", "toy")
        self.assertRegex(explained, r"(?m)^  master +toy spring .*holds the sides together; toy_K_nm_per_rad = 6; toy_B_nms_per_rad = 0.1")
        self.assertRegex(explained, r"law of the master .*TOY, nobody, never; its blocks 16 bytes")
        self.assertRegex(run(self.lab, "explain", "wave"), r"toy spring +architecture = WAVE: no toy holds the sides together")
        schema = run(self.lab, "schema")
        self.assertIn("control.toy_K_nm_per_rad", schema)
        self.assertRegex(schema, r"(?m)^  TOY, master\n  toy_torque_nm +N m +torque of the toy's spring")
        self.assertIn("has no effect: it needs architecture TOY", run(self.lab, "check", "toy") + run(
            self.lab, "run", "wave", "--set", "control.toy_B_nms_per_rad=0.2", "--set", "duration_s=1", "--set", "windows={}", code=3))

        run(self.lab, "run", "toy", "--csv", out / "toy.csv", "--json", out / "toy.json", "--record", out / "toy.mcap",
            "--report", out / "toy.html")
        with open(out / "toy.csv", newline="") as file:
            rows = list(csv.DictReader(file))
        self.assertTrue(any(row["side"] == "master" and row["toy_torque_nm"] and float(row["toy_torque_nm"]) != 0 for row in rows))
        self.assertTrue(all(row["toy_torque_nm"] == "" for row in rows if row["side"] == "slave"))
        self.assertGreater(json.loads((out / "toy.json").read_text())["engaged_s"], 1)
        html = (out / "toy.html").read_text()
        self.assertIn("toy_torque_nm: torque of the toy", html)
        run(self.lab, "recording", "export", out / "toy.mcap", "--csv", out / "exported")
        self.assertIn(",toy_torque_nm\n", (out / "exported/master.csv").read_text().split("\n")[0] + "\n")
        self.assertNotIn("toy_torque_nm", (out / "exported/slave.csv").read_text().split("\n")[0])
        swept = run(self.lab, "sweep", "toy", "--set", "control.toy_K_nm_per_rad=2:6:2", "--csv", "-")
        lines = [line for line in swept.split("\n") if line.startswith(("2,", "6,"))]
        self.assertEqual(len(lines), 2, swept)
        self.assertNotEqual(lines[0].split(",")[2:], lines[1].split(",")[2:])


if __name__ == "__main__":
    unittest.main()
