#include "netem/lab/commands.hpp"

#include <array>

namespace farhand {
namespace {

constexpr std::array kCommands{
    LabCommand{"run", "run a scene in virtual time; exit code 3 if the verdict is failed", add_run},
    LabCommand{"check", "say everything that is wrong with scene files", add_check},
    LabCommand{"limits", "where observers, force loop and sampled walls cease to be stable", add_limits},
    LabCommand{"schema", "every setting with unit, range, default and meaning, and every metric", add_schema},
    LabCommand{"directory",
               "make sessions/UTC-SCENE-SEED for the recordings of a session; prints it, the scene file in it and the "
               "device of the slave",
               add_directory},
    LabCommand{"report", "merge the recordings of a session's processes and report", add_report},
    LabCommand{"compare", "sessions side by side: recordings of processes, and scenes run now", add_compare},
    LabCommand{"precision",
               "error of position and force against wall time: every integrator in the bare loop of a scene",
               add_precision},
    LabCommand{"sweep",
               "whole sessions of a scene over ranges of its settings, on all cores; --set field=from:to:count",
               add_sweep},
    LabCommand{"recording", "mend or export a recording", add_recording},
    LabCommand{"endure",
               "repeat the session of a scene for hours of virtual time: error, energy and memory of each hour",
               add_endure},
    LabCommand{"explain",
               "the blocks of a scene and those it leaves out, each with reason, time and bytes, and its integrators",
               add_explain},
    LabCommand{"extreme",
               "run the catalogue of stiff and extreme cases; exit code 3 if one comes out otherwise than expected",
               add_extreme},
    LabCommand{"faults", "run the fault matrix in virtual time; exit code 3 if a row comes out otherwise than expected",
               add_faults},
    LabCommand{"rogue",
               "search for what a peer with the right key, or an MCU that lies, can do to a person; exit code 3 if a "
               "line is crossed",
               add_rogue},
    LabCommand{"identify",
               "inertia, friction and spring of an axis from a recording in which it was moved without a hand in it; "
               "exit code 3 if it is another one than the scene says",
               add_identify},
};

}  // namespace

std::span<const LabCommand> lab_commands() { return kCommands; }

}  // namespace farhand
