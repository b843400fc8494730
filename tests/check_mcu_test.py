#!/usr/bin/env python3
"""scripts/check_mcu passes the emulated MCU, buttons included, and finds what MCUs with a fault of each kind do wrong. In virtual
time, but for one look through a real port: how busy this computer is decides nothing.

usage: tests/check_mcu_test.py FARHAND_MCU MCU_IN_VIRTUAL_TIME
"""
import importlib.machinery
import importlib.util
import math
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import time
import unittest

SCRIPT = pathlib.Path(__file__).resolve().parent.parent / "scripts" / "check_mcu"
loader = importlib.machinery.SourceFileLoader("check_mcu", str(SCRIPT))
kit = importlib.util.module_from_spec(importlib.util.spec_from_loader("check_mcu", loader))
loader.exec_module(kit)

MCU_IN_VIRTUAL_TIME = sys.argv.pop(2)
EMULATED_MCU = sys.argv.pop(1)


class VirtualPort:
    """A port whose clock goes on only while something is waited for. stalls: times at which this computer is away for a while."""

    def __init__(self, device, begins=0.0, stalls=()):
        self.device, self.t, self.stalls = device, begins, list(stalls)

    def now(self):
        return self.t

    def write(self, wire):
        self.device.send(wire)

    def read(self, until):
        if until <= self.t:
            return b""
        if self.stalls and self.t >= self.stalls[0][0]:
            until = max(until, self.t + self.stalls.pop(0)[1])
            came = b""
            while self.t < until:
                reached, more = self.device.until(until)
                self.t, came = max(self.t, reached), came + more
            return came
        self.t, came = self.device.until(until)
        return came

    def close(self):
        self.device.close()


class FakeMcu:
    """An MCU without an orthosis, and with one fault. A frame a millisecond, each way without delay."""

    def __init__(self, fault, begins=0.0):
        self.fault, self.t, self.due = fault, begins, begins
        self.state, self.faults, self.errors, self.echo, self.angle, self.number = kit.SAFE, 0, 0, 0, 0.0, 0
        self.safe_seen, self.consistent, self.previous, self.heard_at, self.leaves_at = False, 0, None, 0.0, None
        self.rest, self.seq = b"", 0

    def send(self, wire):
        self.rest += wire
        *whole, self.rest = self.rest.split(b"\0")
        for one in whole:
            self.take(one)

    def until(self, until):
        """The time reached, and what came."""
        if self.fault == "says nothing" or self.due > until:
            self.t = until
            return until, b""
        self.t = self.due
        self.due += 0.001
        self.watch()
        self.seq = (self.seq + (2 if self.fault == "loses frames" and self.seq == 7 else 1)) % 64
        slow = {6: self.faults, 8: self.errors & 255, 10: 9, 11: self.echo, 12: 1, 14: self.number >> 4,
                15: self.number & 255}.get(self.seq & 15, 0)
        return self.t, kit.telemetry(self.state, self.seq, round(self.angle * 10000), 0, slow)

    def watch(self):
        silent = self.t - self.heard_at > 0.060
        if silent and self.state != kit.SAFE and self.fault != "has no watchdog":
            self.state, self.faults = kit.SAFE, kit.WATCHDOG
        if self.leaves_at is not None and self.t > self.leaves_at:
            self.state, self.leaves_at = kit.SAFE, None
        if silent:
            self.safe_seen, self.consistent = False, 0

    def take(self, wire):
        if not wire:
            return
        payload = kit.from_wire(wire)
        if payload is None and self.fault == "believes any CRC" and len(wire) == 9:
            payload = wire[1:7]
        if payload is None:
            self.errors += self.fault != "counts no errors"
            return
        bits = int.from_bytes(payload, "big")
        mode, seq, x = bits >> 46, bits >> 42 & 15, bits >> 28 & 0x3FFF
        if mode == kit.CONFIG and self.fault != "lives on CONFIG":
            return
        if mode == kit.SAFE and self.fault != "numbers by four bits":
            self.number = (x & 255) << 4 | seq
        elif self.fault != "does not count on":
            self.number = (self.number + ((seq - self.number) & 15)) % 4096
        repeated = self.state != kit.SAFE and mode << 4 | seq == self.echo and self.fault != "lives on repetition"
        self.heard_at, self.echo = self.heard_at if repeated else self.t, mode << 4 | seq
        if mode == kit.SAFE and self.state != kit.SAFE and self.fault == "stops gently":
            self.leaves_at = self.leaves_at or self.t + 0.050
        elif mode == kit.SAFE:
            self.state, self.safe_seen, self.consistent = kit.SAFE, True, 0
        elif mode == self.state:
            self.consistent = 0
            speed = {"has no bound": 8, "keeps no range": 3}.get(self.fault, 0)  # rad/s, where the frame's v points
            self.angle = max(-0.5, min(0.5, self.angle + (-0.001 if bits >> 27 & 1 else 0.001) * speed))
        elif self.state != kit.SAFE and self.fault == "keeps its mode":
            return
        elif self.state != kit.SAFE and self.fault == "changes its mode":
            self.state = mode
        elif self.state != kit.SAFE or self.safe_seen or self.fault == "needs no SAFE":
            follows = self.previous == (mode, (seq - 1) % 16, x) or self.fault == "counts what does not follow"
            self.consistent = self.consistent + 1 if self.consistent and follows else 1
            self.previous = (mode, seq, x)
            if self.consistent == 3:
                self.state, self.faults = mode, 0

    def close(self):
        pass


class EmulatedMcu:
    """The emulated orthosis, whose time is told to it."""

    def __init__(self):
        self.process = subprocess.Popen([MCU_IN_VIRTUAL_TIME, "demo"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.unsent = b""

    def send(self, wire):
        self.unsent += wire

    def say(self, line):
        self.process.stdin.write(line + "\n")
        self.process.stdin.flush()

    def until(self, until):
        self.say(f"until {math.ceil(until * 1e9)} {self.unsent.hex()}")
        self.unsent = b""
        reached, *came = self.process.stdout.readline().split()
        at_end = int(reached) >= math.ceil(until * 1e9)
        return until if at_end else int(reached) / 1e9, bytes.fromhex("".join(came))

    def close(self):
        self.process.stdin.close()
        self.process.wait()
        self.process.stdout.close()


def verdict_of(check, fault, **port):
    """What the check says of a fake with this fault; None if it passes."""
    mcu = kit.Mcu(VirtualPort(FakeMcu(fault, port.get("begins", 0.0)), **port))

    def settled(mcu):
        if fault != "says nothing":
            mcu.run(0.5, None, lambda: mcu.frames > 20)
        check(mcu)

    try:
        kit.judged(settled, mcu)
        return None
    except kit.Failed as failed:
        return str(failed)


class CheckMcu(unittest.TestCase):
    def test_vectors_are_what_they_say(self):
        self.assertEqual(kit.check_vectors(), [])
        self.assertGreater(len(list(kit.read_vectors())), 40)

    def test_finds_every_fault(self):
        for fault, check in {"says nothing": kit.sends_telemetry,
                             "loses frames": kit.sends_telemetry,
                             "needs no SAFE": kit.does_not_start_without_safe,
                             "counts what does not follow": kit.starts_at_the_third_frame,
                             "numbers by four bits": kit.counts_commands,
                             "does not count on": kit.counts_commands,
                             "believes any CRC": kit.rejects_flipped_bits,
                             "counts no errors": kit.rejects_wrong_lengths,
                             "changes its mode": kit.changes_its_mode_at_the_third_frame,
                             "keeps its mode": kit.changes_its_mode_at_the_third_frame,
                             "has no watchdog": kit.lets_go_when_the_line_is_silent,
                             "stops gently": kit.stops_at_once,
                             "has no bound": kit.keeps_its_bound,
                             "keeps no range": kit.keeps_its_bound,
                             "lives on CONFIG": kit.config_is_no_sign_of_life,
                             "lives on repetition": kit.repetition_is_no_sign_of_life}.items():
            with self.subTest(fault=fault):
                self.assertIsNotNone(verdict_of(check, fault), f"{check.__name__} passes an MCU that {fault}")

    def test_passes_a_fake_without_a_fault(self):
        for check in (kit.does_not_start_without_safe, kit.changes_its_mode_at_the_third_frame, kit.counts_commands,
                      kit.rejects_wrong_lengths, kit.stops_at_once, kit.repetition_is_no_sign_of_life):
            self.assertIsNone(verdict_of(check, None))

    def test_a_computer_that_stalls_is_no_fault_of_an_mcu(self):
        """Away for 15 to 200 ms now and again: each check is done again until it was not."""
        for check in (kit.sends_telemetry, kit.stops_at_once, kit.lets_go_when_the_line_is_silent, kit.counts_commands):
            for away in (0.015, 0.060, 0.200):
                stalls = [(0.3 + 1.7 * n, away) for n in range(5)]
                self.assertIsNone(verdict_of(check, None, stalls=stalls), f"{check.__name__}, away for {away} s")
        always = [(0.005 * n, 0.030) for n in range(10000)]
        self.assertIn("stalls too often to tell", verdict_of(kit.stops_at_once, None, stalls=always))

    def test_a_stall_hides_no_fault(self):
        stalls = [(0.3 + 1.7 * n, 0.060) for n in range(5)]
        for fault, check in {"has no watchdog": kit.lets_go_when_the_line_is_silent, "stops gently": kit.stops_at_once,
                             "does not count on": kit.counts_commands}.items():
            self.assertIsNotNone(verdict_of(check, fault, stalls=stalls), fault)

    def test_sends_as_many_frames_as_asked_however_long_the_clock_has_run(self):
        class Counted:
            sent = b""

            def send(self, wire):
                self.sent += wire

            def until(self, until):
                return until, b""

        for power in range(22):
            for count in (1, 2, 5):
                device = Counted()
                mcu = kit.Mcu(VirtualPort(device, begins=1.37 * 2.0 ** power))
                device.sent = b""
                mcu.run(count * 0.001, lambda: kit.command(kit.SAFE, 1))
                self.assertEqual(device.sent, count * kit.command(kit.SAFE, 1), f"at {1.37 * 2.0 ** power} s")

    def test_passes_the_emulated_mcu_and_its_buttons(self):
        device = EmulatedMcu()

        def ask(sentence):
            pressed = {"press": ("stop 1", "release 0"), "hold": ("stop 0", "release 1")}[sentence.split()[0]]
            for line in pressed:
                device.say(line)

        mcu = kit.Mcu(VirtualPort(device), ask)
        try:
            for check in kit.CHECKS + [kit.keeps_its_bound, kit.patients_stop]:
                self.assertTrue(kit.passes(check, mcu), check.__name__)
            took_ms = []
            for _ in range(5):
                device.say("release 0")
                mcu.start()
                device.say("stop 1")
                took_ms.append(1e3 * mcu.run(1.0, lambda: mcu.here(kit.TRACK), lambda: mcu.state() == kit.FAULT))
                self.assertEqual(mcu.state(), kit.FAULT)
                device.say("stop 0")
                device.say("release 1")
                mcu.run(0.4)
            print("from the press to the telemetry that tells of it:", ", ".join(f"{ms:.1f} ms" for ms in took_ms))
            self.assertLess(max(took_ms), 5.0)
        finally:
            mcu.port.close()

    def test_speaks_through_a_real_port(self):
        """Not how fast: what comes through it, and that it can be told to stop."""
        with tempfile.TemporaryDirectory() as directory:
            path = os.path.join(directory, "serial")
            emulated = subprocess.Popen([EMULATED_MCU, "--scene", "demo", "--link", path], stdout=subprocess.PIPE, text=True)
            try:
                self.assertEqual(emulated.stdout.readline(), f"serial {path}\n")
                mcu = kit.Mcu(kit.SerialPort(path))
                while mcu.frames < 100 or len(mcu.pages) < 16:
                    mcu.hear(mcu.port.now() + 0.1)
                self.assertEqual((mcu.state(), mcu.page("faults") & ~kit.WATCHDOG, mcu.broken), (kit.SAFE, 0, 0))
                self.assertGreater(mcu.page("firmware"), 0)
                emulated.send_signal(signal.SIGUSR1)  # the patient's stop
                while mcu.state() != kit.FAULT:
                    mcu.hear(mcu.port.now() + 0.1)
                mcu.port.close()
            finally:
                emulated.send_signal(signal.SIGTERM)
                emulated.wait()
                emulated.stdout.close()
            gone = subprocess.run([SCRIPT, path], capture_output=True, text=True)
            self.assertEqual((gone.returncode, gone.stdout.splitlines()[1:]), (1, []))
            self.assertIn(f"cannot open {path}: No such file or directory", gone.stderr)


if __name__ == "__main__":
    unittest.main()
