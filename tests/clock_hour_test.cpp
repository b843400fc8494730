// Nobody synchronises clocks, not for an hour either: 200 ppm are then 0.72 s.
#include "tests/support/clock_drift.hpp"

namespace farhand {
namespace {

TEST(ClockOverAnHour, HowFastItRunsChangesNoNumber) { ClockDrift(3600, 0).expect_no_number_to_change(); }

TEST(ClockOverAnHour, HowFastItRunsChangesNoNumberThroughABadNetwork) {
  ClockDrift(3600, 0.02).expect_no_number_to_change();
}

}  // namespace
}  // namespace farhand
