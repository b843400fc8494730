#!/usr/bin/env python3
"""scripts/check_mcu passes the emulated MCU, buttons included, and finds what MCUs with a fault of each kind do wrong.

usage: tests/check_mcu_test.py FARHAND_MCU
"""
import importlib.machinery
import importlib.util
import os
import pathlib
import select
import signal
import subprocess
import sys
import tempfile
import threading
import time
import tty
import types
import unittest

SCRIPT = pathlib.Path(__file__).resolve().parent.parent / "scripts" / "check_mcu"
loader = importlib.machinery.SourceFileLoader("check_mcu", str(SCRIPT))
kit = importlib.util.module_from_spec(importlib.util.spec_from_loader("check_mcu", loader))
loader.exec_module(kit)

EMULATED_MCU = sys.argv.pop(1)


class FakeMcu(threading.Thread):
    """An MCU without an orthosis behind a pseudo terminal, and with one fault."""

    def __init__(self, fault):
        super().__init__(daemon=True)
        self.fault, self.over = fault, False
        self.fd, self.host_side = os.openpty()
        tty.setraw(self.fd)
        self.path = os.ttyname(self.host_side)
        self.state, self.faults, self.errors, self.echo, self.angle, self.number = kit.SAFE, 0, 0, 0, 0.0, 0
        self.safe_seen, self.consistent, self.previous, self.heard_at, self.leaves_at = False, 0, None, 0.0, None
        self.start()

    def run(self):
        rest, seq, due = b"", 0, time.monotonic()
        while not self.over:
            wait = max(due - time.monotonic(), 0)
            if select.select([self.fd], [], [], wait)[0]:
                rest += os.read(self.fd, 4096)
                *whole, rest = rest.split(b"\0")
                for wire in whole:
                    self.take(wire)
            if time.monotonic() < due or self.fault == "says nothing":
                continue
            due += 0.001
            self.watch()
            seq = (seq + (2 if self.fault == "loses frames" and seq == 7 else 1)) % 64
            slow = {6: self.faults, 8: self.errors & 255, 10: 9, 11: self.echo, 12: 1, 14: self.number >> 4,
                    15: self.number & 255}.get(seq & 15, 0)
            os.write(self.fd, kit.telemetry(self.state, seq, round(self.angle * 10000), 0, slow))

    def watch(self):
        silent = time.monotonic() - self.heard_at > 0.060
        if silent and self.state != kit.SAFE and self.fault != "has no watchdog":
            self.state, self.faults = kit.SAFE, kit.WATCHDOG
        if self.leaves_at is not None and time.monotonic() > self.leaves_at:
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
        self.heard_at, self.echo = self.heard_at if repeated else time.monotonic(), mode << 4 | seq
        if mode == kit.SAFE and self.state != kit.SAFE and self.fault == "stops gently":
            self.leaves_at = self.leaves_at or time.monotonic() + 0.050
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
        self.over = True
        self.join()
        os.close(self.fd)
        os.close(self.host_side)


def verdict_of(check, fault):
    """What the check says of a fake with this fault; None if it passes."""
    fake = FakeMcu(fault)
    try:
        mcu = kit.Mcu(fake.path)

        def settled(port):
            if fault != "says nothing":
                port.run(0.5, None, lambda: port.frames > 20)
            check(port)

        try:
            kit.judged(settled, mcu)
            return None
        except kit.Failed as failed:
            return str(failed)
    finally:
        os.close(mcu.fd)
        fake.close()


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

    def heard(self, fd):
        data = b""
        while select.select([fd], [], [], 0.01)[0]:
            data += os.read(fd, 4096)
        return data

    def test_sends_as_many_frames_as_asked_however_long_the_clock_has_run(self):
        ours, theirs = os.openpty()
        tty.setraw(ours)
        port = kit.Mcu(os.ttyname(theirs))
        real = kit.time
        try:
            for power in range(22):
                for count in (1, 2, 5):
                    began, at = real.monotonic(), 1.37 * 2.0 ** power
                    kit.time = types.SimpleNamespace(monotonic=lambda: at + real.monotonic() - began)
                    while True:
                        self.heard(ours)  # what a try before has sent
                        try:
                            port.run(count * 0.001, lambda: kit.command(kit.SAFE, 1))
                            break
                        except kit.Stalled:
                            began = real.monotonic()
                    self.assertEqual(self.heard(ours), count * kit.command(kit.SAFE, 1), f"at {at} s")
        finally:
            kit.time = real
            os.close(port.fd)
            os.close(theirs)
            os.close(ours)

    def press(self, port, emulated):
        """In real time, from the press to the telemetry that tells of it."""
        took_ms = []
        while len(took_ms) < 5:
            try:
                port.start()
                emulated.send_signal(signal.SIGUSR1)
                took = port.run(1.0, lambda: port.here(kit.TRACK), lambda: port.state() == kit.FAULT)
                self.assertEqual(port.state(), kit.FAULT)
                took_ms.append(took * 1e3)
            except kit.Stalled:
                port.hear(time.monotonic() + 0.1)
            emulated.send_signal(signal.SIGUSR2)
            port.hear(time.monotonic() + 0.4)
        os.close(port.fd)
        print("from the press to the telemetry that tells of it, real time:", ", ".join(f"{ms:.1f} ms" for ms in took_ms))

    def test_passes_the_emulated_mcu_and_its_buttons(self):
        with tempfile.TemporaryDirectory() as directory:
            port = os.path.join(directory, "serial")
            mcu = subprocess.Popen([EMULATED_MCU, "--scene", "demo", "--link", port], stdout=subprocess.PIPE, text=True)
            try:
                self.assertEqual(mcu.stdout.readline(), f"serial {port}\n")
                check = subprocess.Popen([SCRIPT, port, "--move", "--stop"], stdout=subprocess.PIPE, text=True)
                lines = []
                for line in check.stdout:
                    lines.append(line)
                    if "press the patient's stop" in line:
                        mcu.send_signal(signal.SIGUSR1)
                    if "hold the release key" in line:
                        mcu.send_signal(signal.SIGUSR2)
                check.stdout.close()
                print("".join(lines), end="")
                self.assertEqual(check.wait(), 0, "".join(lines))
                self.press(kit.Mcu(port), mcu)
            finally:
                mcu.send_signal(signal.SIGTERM)
                mcu.wait()
                mcu.stdout.close()


if __name__ == "__main__":
    unittest.main()
