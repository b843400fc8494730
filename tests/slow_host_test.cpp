// What the emulated MCU says of a host that is too slow for it.
#include "slave/slow_host.hpp"

#include <gtest/gtest.h>

namespace farhand {
namespace {

TEST(SlowHost, OfAStallThatIsLongerThanItsLookNothingUntrueIsSaid) {
  LeftOut left_out;
  EXPECT_EQ(left_out.look(39, 2.0), "") << "2 % is usual";
  EXPECT_EQ(left_out.look(39 + 6242, 4.1),
            "this host is too slow: stalls that ended in the last 2.1 s left 6242 ms out of the orthosis' time");
  EXPECT_EQ(left_out.look(39 + 6242, 6.1), "");
  EXPECT_EQ(left_out.look(39 + 6242 + 100, 6.1 + 8.0), "") << "a look that was late itself covers more time";
  EXPECT_NE(left_out.look(39 + 6242 + 300, 6.1 + 16.0), "");
}

TEST(SlowHost, CountsAndEndsAtOnce) {
  SlowHost host;
  host.missed(3);
  host.missed(4);
  EXPECT_EQ(host.stalls(), 2u);
  EXPECT_EQ(host.ms(), 7u);
}

}  // namespace
}  // namespace farhand
