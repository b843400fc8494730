// Nobody synchronises clocks: when the clock of the peer started, and how fast it runs, changes nothing that a run is
// judged by. Here over two minutes; over an hour in clock_hour_test.
#include "tests/support/clock_drift.hpp"

namespace farhand {
namespace {

TEST(Clock, WhenItStartedChangesNotOneBit) { ClockDrift(40, 0.02).expect_an_offset_to_change_nothing(); }

TEST(Clock, HowFastItRunsChangesNoNumber) { ClockDrift(120, 0).expect_no_number_to_change(); }

TEST(Clock, HowFastItRunsChangesNoNumberThroughABadNetwork) { ClockDrift(120, 0.02).expect_no_number_to_change(); }

}  // namespace
}  // namespace farhand
