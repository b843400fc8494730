#include <gtest/gtest.h>

#include "common/plant/direct_slave_world.hpp"
#include "common/plant/master_world.hpp"
#include "common/plant/series_elastic_world.hpp"
namespace farhand {
TEST(World, Compiles) {
  MasterWorld m({});
  m.advance(0, 0, 1e-3);
  DirectSlaveWorld d({});
  d.advance(0, 0, 1e-3);
  SeriesElasticWorld s({});
  s.advance(0, 0, 1e-3);
}
}  // namespace farhand
