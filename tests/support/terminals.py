"""Real terminals with a shell on them, and the stations that run there. BIN is set by the test that uses them."""
import concurrent.futures
import os
import pathlib
import pty
import re
import shutil
import signal
import subprocess
import tempfile
import threading
import time

BIN = pathlib.Path()
PATIENCE_S = 60
ALONE_S = 0.4  # of silence before a key or a word that is meant
SCENE = "architecture: FOUR_CHANNEL\nduration_s: 600\nslave { device: DIRECT_DRIVE }\n"
SHELLS = [[shutil.which(name), *options] for name, options in (("bash", ["--norc", "--noprofile", "-i"]), ("dash", ["-i"]))
          if shutil.which(name)]


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

    def programs(self):
        """The pids of those that run. A child of the shell is none before it has become the program."""
        children = pathlib.Path(f"/proc/{self.terminal.pid}/task/{self.terminal.pid}/children").read_text().split()
        found = []
        for pid in children:
            try:
                if b"farhand-" in pathlib.Path(f"/proc/{pid}/cmdline").read_bytes():
                    found.append(int(pid))
            except OSError:  # it has ended meanwhile
                pass
        return found

    def pid_of_program(self):
        assert comes_true(lambda: len(self.programs()) == 1), self.programs()
        return self.programs()[0]

    def asked_for(self, act):
        """From the recording, once the program has ended."""
        name = self.record if self.record.exists() else pathlib.Path(f"{self.record}.part")
        return name.read_bytes().count(f"operator: {act}".encode())

    def end(self):
        for pid in self.programs():
            try:
                os.kill(pid, signal.SIGKILL)
            except OSError:  # it has ended meanwhile
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
