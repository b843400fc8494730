#!/usr/bin/env python3
"""The stations in real terminals, under bash and dash: what is typed at them, job control, and every way in which they end.

usage: tests/terminal_test.py BIN [TEST]...    BIN holds the built programs. Looks at what happens, never at how fast.
"""
import concurrent.futures
import fcntl
import os
import pathlib
import pty
import re
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import termios
import threading
import time
import unittest

BIN = pathlib.Path()
PATIENCE_S = 60
ALONE_S = 0.4  # of silence before a key or a word that is meant
SCENE = "architecture: FOUR_CHANNEL\nduration_s: 600\nslave { device: DIRECT_DRIVE }\n"
SHELLS = [[shutil.which(name), *options] for name, options in (("bash", ["--norc", "--noprofile", "-i"]), ("dash", ["-i"]))
          if shutil.which(name)]
STOP_KEYS = [b"s", b"S", b"q", b"Q", b" ", b"\x1b", b"\r", b"\x04", b"\x13", b"\x1b[A"]
STOP_WORDS = [b"stop\r", b"STOP\r", b"Stop\r", b"Meier\r"]


class Terminal:
    """A pseudo terminal with a shell on it."""

    def __init__(self, shell):
        self.fd, its_end = pty.openpty()
        variables = dict(os.environ, PS1="READY> ", ENV="", TERM="xterm", HISTFILE="/dev/null")
        self.shell = subprocess.Popen(["setsid", "--ctty", *shell], stdin=its_end, stdout=its_end, stderr=its_end, env=variables)
        self.pid = self.shell.pid
        os.close(its_end)
        self.text, self.seen, self.runs, self.lock = "", 0, 0, threading.Lock()
        self.reader = threading.Thread(target=self.read, daemon=True)
        self.reader.start()
        self.wait_for("READY> ")
        for _ in range(PATIENCE_S):  # a shell that starts may throw away what comes too early
            self.type(b"echo UP''UP\n")
            time.sleep(0.2)
            for _ in range(20):
                if "UPUP" in self.text:
                    self.wait_for("UPUP")
                    return
                time.sleep(0.1)

    def read(self):
        while True:
            try:
                came = os.read(self.fd, 65536)
            except OSError:
                return
            if not came:
                return
            with self.lock:
                self.text += came.decode("utf-8", "replace")

    def type(self, keys, pace_s=0.0):
        if pace_s == 0:
            os.write(self.fd, keys)
            return
        for byte in keys:
            os.write(self.fd, bytes([byte]))
            time.sleep(pace_s)

    def alone(self, keys):
        time.sleep(ALONE_S)
        self.type(keys)

    def wait_for(self, pattern):
        """The first match after the one before."""
        end = time.monotonic() + PATIENCE_S
        while time.monotonic() < end:
            with self.lock:
                found = re.compile(pattern).search(self.text, self.seen)
                if found:
                    self.seen = found.end()
                    return found
            time.sleep(0.02)
        raise AssertionError(f"{pattern!r} did not come after ...{self.text[max(0, self.seen - 300):self.seen]!r} "
                             f"but {self.text[self.seen:][-1500:]!r}")

    def wait_for_state(self, name):
        """On a live line that begins after the call."""
        with self.lock:
            self.seen = len(self.text)
        return self.wait_for(rf"\d\.\d s  {name} ")

    def run(self, command):
        """What a short command prints, and its exit code. What a job in the background prints meanwhile is among it."""
        self.runs += 1
        self.type(f"echo BE''GIN{self.runs}; {command}; echo DO''NE{self.runs}:$?:\n".encode())
        self.wait_for(f"BEGIN{self.runs}")
        with self.lock:
            begin = self.seen
        code = int(self.wait_for(rf"DONE{self.runs}:(\d+):").group(1))
        with self.lock:
            return self.text[begin:self.seen], code

    def modes(self):
        return re.search(r"[0-9a-f]+(:[0-9a-f]+){12,}", self.run("stty -g")[0]).group(0)

    def close(self):
        self.shell.kill()
        self.shell.wait()
        os.close(self.fd)


class Station:
    """A station typed at a shell in a terminal. `pid` is the program's."""

    def __init__(self, shell, command, background=False):
        self.terminal = Terminal(shell)
        self.before = self.terminal.modes()
        self.directory = tempfile.TemporaryDirectory()
        self.record = pathlib.Path(self.directory.name) / "side.mcap"
        scene = pathlib.Path(self.directory.name) / "scene.txtpb"
        scene.write_text(SCENE)
        self.command = f"{BIN}/{command[0]} --scene {scene} --insecure --record {self.record} " + " ".join(command[1:])
        self.terminal.type((self.command + (" &\n" if background else "\n")).encode())

    def __getattr__(self, name):
        return getattr(self.terminal, name)

    def pid_of_program(self):
        children = pathlib.Path(f"/proc/{self.terminal.pid}/task/{self.terminal.pid}/children").read_text().split()
        programs = [int(pid) for pid in children if b"farhand-" in pathlib.Path(f"/proc/{pid}/cmdline").read_bytes()]
        assert len(programs) == 1, programs
        return programs[0]

    def asked_for(self, act):
        """From the recording, once the program has ended."""
        name = self.record if self.record.exists() else pathlib.Path(f"{self.record}.part")
        return name.read_bytes().count(f"operator: {act}".encode())

    def end(self):
        try:
            os.kill(self.pid_of_program(), signal.SIGKILL)
        except (AssertionError, OSError):
            pass
        self.terminal.close()
        self.directory.cleanup()


def a_box(shell, **more):
    """Nobody is there to answer it: it is Ready all the same."""
    box = Station(shell, ["farhand-slave", "--peer", "127.0.0.1:9"], **more)
    if not more:
        box.wait_for_state("ready")
    return box


class Session:
    """A therapist's station in a terminal, with the patient's box as a child that nobody talks to."""

    def __init__(self, shell):
        self.master = Station(shell, ["farhand-master", "--listen", "127.0.0.1:0"])
        address = self.master.wait_for(r"listening (\S+:\d+)").group(1)
        scene = pathlib.Path(self.master.directory.name) / "scene.txtpb"
        self.slave = subprocess.Popen([BIN / "farhand-slave", "--scene", scene, "--insecure", "--quiet", "--peer", address],
                                      stdin=subprocess.PIPE, stdout=subprocess.DEVNULL)
        self.master.wait_for_state("ready")
        time.sleep(0.5)  # so that the box is ready, too

    def end(self):
        self.slave.kill()
        self.slave.wait()
        self.slave.stdin.close()
        self.master.end()


def both_shells(body):
    """At the same time, each in its own terminal."""

    def test(self):
        with concurrent.futures.ThreadPoolExecutor() as pool:
            for done in [pool.submit(body, self, shell) for shell in SHELLS]:
                done.result()

    test.__name__, test.__doc__ = body.__name__, body.__doc__
    return test


def ended(pid):
    try:
        return pathlib.Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] == "Z"
    except FileNotFoundError:
        return True


def comes_true(condition):
    end = time.monotonic() + PATIENCE_S
    while time.monotonic() < end:
        if condition():
            return True
        time.sleep(0.05)
    return condition()


class Keys(unittest.TestCase):
    @both_shells
    def test_each_stop_key_and_word_stops_and_only_what_is_meant_resets(self, shell):
        box = a_box(shell)
        for k, key in enumerate(STOP_KEYS + STOP_WORDS):
            box.type(key)
            box.wait_for_state("stopped")
            box.alone(b"r" if k % 2 == 0 else b"reset\r")
            box.wait_for_state("ready")
        box.type(b"\x03")
        box.wait_for("ticks")
        box.end()

    @both_shells
    def test_names_sentences_and_pasted_lines_do_not_undo_the_patients_stop(self, shell):
        box = a_box(shell)
        box.type(b"s")
        box.wait_for_state("stopped")
        pasted = [b"Herr Meier", b"Frau Rossi, Erika\r", b"reset the box\r", b"cd build\rreset\rls -r\r", b"reset\rreset\r",
                  b"\x1b[200~reset\r\x1b[201~", b"for r in r; do r; done\r", b"r\x1b[Ar", b"rr\r", b"RESET\r", b"R\r"]
        for text in pasted:
            time.sleep(ALONE_S)
            box.type(text)
        typed = [(b"Herr Reiter\r", 0.06), (b"r r\r", 0.06), (b"Sr\r", 0.7), (b"rudi\r", 0.5), (b"M r\r", 0.5), (b"re", 0.4)]
        for text, pace_s in typed:
            time.sleep(ALONE_S)
            box.type(text, pace_s)
        time.sleep(1.5)
        box.wait_for_state("stopped")
        self.assertIn("is no word, so it stops", box.text)
        self.assertIn("Backspace takes it back", box.text)
        box.type(b"\x03")
        box.wait_for("ticks")
        self.assertEqual(box.asked_for("reset"), 0)
        self.assertGreater(box.asked_for("stop"), 10)
        box.end()

    @both_shells
    def test_names_and_letters_in_a_line_do_not_engage(self, shell):
        session = Session(shell)
        master = session.master
        for text, pace_s in [(b"Meier", 0), (b"Peter", 0.06), (b"Meier", 0.4), (b"emil", 0.4), (b"ee", 0.1), (b"engage!", 0),
                             (b"EE", 0.4), (b"\xc3\xa4e", 0.4), (b"engage", 0)]:
            time.sleep(ALONE_S)
            master.type(text, pace_s)
            time.sleep(1.2)
            master.type(b"\x15")  # takes the line back and stops nothing
        master.wait_for_state("ready")
        master.type(b"\x03")
        master.wait_for("ticks")
        self.assertEqual((master.asked_for("engage"), master.asked_for("stop")), (0, 0))
        session.end()

    @both_shells
    def test_sentences_and_pasted_lines_stop_and_do_not_engage(self, shell):
        session = Session(shell)
        master = session.master
        for text in [b"Herr Meier\r", b"cd x\rengage\r", b"engage\rls\r", b"e\r", b"Engage\r"]:
            master.alone(text)
            master.wait_for_state("stopped")
            master.alone(b"reset\r")
            master.wait_for_state("ready")
        master.type(b"\x03")
        master.wait_for("ticks")
        self.assertEqual(master.asked_for("engage"), 0)
        session.end()

    @both_shells
    def test_what_is_meant_engages(self, shell):
        session = Session(shell)
        master = session.master
        for meant in [b"e", b"engage\r"]:
            master.alone(meant)
            master.wait_for_state("engaged")
            master.type(b"h")
            master.wait_for_state("holding")
            time.sleep(1)
            master.alone(b"e")
            master.wait_for_state("engaged")
            master.type(b"S")
            master.wait_for_state("stopped")
            master.alone(b"r")
            master.wait_for_state("ready")
            time.sleep(1)
        master.type(b"\x03")
        master.wait_for("ticks")
        self.assertEqual(master.asked_for("engage"), 4)
        session.end()


class Jobs(unittest.TestCase):
    @both_shells
    def test_suspended_it_has_come_to_rest_and_brought_back_each_key_stops(self, shell):
        session = Session(shell)
        master = session.master
        master.alone(b"e")
        master.wait_for_state("engaged")
        for back in ["fg", "bg; fg"]:
            master.type(b"\x1a")
            master.wait_for("comes to rest before it is suspended")
            master.wait_for("READY> ")
            self.assertEqual(master.modes(), master.before)
            master.type(back.encode() + b"\n")
            master.wait_for_state("stopped")
            master.alone(b"r")
            master.wait_for_state("ready")
            for key in [b"s", b"S", b"\x1b"]:
                master.type(key)
                master.wait_for_state("stopped")
                master.alone(b"reset\r")
                master.wait_for_state("ready")
            time.sleep(0.5)
            master.alone(b"e")
            master.wait_for_state("engaged")
        # Stopped by what no program can handle, and brought back.
        os.kill(master.pid_of_program(), signal.SIGSTOP)
        master.wait_for("READY> ")
        master.type(b"fg\n")
        master.wait_for(r"\d\.\d s  (holding|engaged|ready)")
        master.type(b"q")
        master.wait_for_state("stopped")
        master.type(b"\x03")
        master.wait_for("ticks")
        self.assertEqual(master.modes(), master.before)
        session.end()

    @both_shells
    def test_in_the_background_it_goes_on_and_brought_back_each_key_stops(self, shell):
        box = a_box(shell, background=True)
        box.wait_for("runs in the background, where no key stops it")
        box.wait_for_state("ready")
        self.assertEqual(box.modes(), box.before)
        box.run("stty tostop")
        box.wait_for_state("ready")
        box.wait_for_state("ready")
        box.run("stty -tostop")
        box.type(b"fg\n")
        box.wait_for("farhand-slave --scene")
        box.wait_for_state("ready")
        for key in [b"s", b"Q", b"\r"]:
            box.type(key)
            box.wait_for_state("stopped")
            box.alone(b"r")
            box.wait_for_state("ready")
        box.type(b"\x1c")
        box.wait_for("ticks")
        self.assertEqual(box.modes(), box.before)
        box.end()

    @both_shells
    def test_as_a_part_of_a_script_it_is_suspended_with_it_and_brought_back(self, shell):
        terminal = Terminal(shell)
        before = terminal.modes()
        with tempfile.TemporaryDirectory() as directory:
            scene, script = pathlib.Path(directory) / "scene.txtpb", pathlib.Path(directory) / "script"
            scene.write_text(SCENE)
            script.write_text(f"{BIN}/farhand-slave --scene {scene} --insecure --peer 127.0.0.1:9 <&0 &\nwait\n")
            terminal.type(f"bash {script}\n".encode())
            terminal.wait_for_state("ready")
            terminal.type(b"\x1a")
            terminal.wait_for("READY> ")
            self.assertEqual(terminal.modes(), before)
            terminal.type(b"fg\n")
            terminal.wait_for_state("stopped")
            terminal.alone(b"r")
            terminal.wait_for_state("ready")
            terminal.type(b"S")
            terminal.wait_for_state("stopped")
            terminal.type(b"\x03")
            terminal.wait_for("ticks")
            self.assertEqual(terminal.modes(), before)
        terminal.close()

    @both_shells
    def test_another_size_and_another_mode_of_the_terminal_leave_the_keys(self, shell):
        box = a_box(shell)
        for columns in (40, 200):
            fcntl.ioctl(box.fd, termios.TIOCSWINSZ, struct.pack("HHHH", 50, columns, 0, 0))
            os.kill(box.pid_of_program(), signal.SIGWINCH)
            box.wait_for_state("ready")
            box.type(b"s")
            box.wait_for_state("stopped")
            box.alone(b"r")
            box.wait_for_state("ready")
        lines = termios.tcgetattr(box.fd)
        lines[3] |= termios.ICANON | termios.ECHO
        termios.tcsetattr(box.fd, termios.TCSANOW, lines)
        box.type(b"s")
        box.wait_for_state("stopped")
        box.type(b"\x03")
        box.wait_for("ticks")
        box.end()


class Ends(unittest.TestCase):
    def leaves_the_terminal(self, shell, how, code, at_rest):
        box = a_box(shell)
        box.type(how) if isinstance(how, bytes) else os.kill(box.pid_of_program(), how)
        if at_rest:
            box.wait_for(r"farhand-slave: \d+ ticks")
        box.wait_for("READY> ")
        box.type(b"echo co''de=$?\n")
        printed = box.wait_for(r"code=\d+").group(0)
        modes = box.modes()
        box.end()
        self.assertEqual((how, shell[0], modes), (how, shell[0], box.before))
        self.assertEqual((how, shell[0], printed), (how, shell[0], f"code={code}"))

    def test_however_it_ends_the_terminal_is_as_before(self):
        rest = [b"\x03", b"\x1c", signal.SIGTERM, signal.SIGHUP, signal.SIGINT, signal.SIGQUIT, signal.SIGUSR1, signal.SIGALRM]
        crash = [signal.SIGSEGV, signal.SIGABRT, signal.SIGFPE, signal.SIGBUS, signal.SIGILL]
        ways = [(how, 130, True) for how in rest] + [(how, 128 + how, False) for how in crash]
        with concurrent.futures.ThreadPoolExecutor(6) as pool:
            for done in [pool.submit(self.leaves_the_terminal, shell, *way) for shell in SHELLS for way in ways]:
                done.result()

    @both_shells
    def test_at_the_end_of_its_time_and_after_a_refusal_the_terminal_is_as_before(self, shell):
        terminal = Terminal(shell)
        before = terminal.modes()
        with tempfile.TemporaryDirectory() as directory:
            scene = pathlib.Path(directory) / "scene.txtpb"
            scene.write_text(SCENE.replace("600", "0.5"))
            slave = f"{BIN}/farhand-slave --scene {scene} --insecure --peer 127.0.0.1:9"
            self.assertEqual(terminal.run(slave)[1], 0)
            self.assertEqual(terminal.modes(), before)
            self.assertEqual(terminal.run(slave + " --record /nowhere/x")[1], 2)
            self.assertEqual(terminal.modes(), before)
            printed, code = terminal.run(slave + " --stop-input /dev/tty")
            self.assertEqual(code, 2)
            self.assertIn("where the operator's keys come from", printed)
            self.assertEqual(terminal.modes(), before)
            self.assertEqual(terminal.run(f"{BIN}/farhand-master --scene {scene} --insecure --listen 127.0.0.1:0 --wait 0.3")[1], 1)
            self.assertEqual(terminal.modes(), before)
        terminal.close()

    @both_shells
    def test_a_terminal_that_closes_brings_it_to_rest(self, shell):
        box = a_box(shell)
        pid = box.pid_of_program()
        os.close(box.fd)
        box.shell.wait()
        self.assertTrue(comes_true(lambda: ended(pid)))
        self.assertEqual(box.asked_for("engage"), 0)
        self.assertTrue(box.record.exists(), "it has come to rest and completed its recording")
        box.directory.cleanup()

    @both_shells
    def test_a_station_that_waits_for_its_peer_can_be_suspended_too(self, shell):
        master = Station(shell, ["farhand-master", "--listen", "127.0.0.1:0"])
        master.wait_for("listening")
        for _ in range(2):
            time.sleep(0.3)
            master.type(b"\x1a")
            master.wait_for("READY> ")
            self.assertEqual(master.modes(), master.before)
            master.type(b"fg\n")
            master.wait_for("farhand-master --scene")
        time.sleep(0.5)
        master.type(b"\x03")
        master.wait_for("READY> ")
        self.assertEqual(master.modes(), master.before)
        master.end()


def one_test(test):
    began, result = time.monotonic(), unittest.TestResult()
    test.run(result)
    problems = result.failures + result.errors
    said = "".join(f"\n{text}" for _, text in problems)
    print(f"{'FAIL' if problems else 'ok'}  {test.id()}  {time.monotonic() - began:.1f} s{said}", flush=True)
    return not problems


def main():
    """They wait most of the time, and so all at once."""
    names = sys.argv[2:] or ["Keys", "Jobs", "Ends"]
    tests = [test for group in unittest.defaultTestLoader.loadTestsFromNames(names, sys.modules[__name__])
             for test in (group if isinstance(group, unittest.TestSuite) else [group])]
    assert len(SHELLS) == 2, f"bash and dash are needed: {SHELLS}"
    with concurrent.futures.ThreadPoolExecutor(len(tests)) as pool:
        sys.exit(0 if all(list(pool.map(one_test, tests))) else 1)


if __name__ == "__main__":
    BIN = pathlib.Path(sys.argv[1]).resolve()
    main()
