"""What is shipped is hardened: read from the ELF files that the release build has made, not from the flags that it was asked for.

usage: hardening_test.py FILE...    FILE: a program or a library that is shipped
"""
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

FILES = []
ENDBR64 = b"\xf3\x0f\x1e\xfa"
# Of these the C library has a checked form that FORTIFY always puts in their place. Not vsnprintf: std::to_string takes its address.
FORTIFIED = {"printf", "fprintf", "sprintf", "snprintf", "vprintf", "vfprintf", "vsprintf", "dprintf", "vdprintf"}
# Not ours: what the compiler's and the C library's start files bring.
STARTUP = {"_start", "_init", "_fini", "_dl_relocate_static_pie"}


def readelf(*arguments):
    return subprocess.run(["readelf", "-W", *map(str, arguments)], capture_output=True, text=True, check=True).stdout


class Elf:
    def __init__(self, path):
        self.path = pathlib.Path(path)
        self.header = readelf("-h", path)
        self.segments = readelf("-l", path)
        self.dynamic = readelf("-d", path)
        self.sections = readelf("-S", path)
        self.is_program = "INTERP" in self.segments

    def segment_flags(self, kind):
        """One string of R, W and E for each segment of that kind."""
        rows = re.findall(rf"^\s+{kind}\s+(?:0x[0-9a-f]+\s+){{5}}(.*?)\s+0x[0-9a-f]+$", self.segments, re.MULTILINE)
        return [row.replace(" ", "") for row in rows]

    def imported(self):
        return set(re.findall(r"\bUND (\w+)", readelf("--dyn-syms", self.path)))

    def functions(self):
        """(name, address) of every function that other files may call or that a header has brought."""
        row = re.compile(r"^\s*\d+: ([0-9a-f]+)\s+\d+ FUNC\s+(?:GLOBAL|WEAK)\s+\w+\s+\d+ (\S+)", re.MULTILINE)
        return {(name, int(address, 16)) for address, name in row.findall(readelf("-s", self.path))}

    def text(self):
        """Where the code stands, and its bytes."""
        row = re.search(r"\] \.text\s+PROGBITS\s+([0-9a-f]+) ([0-9a-f]+) ([0-9a-f]+)", self.sections)
        address, offset, size = (int(number, 16) for number in row.groups())
        return address, self.path.read_bytes()[offset:offset + size]


def of_each(check):
    def test(self):
        self.assertTrue(FILES, "no file was given")
        for path in FILES:
            with self.subTest(file=pathlib.Path(path).name):
                check(self, Elf(path))
    return test


class Hardening(unittest.TestCase):
    @of_each
    def test_loads_at_an_address_of_its_own_each_time(self, elf):
        self.assertIn("DYN (", elf.header)
        self.assertNotIn("TEXTREL", elf.dynamic)
        if elf.is_program:
            self.assertRegex(elf.dynamic, r"FLAGS_1\).*\bPIE\b")

    @of_each
    def test_addresses_of_functions_are_read_only_once_it_runs(self, elf):
        self.assertIn("GNU_RELRO", elf.segments)
        self.assertTrue(re.search(r"BIND_NOW|FLAGS_1\).*\bNOW\b", elf.dynamic), "functions are bound at their first call")

    @of_each
    def test_nothing_is_writable_and_executable(self, elf):
        self.assertEqual(elf.segment_flags("GNU_STACK"), ["RW"])
        loaded = elf.segment_flags("LOAD")
        self.assertIn("RE", loaded)
        for flags in loaded:
            self.assertFalse({"W", "E"} <= set(flags), f"a segment is {flags}")

    @of_each
    def test_looks_for_libraries_where_the_system_has_them_only(self, elf):
        self.assertNotRegex(elf.dynamic, r"RPATH|RUNPATH")

    @of_each
    def test_an_overwritten_stack_is_noticed(self, elf):
        if elf.is_program:  # a library of ours may have no function with an array
            self.assertTrue("__stack_chk_fail" in elf.imported(), "no function has a canary")

    @of_each
    def test_copies_and_formats_are_checked(self, elf):
        imported = elf.imported()
        self.assertEqual(imported & FORTIFIED, set())
        if elf.is_program:
            self.assertTrue([name for name in imported if name.endswith("_chk")], "no checked function is used")

    @of_each
    def test_every_function_is_marked_as_the_target_of_a_call(self, elf):
        # Indirect branch tracking. The mark on the whole file (a GNU property) is the linker's, which sets it only where the start files
        # of the C library have it too; those of Debian 12 do not.
        if "X86-64" not in elf.header:
            self.skipTest("x86 only")
        begin, code = elf.text()
        ours = [(name, at - begin) for name, at in elf.functions() if name not in STARTUP and begin <= at < begin + len(code)]
        unmarked = [name for name, at in ours if code[at:at + len(ENDBR64)] != ENDBR64]
        self.assertTrue(ours)
        self.assertEqual(len(unmarked), 0, f"the first of {len(ours)}: {unmarked[:5]}")


class TheTestItself(unittest.TestCase):
    def test_finds_what_is_not_hardened(self):
        """A program built with everything off fails each of the checks above."""
        source = '#include <cstdio>\nint main(int n, char**) { char t[64]; std::snprintf(t, 64, "%d", n); return t[0]; }\n'
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "soft"
            subprocess.run(["c++", "-x", "c++", "-", "-O1", "-U_FORTIFY_SOURCE", "-fno-stack-protector", "-fcf-protection=none", "-no-pie",
                            "-fno-pie", "-Wl,-z,norelro", "-Wl,-z,lazy", "-Wl,-z,execstack", "-Wl,-rpath,/tmp", "-o", path],
                           input=source, text=True, check=True)
            saved = FILES[:]
            FILES[:] = [path]
            try:
                names = [name for name in dir(Hardening) if name.startswith("test_")]
                found = {name for name in names if not unittest.TestSuite([Hardening(name)]).run(unittest.TestResult()).wasSuccessful()}
            finally:
                FILES[:] = saved
        self.assertEqual(found, set(names))


if __name__ == "__main__":
    FILES = sys.argv[1:]
    unittest.main(argv=sys.argv[:1], verbosity=2)
