#include <gtest/gtest.h>
#include "slave/mcu/mcu_params.hpp"
TEST(A,B){ farhand::mcu::OrthosisMcu m(farhand::mcu::make_mcu_params({})); EXPECT_EQ(m.step({0,0,0,false}).motor_velocity,0);}
