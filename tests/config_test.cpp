// Scene files: what loads, what is refused and with which words.
#include <gtest/gtest.h>

#include "common/config/load.hpp"
#include "common/config/schema.hpp"

namespace farhand {
namespace {

TEST(ShippedScenes, AllLoad) {
  ASSERT_FALSE(known_scenes().empty());
  for (const std::string& name : known_scenes()) EXPECT_NO_THROW(load_scene(name)) << name;
}

}  // namespace
}  // namespace farhand
