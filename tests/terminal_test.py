#!/usr/bin/env python3
"""The stations in real terminals, under bash and dash: what is typed at them, job control, and every way in which they end.

usage: tests/terminal_test.py BIN [TEST]...    BIN holds the built programs. Looks at what happens, never at how fast.
"""
import concurrent.futures
import fcntl
import os
import pathlib
import signal
import struct
import sys
import tempfile
import termios
import time
import unittest

sys.dont_write_bytecode = True  # the checkout stays as it is
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent / "support"))
import terminals
from terminals import ALONE_S, SCENE, SHELLS, Session, Station, Terminal, a_box, both_shells, comes_true, ended

STOP_KEYS = [b"s", b"S", b"q", b"Q", b" ", b"\x1b", b"\r", b"\x04", b"\x13", b"\x1b[A"]
STOP_WORDS = [b"stop\r", b"STOP\r", b"Stop\r", b"Meier\r"]


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
        self.assertEqual((box.asked_for("reset"), box.asked_for("engage")), (0, 0))
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
        self.assertEqual([master.asked_for(act) for act in ("engage", "reset", "stop")], [0, 0, 0])
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
            script.write_text(f"{terminals.BIN}/farhand-slave --scene {scene} --insecure --peer 127.0.0.1:9 <&0 &\nwait\n")
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
            slave = f"{terminals.BIN}/farhand-slave --scene {scene} --insecure --peer 127.0.0.1:9"
            self.assertEqual(terminal.run(slave)[1], 0)
            self.assertEqual(terminal.modes(), before)
            self.assertEqual(terminal.run(slave + " --record /nowhere/x")[1], 2)
            self.assertEqual(terminal.modes(), before)
            printed, code = terminal.run(slave + " --stop-input /dev/tty")
            self.assertEqual(code, 2)
            self.assertIn("where the operator's keys come from", printed)
            self.assertEqual(terminal.modes(), before)
            self.assertEqual(terminal.run(f"{terminals.BIN}/farhand-master --scene {scene} --insecure --listen 127.0.0.1:0 --wait 0.3")[1], 1)
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
    terminals.BIN = pathlib.Path(sys.argv[1]).resolve()
    main()
